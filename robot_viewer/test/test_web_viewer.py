# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node of the page, over DDS; what a browser does is called as the page calls it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import closing, contextmanager
from functools import partial
from importlib import import_module
import math
import socket
import sys
import threading
import time
from typing import Any

from canopen_interfaces.srv import CONmtID
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped, TwistStamped
from isolation import Isolation
import pytest
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.action.server import ActionServer, CancelResponse
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.service import Service
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage
from urdf_robots import ARM
from viewer_rig import in_domain, ViewerRig
from viser import GuiEvent

from node_runner import LATCHED, ParameterError
from robot_viewer.nodes import controllers as controllers_module
from robot_viewer.nodes import listening, state, web_viewer
from robot_viewer.nodes.controllers import Controller
from robot_viewer.nodes.web_viewer import WebViewer
from robot_viewer.page.jog_panel import TargetPanel
from robot_viewer.page.robot_page import RobotPage
from robot_viewer.robot_state import ALLOW, Stop

pytestmark = pytest.mark.scenario

TWIST = (0.0, 0.0, 0.3, 0.0, 0.0, 0.0)
TWO_SLIDERS = """
<robot name="two"><link name="0"/><link name="1"/><link name="2"/>
  <joint name="a" type="revolute"><parent link="0"/><child link="1"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><parent link="1"/><child link="2"/>
    <limit lower="-2" upper="2" velocity="9" effort="1"/></joint>
</robot>
"""
BAD_ORIGIN = """
<robot name="r"><link name="a"><visual><origin xyz="1 2"/>
  <geometry><sphere radius="1"/></geometry></visual></link></robot>
"""


class Robot(ViewerRig):
    """What the page meets: services of drives, a servo, and a viewer beside it."""

    def __init__(self) -> None:
        super().__init__(Node('robot'))
        self.calls: list[str] = []
        self.success = True
        self.jogs: list[TwistStamped] = []
        self.states: list[JointState] = []
        for drive in ('joint1', 'joint2'):
            for verb in ('halt', 'quick_stop', 'enable'):
                self.node.create_service(
                    Trigger, f'{drive}/{verb}', self._answer(f'{drive}/{verb}')
                )
        self.node.create_service(Trigger, 'other/halt', self._answer('other/halt'))
        self.node.create_subscription(
            TwistStamped, 'servo_node/delta_twist_cmds', self.jogs.append, 10
        )
        self.node.create_subscription(JointState, 'joint_states', self.states.append, 10)
        self.description = self.node.create_publisher(String, 'robot_description', LATCHED)

    def offer_stop(self) -> Service:
        """Offer to stop all of it, as a master does."""
        self.node.create_service(CONmtID, '~/set_nmt', lambda _, response: response)
        return self.node.create_service(Trigger, 'stop', self._answer('stop'))

    def answers(self) -> list[str]:
        """Listen to what the page reports of the robot."""
        found: list[str] = []

        def take(message: DiagnosticArray) -> None:
            found.extend(s.message for s in message.status if s.name == 'web_viewer: robot')

        self.node.create_subscription(DiagnosticArray, 'diagnostics', take, 10)
        return found

    def has_called(self, services: list[str]) -> bool:
        """Whether these were called, in this order."""
        return self.calls == services

    def called_until_enable(self) -> list[str]:
        """Return what the page has called, in order of names, when it has enabled both drives.

        What it requested before has come by then, and was served, as it was offered before.
        """
        enables = {'joint1/enable', 'joint2/enable'}
        for service in enables:
            self.viewer.actions.call('Enable', [f'/{service}'])
        self.spin_until(lambda: enables <= set(self.calls), 'enable')
        called = sorted(each for each in self.calls if each not in enables)
        self.calls.clear()
        return called

    def answer_to(self, stop: Future[Stop]) -> Stop:
        """Serve until the robot has answered to a STOP, and return what."""
        self.spin_until(stop.done, 'an answer')
        return stop.result()

    def _answer(
        self, name: str
    ) -> Callable[[Trigger.Request, Trigger.Response], Trigger.Response]:
        def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            self.calls.append(name)
            response.success, response.message = self.success, 'done'
            return response

        return answer


def state_message() -> Any:
    """Return a state of a controller of two joints."""
    state = import_module('control_msgs.msg').JointTrajectoryControllerState()
    state.joint_names = ['a', 'b']
    state.feedback.positions = state.reference.positions = [0.5, -0.25]
    return state


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Have a page open, without a browser; what is last in the list counts."""
    state = [True]
    monkeypatch.setattr(RobotPage, 'watched', property(lambda _: state[-1]))
    return state


@pytest.fixture
def said(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Collect what the page says."""
    texts: list[str] = []
    monkeypatch.setattr(robot.viewer.page._log, 'add', lambda *entry: texts.append(entry[2]))
    return texts


@pytest.fixture
def robot(isolation: Isolation, opened: list[bool]) -> Iterator[Robot]:
    """Start the page beside a robot."""
    assert opened
    with in_domain(isolation, 'port:=8500'), closing(Robot()) as made:
        yield made


def test_stop_halts_every_drive(robot: Robot) -> None:
    """And nothing that merely has a service of that name."""
    robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
    answer = robot.viewer.actions.stop()
    assert robot.called_until_enable() == ['joint1/halt', 'joint2/halt']
    assert robot.answer_to(answer) == Stop(stands=True, text='done. done')
    robot.viewer.actions.call(
        'Enable', ['/nobody/enable']
    )  # after good answers one that fails, which is a warning
    assert not robot.called_until_enable()


def test_stop_is_answered_by_the_robot_alone(robot: Robot, said: list[str]) -> None:
    """Not by a robot that refuses, by none, or by one whose process hangs or has ended."""
    answer = robot.viewer.actions.stop()
    assert robot.answer_to(answer) == Stop(stands=False, text='nothing here offers to be stopped')
    robot.success = False
    robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
    answer = robot.viewer.actions.stop()
    robot.called_until_enable()
    assert robot.answer_to(answer) == Stop(stands=False, text='/joint1/halt: done')
    robot.success = True
    context = Context()
    rclpy.init(args=[], context=context, domain_id=robot.node.context.get_domain_id())
    hung = Node('hung', context=context)  # it serves nothing
    hung.create_service(CONmtID, '~/set_nmt', lambda _, response: response)  # as a master has it
    hung.create_service(Trigger, 'stop', lambda _, response: response)
    robot.spin_until(lambda: '/stop' in robot.viewer._stops, 'the service')
    client = robot.viewer._triggers.client('/stop')
    robot.spin_until(client.service_is_ready, 'a connection')
    answer = robot.viewer.actions.stop()
    robot.spin_until(lambda: said[-1:] == ['STOP: no answer from the robot yet'], 'the request')
    assert not robot.called_until_enable()
    assert not answer.done(), 'the one that was asked has not answered'
    hung.destroy_node()
    rclpy.shutdown(context=context)
    robot.spin_until(lambda: not client.service_is_ready(), 'its end')
    answer = robot.viewer.actions.stop()
    robot.called_until_enable()
    assert robot.answer_to(answer) == Stop(stands=False, text='/stop: its service is not there')


def test_stop_calls_one_service_that_stops_all(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The drives one by one only where it is gone: a master that ends, or a cut link.

    It is that of the robot also while the graph does not show the node that offers it.
    """
    service = robot.offer_stop()
    robot.spin_until(lambda: '/stop' in robot.viewer._stops, 'the service')
    robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
    robot.viewer.actions.stop()
    robot.spin_until(lambda: 'stop' in robot.calls, 'the stop')
    assert robot.called_until_enable() == ['stop']
    with monkeypatch.context() as lost:  # as after a stall that is longer than the lease of DDS
        lost.setattr(robot.viewer, 'get_node_names_and_namespaces', list)
        answer = robot.viewer.actions.stop()
        assert robot.answer_to(answer) == Stop(stands=True, text='done')
        assert robot.called_until_enable() == ['stop']
    robot.node.destroy_service(service)
    client = robot.viewer._triggers.client('/stop')
    robot.spin_until(lambda: not client.service_is_ready(), 'its end')
    robot.viewer.actions.stop()
    assert robot.called_until_enable() == ['joint1/halt', 'joint2/halt']


@contextmanager
def conveyor(isolation: Isolation, kind: Any, *, success: bool = False) -> Iterator[list[Any]]:
    """Run a process's worth of somebody else with a service `stop`; yield what it was asked."""
    context = Context()
    rclpy.init(args=[], context=context, domain_id=isolation.domain_id)
    node, asked = Node('conveyor', context=context), []

    def answer(request: Any, response: Any) -> Any:
        asked.append(request)
        if success:
            response.success = True
        return response

    node.create_service(kind, 'stop', answer)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    try:
        yield asked
    finally:
        executor.shutdown()
        thread.join()
        node.destroy_node()
        rclpy.shutdown(context=context)


@pytest.mark.parametrize('kind', [Trigger, Empty])
def test_a_stop_of_somebody_else_leaves_no_drive_moving(
    robot: Robot, isolation: Isolation, monkeypatch: pytest.MonkeyPatch, kind: Any
) -> None:
    """Each drive is halted, whatever type it has; also beside a master, unless it has another."""
    reports: list[str] = []
    monkeypatch.setattr(robot.viewer.page, 'say', lambda text, **_: reports.append(text))
    robot.node.create_client(Trigger, 'stop')  # as keyboards have one
    halts = ['joint1/halt', 'joint2/halt']
    is_asked = kind is Trigger

    def stopped() -> list[str]:
        robot.viewer.actions.stop()
        return robot.called_until_enable()

    def reached() -> bool:  # the connection with the first server hides that with the second
        robot.viewer.actions.stop()
        return 'stop' in robot.calls

    def named() -> int:
        return sum(
            each.startswith('/stop: offered by /conveyor, which leads neither') for each in reports
        )

    with conveyor(isolation, kind) as asked:
        robot.spin_until(lambda: '/stop' in robot.viewer._stops, 'the service')
        robot.spin_until(lambda: robot.node.count_services('/stop') == 1, 'its server')
        robot.spin_until(lambda: 'conveyor' in robot.viewer.get_node_names(), 'its node')
        robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
        client = robot.viewer._triggers.client('/stop')
        robot.spin_until(lambda: client.service_is_ready() or not is_asked, 'a connection')
        assert stopped() == halts
        assert named() == is_asked
        robot.spin_until(lambda: bool(asked) or not is_asked, 'the request')
        robot.offer_stop()
        robot.spin_until(lambda: robot.node.count_services('/stop') == 2, 'the master')
        robot.spin_until(client.service_is_ready, 'a connection')
        robot.spin_until(reached, 'the stop')
        assert set(robot.called_until_enable()) == {*(halts if is_asked else ()), 'stop'}
        assert (named() > 1) is is_asked
        assert is_asked or not asked
    robot.spin_until(lambda: robot.node.count_services('/stop') == 1, 'the end of the other one')
    assert stopped() == ['stop']


def test_a_stop_of_somebody_else_is_no_answer_of_the_robot(
    robot: Robot, isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A node that leads neither drives nor legs has confirmed, and there are no drives."""
    monkeypatch.setattr(web_viewer, 'of_robot', lambda *_: [])
    with conveyor(isolation, Trigger, success=True) as asked:
        robot.spin_until(lambda: '/stop' in robot.viewer._stops, 'the service')
        client = robot.viewer._triggers.client('/stop')
        robot.spin_until(client.service_is_ready, 'a connection')
        answer = robot.viewer.actions.stop()
        robot.spin_until(lambda: bool(asked), 'the request')
        assert not robot.answer_to(answer).stands


def test_who_does_not_look_takes_no_messages(
    robot: Robot, opened: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each costs time; STOP and what the robot offers are there all the same."""
    topics = ('joint_states', '/tf', 'diagnostics')

    def listeners() -> list[int]:
        return [robot.node.count_subscribers(topic) for topic in topics]

    robot.spin_until(lambda: listeners() == [2, 1, 1], 'subscriptions')
    monkeypatch.setattr(listening, 'LINGER', 0.1)
    opened.append(False)
    robot.spin_until(lambda: listeners() == [1, 0, 1], 'their end')
    robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
    robot.viewer.actions.stop()
    robot.spin_until(lambda: len(robot.calls) == 2, 'halts')
    robot.viewer._listening.add(JointState, 'more', lambda _: None)
    assert not robot.node.count_subscribers('more')
    opened.append(True)
    robot.spin_until(lambda: listeners() == [2, 1, 1], 'subscriptions again')
    robot.spin_until(lambda: robot.node.count_subscribers('more') == 1, 'the new one')


def test_each_message_between_two_pictures_counts(robot: Robot, opened: list[bool]) -> None:
    """Of two that come together the joints of both are shown, and where the root is.

    Its place comes among those of its links, which are more, and behind that of its map.
    """
    assert opened
    robot.spin_until(lambda: bool(robot.node.count_subscribers('/tf')), 'subscriptions')
    states = robot.node.create_publisher(JointState, 'joint_states', 10)
    frames = robot.node.create_publisher(TFMessage, '/tf', 10)
    robot.spin_until(lambda: states.get_subscription_count() == 2, 'the match')
    robot.spin_until(lambda: frames.get_subscription_count() == 1, 'the match')
    for x in (0.25, 0.5, 0.75):
        robot.viewer._root = ''
        robot.description.publish(String(data=TWO_SLIDERS))
        robot.spin_until(lambda: robot.viewer._root == '0', 'the robot')
        for joint in 'ab':
            states.publish(JointState(name=[joint], position=[x]))
        for child in '1201':
            frame = TransformStamped(child_frame_id=child)
            frame.transform.translation.x = x
            odom = TransformStamped(child_frame_id='odom')
            frames.publish(TFMessage(transforms=[odom, frame]))

        def is_shown(x: float = x) -> bool:
            viewer = robot.viewer
            return viewer._drawn == {'a': x, 'b': x} and viewer._shown_base.translation[0] == x

        robot.spin_until(is_shown, f'{x} rad and m')


def test_each_heartbeat_is_one_command(robot: Robot) -> None:
    """Of the tool, along the axes of the base or of a link, or of one joint.

    Nothing goes on by itself: a page that is gone moves nothing.
    """
    kind = import_module('control_msgs.msg').JointJog
    joint_jogs: list[Any] = []
    robot.node.create_subscription(kind, 'servo_node/delta_joint_cmds', joint_jogs.append, 10)
    viewer = robot.viewer

    def connected() -> bool:
        publishers = viewer._jogs, viewer._joint_jogs
        return all(each is not None and each.get_subscription_count() for each in publishers)

    robot.spin_until(connected, 'the servo')
    for _ in range(3):
        viewer.actions.jog(TWIST, 'link7')
    viewer.actions.jog_joint('joint1', -0.3)
    robot.spin_until(lambda: len(robot.jogs) == 3 and bool(joint_jogs), 'jogs')
    assert robot.jogs[0].twist.linear.z == pytest.approx(0.3)
    assert robot.jogs[0].header.frame_id == 'link7'
    assert robot.jogs[0].header.stamp.sec > 0
    assert list(joint_jogs[0].joint_names) == ['joint1']
    assert list(joint_jogs[0].velocities) == [-0.3]
    assert joint_jogs[0].header.stamp.sec > 0
    robot.spin_times(20)
    assert len(robot.jogs) == 3
    assert len(joint_jogs) == 1


@pytest.mark.parametrize(
    ('scales', 'velocity'),
    [
        (('unitless', 0.4, 0.0), 0.2),
        (('unitless', 0.4, 0.5), 0.1),
        (('speed_units', 0.4, 0.0), 0.4),
        (('unitless', 0.0, 0.0), None),
    ],
)
def test_the_speed_of_the_tool_is_that_of_the_servo(
    robot: Robot,
    monkeypatch: pytest.MonkeyPatch,
    scales: tuple[str, float, float],
    velocity: float | None,
) -> None:
    """At half of it; of a servo that names none it is unknown."""
    monkeypatch.setattr(RobotPage, 'watched', True)
    asked: list[str] = []
    units, scale, override = scales

    def answer(request: GetParameters.Request, response: Any) -> Any:
        asked[:] = request.names
        response.values = [
            ParameterValue(string_value=units),
            ParameterValue(double_value=scale),
            ParameterValue(double_value=override),
        ]
        return response

    robot.node.create_service(GetParameters, 'servo_node/get_parameters', answer)
    page = robot.viewer.page
    robot.spin_until(lambda: bool(asked) and bool(page.velocity or not velocity), 'its scales')
    assert asked[1] == 'moveit_servo.scale.linear'
    assert (page.velocity and page.velocity(0.5)) == (velocity and pytest.approx(velocity))


def test_a_gripper_is_opened_closed_and_stopped(robot: Robot, said: list[str]) -> None:
    """To the ends of its joint; the single joints that are jogged are those of the arm."""
    control = import_module('control_msgs.action')
    goals: list[Any] = []
    canceled: list[Any] = []

    def begin(handle: Any) -> None:
        goals.append(handle)
        if len(goals) < 4:  # the fourth one goes on
            handle.execute()

    def execute(handle: Any) -> Any:
        handle.succeed()
        return control.GripperCommand.Result(position=2.0, reached_goal=True)

    def cancel(handle: Any) -> CancelResponse:
        canceled.append(handle)
        return CancelResponse.ACCEPT

    ActionServer(
        robot.node,
        control.GripperCommand,
        'hand/gripper_cmd',
        execute,
        handle_accepted_callback=begin,
        cancel_callback=cancel,
    )
    joint_jog = import_module('control_msgs.msg').JointJog
    robot.node.create_subscription(joint_jog, 'servo_node/delta_joint_cmds', print, 10)
    state = state_message()
    state.joint_names, state.feedback.positions = ['b'], [0.0]
    state.reference.positions = [0.0]
    states = robot.node.create_publisher(type(state), 'hand/controller_state', 10)
    robot.description.publish(String(data=TWO_SLIDERS))

    def found() -> bool:
        states.publish(state)
        return robot.viewer._offered().grippers == (('/hand', 'b'),)

    robot.spin_until(found, 'the gripper')
    assert robot.viewer._offered().joints == ('a',)
    client = robot.viewer._grippers._found['/hand'].client
    robot.spin_until(client.server_is_ready, 'its action')
    for end, word in ((2.0, 'open'), (-2.0, 'close'), (0.5, 'to 0.5000')):
        robot.viewer.actions.grip('/hand', end)
        done = partial(said.__contains__, f'/hand: {word}: done, at 2.0000')
        robot.spin_until(done, 'the end')
        assert goals[-1].request.command.position == end
    robot.viewer.actions.grip('/hand', 2.0)
    robot.spin_until(lambda: len(goals) == 4, 'a goal')
    robot.spin_until(lambda: robot.viewer._grippers.busy, 'a motion of it')
    robot.viewer.actions.stop()
    robot.spin_until(lambda: bool(canceled), 'its end')
    assert not robot.viewer._grippers.busy
    panel = robot.viewer.page._jog
    assert panel is not None
    panel._grip('Open gripper', '/hand', lambda: 2.0)
    assert said[-1] == f'Open gripper: stopped; press {ALLOW} first'
    assert len(goals) == 4
    robot.viewer.actions.grip('/hand', 2.0)
    robot.spin_until(lambda: len(goals) == 5, 'a goal')
    assert robot.viewer._grippers.busy
    robot.viewer._grippers.look({}, {})  # its server died before the result
    assert not robot.viewer._grippers.busy
    assert said[-1].startswith('/hand: its action is gone')
    robot.viewer.actions.stop()
    # it was missing in the graph only, and goes on
    robot.spin_until(lambda: len(canceled) == 2, 'the end of its motion')


def test_the_page_keeps_what_the_robot_warns_of(robot: Robot) -> None:
    """As /rosout has it, the last first and once each; notes are left out, and other robots."""
    logger = robot.node.get_logger()
    robot.spin_until(lambda: robot.node.count_subscribers('/rosout') > 0, 'the page')
    page = robot.viewer.page

    def warned() -> bool:
        logger.warning('joint1: near its <limit>')
        return 'near its &lt;limit&gt;' in page._log.html

    def failed() -> bool:
        logger.error('joint1: stalled')
        return 'joint1: stalled' in page._log.html

    logger.info('a note')
    robot.spin_until(warned, 'the warning')
    robot.spin_until(failed, 'the error')
    assert page._log.html.index('stalled') < page._log.html.index('near its')
    assert page._log.html.count('near its') == 1
    assert '<b>/robot</b>' in page._log.html
    assert 'a note' not in page._log.html
    page.say('target: reached')
    robot.spin_until(lambda: 'target: reached' in page._log_html.content, 'it')
    for icon in '✓⚠✖':  # not by color alone
        assert icon in page._log.html


def test_a_robot_that_is_out_of_reach_is_said_to_be(
    robot: Robot, opened: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A link that is cut looks like an arm that stands still; the words go when it comes back."""
    states = robot.node.create_publisher(JointState, 'joint_states', 10)
    robot.description.publish(String(data=ARM))
    answers = robot.answers()

    def received() -> bool:
        states.publish(JointState(name=['a'], position=[0.5]))
        return bool(answers) and answers[-1].startswith('READY: ')

    def gone() -> bool:
        return answers[-1].startswith('NO CONTACT WITH THE ROBOT: Nothing for ')

    robot.spin_until(received, 'joint states')
    robot.spin_until(gone, 'the words')
    assert not robot.viewer.page.live.movable
    robot.spin_until(received, 'their end')
    robot.node.destroy_publisher(states)  # as a link that was cut for long looks
    robot.spin_until(lambda: not robot.node.count_publishers('joint_states'), 'its end')
    opened.append(False)
    monkeypatch.setattr(listening, 'LINGER', 0.1)
    robot.spin_until(lambda: robot.node.count_subscribers('joint_states') == 1, 'a closed page')
    opened.append(True)
    robot.spin_until(gone, 'the words again')


def test_after_stop_the_page_moves_nothing_until_that_is_allowed(robot: Robot) -> None:
    """It is allowed by the action of the state, which moves nothing; an older action does not."""
    robot.description.publish(String(data=ARM))
    robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
    answers, page = robot.answers(), robot.viewer.page
    robot.spin_until(lambda: bool(answers) and answers[-1].startswith('READY: '), 'the robot')
    page._stop()
    assert page.live.stopped
    robot.spin_until(lambda: answers[-1].startswith('STOPPED: Done'), 'the answer')
    robot.viewer.actions.act('Recover joint1')
    robot.spin_times(5)
    assert page.live.stopped
    robot.viewer.actions.act(ALLOW)
    robot.spin_until(lambda: answers[-1].startswith('READY: '), 'an end')
    assert not page.live.stopped
    robot.success = False
    page._stop()
    robot.spin_until(lambda: answers[-1].startswith('STOP NOT CONFIRMED: '), 'no confirmation')


def test_the_action_calls_one_group_of_services_after_the_other(
    robot: Robot, said: list[str]
) -> None:
    """Enabling is init and the mode; a refusal ends it, and is the answer."""
    statuses = robot.node.create_publisher(DiagnosticArray, 'diagnostics', 10)
    for verb in ('init', 'cyclic_position_mode'):
        robot.node.create_service(Trigger, f'joint1/{verb}', robot._answer(verb))
    off = DiagnosticStatus(name='joint1: drive', level=b'\x00', message='off')
    off.values.append(KeyValue(key='state', value='Switch on disabled'))
    robot.description.publish(String(data=ARM))
    answers = robot.answers()

    def offered() -> bool:
        statuses.publish(DiagnosticArray(status=[off]))
        state = robot.viewer._judge._state
        return state.action == 'Enable joint1' and all(state.calls)

    for success, called in ((False, ['init']), (True, ['init', 'cyclic_position_mode'])):
        robot.success = success
        robot.spin_until(offered, 'the action')
        robot.spin_until(
            lambda: answers[-1:] == ['NOT ENABLED: 1 of 1 drives have no torque.'], 'the state'
        )
        robot.spin_until(
            lambda: robot.viewer._triggers.client('/joint1/init').service_is_ready(), 'init'
        )
        robot.spin_until(
            lambda: robot.viewer._triggers.client(
                '/joint1/cyclic_position_mode'
            ).service_is_ready(),
            'the mode',
        )
        robot.viewer.actions.act('Enable joint1')
        robot.spin_until(partial(robot.has_called, called), 'calls')
        robot.spin_until(lambda: not robot.viewer._judge._acting, 'the end')
        robot.calls.clear()
    answered: list[bool] = []
    robot.viewer._triggers.call_all('Home joint1', [], answered.append)
    assert answered == [False], 'a drive may lack what another one has'
    assert said[-1] == 'Home joint1: is not offered'
    assert not robot.viewer._triggers.running


def targets_of(robot: Robot) -> tuple[list[Any], Controller, TargetPanel]:
    """Show a controller of two joints; return what it is sent, it, and its panel."""
    sent: list[Any] = []
    kind = import_module('trajectory_msgs.msg').JointTrajectory  # no dependency of the package
    state = state_message()
    state.feedback.positions, state.reference.positions = [0.5, -9.0], [0.504, -9.004]
    robot.node.create_subscription(kind, 'arm_controller/joint_trajectory', sent.append, 10)
    states = robot.node.create_publisher(type(state), 'arm_controller/controller_state', 10)
    robot.description.publish(String(data=TWO_SLIDERS))
    controllers = robot.viewer._controllers

    def known() -> bool:
        states.publish(state)
        found = controllers.found.get('/arm_controller')
        return (
            found is not None
            and bool(found.joints)
            and robot.node.count_publishers('arm_controller/joint_trajectory') > 0
            and found.commands.get_subscription_count() > 0
            and robot.viewer.page._jog is not None
            and robot.viewer.page._jog.target is not None
        )

    robot.spin_until(known, 'the controller')
    panel = robot.viewer.page._jog
    assert panel is not None
    assert panel.target is not None
    return sent, controllers.found['/arm_controller'], panel.target


def test_a_target_moves_its_joint_alone(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """The others stay at their references, also outside of their sliders, or go on as they were.

    A stop forgets all; what follows is a new request, which an empty trajectory says.
    """
    monkeypatch.setattr(controllers_module, 'RELEASED_AFTER', math.inf)
    sent, controller, target = targets_of(robot)
    controllers = robot.viewer._controllers
    sliders = target._sliders

    def slide(joint: str, position: float) -> None:
        """Move a slider as a browser does."""
        slider = sliders[joint]
        slider._impl.value = position
        for callback in slider._impl.update_cb:
            asyncio.run(callback(GuiEvent(None, 7, slider)) or pytest.fail('in no order'))

    slide('a', 0.9)
    slide('a', 1.0)
    robot.spin_times(20)
    assert not sent, 'a slider moves the target only'
    target._move()
    target._move()
    robot.spin_until(lambda: bool(sent), 'a trajectory')
    (point,) = sent[0].points
    assert list(sent[0].joint_names) == ['a', 'b']
    assert list(point.positions) == [1.0, -9.004]
    assert list(point.velocities) == list(point.accelerations) == [0.0, 0.0]
    assert point.time_from_start.sec + point.time_from_start.nanosec * 1e-9 > 4.5  # 15/8 of 2.5
    assert controller.busy
    slide('b', -1.0)
    target._move()
    robot.spin_until(lambda: len(sent) == 2, 'another trajectory')
    assert list(sent[1].points[0].positions) == [1.0, -1.0]
    slide('a', 99.0)  # a number may be typed
    target._move()
    robot.spin_until(lambda: len(sent) == 3, 'another trajectory')
    assert list(sent[2].points[0].positions) == [2.0, -1.0]
    slide('a', 0.0)
    target._move()
    robot.viewer.actions.stop()
    robot.spin_times(20)
    assert len(sent) == 3
    assert not controller.busy
    assert controllers.history.of('a')[1][-1] == 0.504
    monkeypatch.setattr(controllers_module, 'SETTLING_TIMEOUT', 0.1)
    monkeypatch.setattr(controllers_module, 'motion_time', lambda *_: 0.1)
    live = robot.viewer.page.live
    for count in (5, 7):  # after a stop, and after a target that was not reached
        assert live._deadman.beat(1, target.hold, time.monotonic())
        robot.viewer.actions.aim({'a': 1.0}, 1.0)
        robot.spin_until(lambda count=count: len(sent) == count, 'an empty trajectory and another')
        assert not sent[-2].points
        assert list(sent[-1].points[0].positions) == [1.0, -9.004]
        robot.spin_until(lambda: not controller.busy, 'the end')
        assert not live.held, 'it has to be let go before it moves again'
        live._deadman.release(1, target.hold, time.monotonic() - 1.0)
        robot.viewer.actions.let_go()


@pytest.mark.parametrize(('target', 'end'), [(0.5, 'reached'), (1.0, 'not reached')])
def test_a_press_lasts_until_all_controllers_are_done(
    robot: Robot, said: list[str], monkeypatch: pytest.MonkeyPatch, target: float, end: str
) -> None:
    """The joints of a further arm go on when those of the first have arrived, or have not."""
    monkeypatch.setattr(controllers_module, 'RELEASED_AFTER', math.inf)
    monkeypatch.setattr(controllers_module, 'SETTLING_TIMEOUT', 0.1)
    monkeypatch.setattr(controllers_module, 'motion_time', lambda p, *_: 0.1 if 'a' in p else 60.0)
    _, controller, panel = targets_of(robot)
    further = Controller(controller.commands, ('c',), {'c': 0.0})
    robot.viewer._controllers.found['/further_controller'] = further
    deadman, hold = robot.viewer.page.live._deadman, panel.hold
    assert deadman.beat(1, hold, time.monotonic())
    robot.viewer.actions.aim({'a': target, 'c': 1.0}, 1.0)
    robot.spin_until(lambda: any(each.startswith(f'target: {end}') for each in said), 'an end')
    assert not controller.busy
    assert further.busy
    assert deadman.beat(1, hold, time.monotonic() + 1.0), 'it is still held'
    further.positions['c'] = 1.0
    robot.spin_until(lambda: not further.busy, 'the other end')
    assert not deadman.beat(1, hold, time.monotonic() + 2.0)


@pytest.mark.parametrize('way', ['let go', 'lost'])
def test_a_motion_to_a_target_ends_when_its_button_is_let_go(
    robot: Robot, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    """An empty trajectory stops the arm on its path; also where heartbeats come no more."""
    monkeypatch.setattr(controllers_module, 'motion_time', lambda *_: 60.0)
    monkeypatch.setattr(controllers_module, 'RELEASED_AFTER', math.inf)
    sent, controller, _ = targets_of(robot)
    monkeypatch.setattr(controllers_module, 'RELEASED_AFTER', 0.1)
    robot.viewer._controllers.aim({'a': 1.0}, 1.0, time.monotonic() - 0.2)  # it was held up
    robot.spin_times(20)
    assert not sent
    monkeypatch.setattr(controllers_module, 'RELEASED_AFTER', math.inf)
    robot.viewer.actions.aim({'a': 1.0}, 1.0)
    robot.spin_until(lambda: bool(sent), 'a trajectory')
    robot.spin_times(20)
    assert len(sent) == 1
    if way == 'let go':
        robot.viewer.actions.let_go()
    else:
        monkeypatch.setattr(controllers_module, 'RELEASED_AFTER', 0.1)
    robot.spin_until(lambda: len(sent) == 2, 'its end')
    assert not sent[-1].points
    assert not controller.busy


def test_nothing_that_the_robot_sends_ends_the_page(
    robot: Robot, said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What cannot be shown is said once, in the log and on the page; STOP works all the same."""
    statuses = robot.node.create_publisher(DiagnosticArray, 'diagnostics', 10)
    odd = DiagnosticStatus(name='odd', level=b'\x09', message='a level of nobody')

    def shown() -> bool:
        statuses.publish(DiagnosticArray(status=[odd]))
        return 'a level of nobody' in robot.viewer.page._statuses.content

    robot.spin_until(shown, 'the status')
    monkeypatch.setattr(state, 'STATUS_AGE', 0.1)
    page = robot.viewer.page
    gone = 'unknown for 0 s; before: a level of nobody'
    robot.spin_until(lambda: gone in page._statuses.content, 'its age')
    for wrong in ('<robot', BAD_ORIGIN):
        robot.description.publish(String(data=wrong))
        robot.spin_until(lambda: bool(said), 'a sentence')
        assert said.pop().startswith('robot_description cannot be shown: ')
    robot.description.publish(String(data=ARM))
    robot.spin_until(lambda: 'robot arm' in said, 'the robot')
    robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
    robot.viewer.actions.stop()
    assert robot.called_until_enable() == ['joint1/halt', 'joint2/halt']


@pytest.mark.parametrize(
    ('package', 'what'),
    [('control_msgs', 'targets are not offered'), ('moveit_msgs', 'planning is not offered')],
)
def test_messages_that_are_not_installed_here_leave_the_rest(
    robot: Robot, said: list[str], monkeypatch: pytest.MonkeyPatch, package: str, what: str
) -> None:
    """Another computer offers what has them; it is said once, with the package."""
    state = state_message()
    moveit = import_module('moveit_msgs.action')
    robot.node.create_publisher(type(state), 'arm_controller/controller_state', 10)
    ActionServer(robot.node, moveit.MoveGroup, 'move_action', lambda _: None)
    ActionServer(robot.node, moveit.ExecuteTrajectory, 'execute_trajectory', lambda _: None)
    for module in ('msg', 'action', 'srv'):  # after the servers, whose types load them
        monkeypatch.setitem(sys.modules, f'{package}.{module}', None)
    robot.spin_until(lambda: bool(said), 'a sentence')
    assert said == [f'{what}: {package} is not installed here: run `make build`, or install it']
    robot.spin_until(lambda: len(robot.viewer._drives) == 2, 'drives')
    robot.viewer.actions.stop()
    assert robot.called_until_enable() == ['joint1/halt', 'joint2/halt']
    assert len([each for each in said if package in each]) == 1


@pytest.mark.parametrize('host', ['192.0.2.1', 'no.such.host.invalid', 'x..y'])
def test_a_host_that_is_none_of_this_computer_is_refused(
    isolation: Isolation, host: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At once, with its name: the server of the page would look for a free port without end."""
    find = socket.getaddrinfo

    def found(name: str, *arguments: Any, **options: Any) -> Any:
        if name.endswith('.invalid'):  # a network that answers nothing would take its time
            raise socket.gaierror(socket.EAI_NONAME, 'Name or service not known')
        return find(name, *arguments, **options)

    monkeypatch.setattr(socket, 'getaddrinfo', found)
    refusal = f"host is '{host}': .*; give an address"
    with in_domain(isolation, f'host:={host}'), pytest.raises(ParameterError, match=refusal):
        WebViewer()
