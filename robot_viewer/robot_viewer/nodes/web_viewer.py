# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run robot_viewer web_viewer``: web page that shows and moves the robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
import concurrent.futures
from contextlib import suppress
from functools import partial
from importlib import import_module
import math
import threading
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import TwistStamped
from rcl_interfaces.msg import Log
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf_reader import KinematicTree, read_urdf, Transform

from node_runner import (
    destroyed_when_refused,
    LATCHED,
    ParameterError,
    ParameterReader,
    refuse_misspelt,
    run_program,
)

from ..page.gate import binding_problem
from ..page.jog_panel import Actions, Offered, Twist, Velocity
from ..page.robot_page import DISABLE, DRIVE_GROUPS, RobotPage
from ..page.robot_scene import greatest_velocities
from ..robot_state import Stop
from .body import Body
from .controllers import Controllers, Grippers
from .first_motion import FirstMotion
from .interfaces import (
    Border,
    of_robot,
    serve,
    SET_MODE_TYPE,
    stops_robot,
    succeeded,
    text_of,
    TRIGGER,
    TriggerCalls,
)
from .listening import BETWEEN_LOOKS, frames_of, joints_of, Listening
from .motion_planning import MotionPlanning
from .state import Judge, Watch

NAME = 'web_viewer'
PORT = 8080
DRAW_PERIOD = 1.0 / 30.0
"""Time in [s] between two drawn frames, and between two reads of user input."""
LIST_PERIOD = 0.2  # time between two updates of numbers in [s]
PLOT_PERIOD = 0.5  # time between two updates of plots in [s]
REST_TIME, REST_TICKS = 1.0, 3
"""Time in [s] without motion after which only every third frame is drawn."""
SEEN = 1e-4  # least joint motion that is drawn in [rad] or [m]: above noise at rest
LIMIT_AGE = 1.0  # time in [s] for which a servo's limit text is shown
SCALES = ('command_in_type', 'scale.linear', 'override_velocity_scaling_factor')
"""Servo parameters that determine the tool speed for a speed fraction."""
MIN_OVERRIDE = 0.01  # a smaller velocity override is ignored, as in moveit_servo
SERVO_STATUS_TYPE = 'moveit_msgs/msg/ServoStatus'
GRAPH_PERIOD = 1.0  # time between two scans of the ROS graph in [s]
SETTLED, SELDOM = 10, 3
"""After so many scans with the same nodes, only every third one lists their services."""
DRIVE_SERVICES = (DISABLE, *(verb for group in DRIVE_GROUPS.values() for verb in group.values()))
"""Drive services on the page; a node with halt and quick_stop is a drive."""
WARN = 30  # level of warnings in rcl_interfaces/Log
ROSOUT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""QoS that also receives log messages from the seconds before the page was opened."""
STOP = 'stop'  # service that stops the whole robot


class WebViewer(Node):
    """Shows the robot's topics on a page, and sends the user's commands.

    Callbacks of the page run in its threads. They queue requests for the node's thread, except
    heartbeats of held buttons, which they publish immediately.
    """

    @destroyed_when_refused
    def __init__(self) -> None:
        """Serve the page, and subscribe.

        Raises:
            ParameterError: A parameter is wrong.
        """
        super().__init__(NAME)
        read = ParameterReader(self)
        host = read.text(
            'host', '127.0.0.1', 'the page is bound to it; not loopback: with a token'
        )
        port = read.whole('port', PORT, (1, 65535), 'of the page; else the next free one')
        self._prefix = read.text('frame_prefix', '', 'before each frame, as of the robot on /tf')
        refuse_misspelt(self)
        if problem := binding_problem(host):  # the server would search for a free port forever
            raise ParameterError(
                f'host is {host!r}: {problem}; give an address of this computer, such as'
                ' 127.0.0.1, or 0.0.0.0 for all of them'
            )
        self._orders: deque[Callable[[], object]] = deque()
        self._ticks, self._moved_at, self._plotted_at = 0, -math.inf, -math.inf
        self._nodes: list[tuple[str, str]] = []
        self._triggers = TriggerCalls(self, self._report)
        self._drives: dict[str, list[str]] = {}
        self._stops: set[str] = set()
        self._own_stops: set[str] = set()  # the subset seen to be a robot's own
        self._positions: dict[str, float] = {}
        self._drawn: dict[str, float] = {}
        self._watch = Watch()
        self._robot_publishes = False
        self._limit = ('', 0.0)  # servo text, and its time
        self._servo_listens = False
        self._servo: Client | None = None
        self._set_mode: Client | None = None
        self._velocities: Mapping[str, float] = {}
        self._independent: Sequence[str] = ()
        self._listening = Listening(self)
        self._base = self._shown_base = Transform()
        self._root, self._looks = '', 0  # scans with the same nodes
        self._jogs: Publisher | None = None
        self._joint_jogs: Publisher | None = None
        self._walks: Publisher | None = None
        order = self._order
        self.actions = Actions(
            stop=self._request_stop,
            act=lambda action: order(partial(self._judge.act, action)),
            call=lambda what, services: order(partial(self._triggers.call_all, what, services)),
            walk=self._walk,
            set_mode=lambda mode: order(partial(self._request_mode, mode)),
            jog=self._jog,
            jog_joint=self._jog_joint,
            grip=lambda gripper, position: order(partial(self._grippers.grip, gripper, position)),
            aim=lambda targets, share: order(
                partial(self._controllers.aim, targets, share, time.monotonic())
            ),
            let_go=lambda: order(self._controllers.let_go),
        )
        self.page = RobotPage(host, port, self.actions)
        self._controllers = Controllers(self, self._listening, self.page.say, self.page.end_target)
        self._grippers = Grippers(self, self.page.say)
        self._judge = Judge(self, self.page, self._watch, self._triggers)
        self.border = Border(self, lambda text: self.page.say(text, failed=True))
        self._body = Body(self, self.page, self._listening, self._positions)
        self._first_motion = FirstMotion(
            self, self.page, self._positions, self._watch.statuses, self._order
        )
        self._planning = MotionPlanning(self, self.page, self._positions, self._order)
        self.create_subscription(String, 'robot_description', self._describe, LATCHED)
        for kind, name, take, qos, by in (
            (JointState, 'joint_states', self._take_joints, BETWEEN_LOOKS, joints_of),
            (TFMessage, '/tf', self._take_transforms, BETWEEN_LOOKS, self._frames_of),
            (Log, '/rosout', self._take_log, ROSOUT, bytes),
        ):
            self._listening.add(kind, name, take, qos, by)
        self.create_subscription(DiagnosticArray, 'diagnostics', self._watch.take_statuses, 10)
        self.create_timer(DRAW_PERIOD, self._serve_page)
        self.create_timer(LIST_PERIOD, self._list)
        self.create_timer(GRAPH_PERIOD, self._look_around)
        self.seen_at = f'the robot is seen at {self.page.url}'

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Subscriptions served by the executor; the others are read when the page is drawn."""
        group = self._listening.group
        yield from (each for each in super().subscriptions if each.callback_group is not group)

    # -- what is shown

    def _describe(self, message: String) -> None:
        with self.border.around('robot_description cannot be shown'):
            self._show(read_urdf(message.data))

    def _show(self, tree: KinematicTree) -> None:
        self._root, self._judge.robot, self._drawn = tree.root, tree.name, {}
        self._watch.forget()
        self._velocities = greatest_velocities(tree)
        self._independent = [joint.name for joint in tree.joints if joint.independent]
        self._grippers.describe(tree)
        notes = self.page.show_robot(tree)
        self._first_motion.describe(tree)
        self._body.describe(tree)
        for note in notes:
            self.get_logger().warning(f'not shown: {note}')

    def _take_joints(self, message: JointState) -> None:
        self._watch.take_joints(message)
        positions = dict(zip(message.name, message.position, strict=False))
        self._first_motion.take(positions)
        self._positions.update(positions)

    def _frames_of(self, data: bytes) -> Hashable:
        return self._root, frames_of(data)

    def _take_transforms(self, message: TFMessage) -> bool:
        """Move the root link; return whether these frames do not contain it."""
        for transform in message.transforms:
            if transform.child_frame_id == f'{self._prefix}{self._root}':
                place, turn = transform.transform.translation, transform.transform.rotation
                self._base = Transform(
                    (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)
                )
                return False
        return bool(self._root)

    def _take_servo(self, message: Any) -> None:  # noqa: ANN401  # moveit_msgs may not be there
        if message.code > 0:
            self._limit = message.message, time.monotonic()

    def _take_log(self, message: Log) -> None:
        """Store warnings and errors of the robot's other nodes."""
        who = message.name.replace('.', '/')  # a logger has the full name of its node
        within = self.get_namespace().strip('/')
        inside = not within or who.startswith(f'{within}/')
        own = who == self.get_fully_qualified_name().strip('/')
        if message.level >= WARN and inside and not own:
            at = message.stamp.sec + message.stamp.nanosec * 1e-9
            self.page.log(at, f'/{who}', message.msg, failed=message.level > WARN)

    def _work(self) -> None:
        while self._orders:
            with self.border.around('a message or answer'):
                self._orders.popleft()()

    def _rests(self) -> bool:
        """Whether robot and page are at rest, and no button is held."""
        parts = self._controllers.busy, self._first_motion.busy, self._planning.moves
        held = any(parts) or self.page.live.held
        return not held and time.monotonic() - self._moved_at > REST_TIME

    def _serve_page(self) -> None:
        self._ticks += 1
        if self._ticks % REST_TICKS and self._rests():
            return
        self._work()
        for process in self._listening.newest():
            with self.border.around('a message or answer'):
                process()
        self._controllers.advance(self._velocities)
        self._first_motion.advance()
        self._planning.advance()
        watched = self.page.watched
        looked_at = watched or self._controllers.busy or self._first_motion.busy
        was, begins = (
            self._listening.active,
            self._listening.update(time.monotonic(), looked_at=looked_at),
        )
        if begins or was != self._listening.active:
            self._watch.listen(begins=begins)  # stored messages are old
        if watched:
            self._draw()

    def _draw(self) -> None:
        self._planning.draw()
        self._body.draw()
        drawn = self._drawn.get
        moved = {n: p for n, p in self._positions.items() if abs(p - drawn(n, math.inf)) > SEEN}
        if moved and self.page.robot is not None:
            self._moved_at = time.monotonic()
            self._drawn.update(moved)
            self.page.robot.place(moved)
        if self._base != self._shown_base:
            self._moved_at = time.monotonic()
            self._shown_base = self._base
            self.page.show_base(self._base)

    def _list(self) -> None:
        limit, at = self._limit
        drives = 'Its gripper was pressed on a page.' if self._grippers.busy else ''
        if self._planning.busy:
            drives = 'The plan is executed while its button is held.'
        now = time.monotonic()
        self._judge.judge(
            self._positions,
            publishes=self._robot_publishes,
            limit=limit if now - at < LIMIT_AGE else '',
            battery=self._body.battery,
            drives=drives,
            controllers=self._controllers.found,
        )
        if not self.page.watched:
            return
        self.page.list_log()
        for legs in self._watch.legs:
            self.page.show_mode(legs.values.get('state', ''))
        self.page.show_statuses(self._watch.aged(now))
        self.page.follow(self._positions)
        self._body.list()
        self._first_motion.list()
        if now - self._plotted_at > PLOT_PERIOD:
            self._plotted_at = now
            self.page.plot(self._controllers.history, now)

    # -- what the robot offers

    def _look_around(self) -> None:
        nodes = sorted(self.get_node_names_and_namespaces())
        self._looks = self._looks + 1 if nodes == self._nodes else 0
        self._nodes = nodes
        if self._looks > SETTLED and self._looks % SELDOM:
            return  # listing all services is a quarter of an idle page's load
        services = dict(self.get_service_names_and_types())
        description = self.resolve_topic_name('robot_description')
        looks: Mapping[str, Callable[[], None]] = {
            'drives are not offered': lambda: self._find_drives(services),
            'the state is not known': lambda: self._judge.look(self._of_this_robot(services)),
            'the first motion is not offered': lambda: self._first_motion.look(
                services, self._drives
            ),
            'targets are not offered': lambda: self._controllers.look(description),
            'grippers are not offered': lambda: self._grippers.look(
                services, self._controllers.found
            ),
            'single joints are not jogged': self._find_joint_jogging,
            'jogging is not offered': self._find_jogging,
            'limits are not shown': self._find_servo,
            'an arm is not driven': lambda: self.page.offer_drive(self._offered()),
            'walking is not offered': lambda: self._find_walking(services),
            'planning is not offered': lambda: self._planning.look(services),
            'the body is not shown as a whole': self._body.look,
        }
        for without, look in looks.items():
            with self.border.around(without):
                look()
        # stays set if the connection is cut or the publisher ends
        self._robot_publishes |= bool(self.count_publishers('joint_states'))

    def _of_this_robot(self, services: Mapping[str, list[str]]) -> dict[str, list[str]]:
        """Return the services of this page's robot only."""
        topics = (name for name, _ in self.get_topic_names_and_types())
        nodes = {name.rpartition('/')[0] for name in services}
        own = set(of_robot(self.resolve_topic_name('robot_description'), topics, nodes))
        return {name: kinds for name, kinds in services.items() if name.rpartition('/')[0] in own}

    def _find_drives(self, services: Mapping[str, Sequence[str]]) -> None:
        triggers = {name for name, kinds in services.items() if TRIGGER in kinds}
        topics = (name for name, _ in self.get_topic_names_and_types())
        own = self.resolve_topic_name('robot_description')
        stopped = (n.removesuffix('/quick_stop') for n in triggers if n.endswith('/quick_stop'))
        nodes = of_robot(own, topics, stopped)
        drives = {
            node: [verb for verb in DRIVE_SERVICES if f'{node}/{verb}' in triggers]
            for node in nodes
            if f'{node}/halt' in triggers
        }
        self._drives.update(drives)
        stops = {self.resolve_service_name(STOP), *map(_stop_beside, self._drives)}
        self._stops |= stops & set(triggers)
        with self.border.around('who offers STOP is not known'):
            self._doubtful_stops(self._stops - self._own_stops)
        for service in (*self._stops, *(f'{drive}/halt' for drive in self._drives)):
            self._triggers.client(service)  # early: discovery takes time that a STOP does not have
        self.page.offer_drives(self._drives)

    def _find_jogging(self) -> None:
        topic = 'servo_node/delta_twist_cmds'
        if self._jogs is None and self.count_subscribers(topic):
            self._jogs = self.create_publisher(TwistStamped, topic, QoSProfile(depth=1))
            self._servo = self.create_client(GetParameters, 'servo_node/get_parameters')
        if self._servo is not None and self.page.watched and self._servo.service_is_ready():
            request = GetParameters.Request(names=[f'moveit_servo.{name}' for name in SCALES])
            self._servo.call_async(request).add_done_callback(self._take_scales)

    def _take_scales(self, future: Future) -> None:
        """Show the tool speed; unknown if the servo has no scale parameters."""
        values = [] if future.exception() is not None else future.result().values
        if len(values) == len(SCALES) and values[1].double_value > 0.0:
            units, scale = values[0].string_value, values[1].double_value
            full = scale if units == 'unitless' else 1.0
            override = values[2].double_value if values[2].double_value >= MIN_OVERRIDE else 1.0
            self.page.velocity = lambda share: override * min(share * full, scale)

    def _find_servo(self) -> None:
        topic = self.resolve_topic_name('servo_node/status')
        ends = () if self._servo_listens else self.get_publishers_info_by_topic(topic)
        if any(end.topic_type == SERVO_STATUS_TYPE for end in ends):
            self._servo_listens = True
            kind = import_module('moveit_msgs.msg').ServoStatus
            self._listening.add(kind, topic, self._take_servo)

    def _offered(self) -> Offered:
        grippers = dict(self._grippers.named)
        held = set(grippers.values())
        targets = {joint for each in self._controllers.found.values() for joint in each.joints}
        return Offered(
            tuple(j for j in self._independent if self._joint_jogs and j not in held),
            self._jogs is not None,
            tuple(grippers.items()),
            tuple(joint for joint in self._independent if joint in targets - held),
        )

    def _find_joint_jogging(self) -> None:
        topic = 'servo_node/delta_joint_cmds'
        if self._joint_jogs is None and self.count_subscribers(topic):
            kind = import_module('control_msgs.msg').JointJog
            self._joint_jogs = self.create_publisher(kind, topic, QoSProfile(depth=1))

    def _find_walking(self, services: Mapping[str, Sequence[str]]) -> None:
        name = self.resolve_service_name('set_mode')
        if self._set_mode is None and SET_MODE_TYPE in services.get(name, ()):
            kind = import_module('quad_msgs.srv').SetMode
            self._set_mode = self.create_client(kind, 'set_mode')
            self._walks = self.create_publisher(TwistMessage, 'cmd_vel', QoSProfile(depth=1))
        if self._set_mode is not None:
            policy = any(each.values.get('policy') for each in self._watch.legs)
            self.page.offer_walk(policy=policy)

    # -- what people do on the page, in its threads

    def _request_stop(self) -> concurrent.futures.Future[Stop]:
        answer: concurrent.futures.Future[Stop] = concurrent.futures.Future()
        self._order(partial(self._stop, answer))
        return answer

    def _jog(self, twist: Twist, frame: str) -> None:
        """Publish a jog command once, immediately; the robot's time-out ends the motion."""
        if self._jogs is None:
            return
        message = TwistStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = f'{self._prefix}{frame}' if frame else ''
        linear, angular = message.twist.linear, message.twist.angular
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = twist
        self._jogs.publish(message)

    def _jog_joint(self, joint: str, share: float) -> None:
        if self._joint_jogs is None:
            return
        kind: Any = self._joint_jogs.msg_type
        message = kind(joint_names=[joint], velocities=[share])
        message.header.stamp = self.get_clock().now().to_msg()
        self._joint_jogs.publish(message)

    def _walk(self, velocity: Velocity) -> None:
        if self._walks is None:
            return
        message = TwistMessage()
        message.linear.x, message.linear.y, message.angular.z = velocity
        self._walks.publish(message)

    def _order(self, order: Callable[[], object]) -> None:
        self._orders.append(order)
        if self.executor is not None:
            self.executor.create_task(self._work)

    def _stop(self, answer: concurrent.futures.Future[Stop]) -> None:
        self.page.say('STOP: no answer from the robot yet', failed=None)
        self._judge.stop(answer, self._order)
        answers: dict[str, tuple[bool, str]] = {}
        counted: set[str] = set()

        def take(service: str, ok: bool, text: str) -> None:
            self._report(f'{service}: {text}', failed=not ok)
            answers[service] = ok, text
            _conclude(answer, answers, counted)

        for service in sorted(self._stops):
            self._triggers.call(service, partial(take, service))
        for part in (self._controllers, self._grippers, self._first_motion, self._planning):
            with self.border.around('STOP'):
                part.stop()
        called = self._stops - answers.keys()  # the others are unavailable
        try:
            doubtful = self._doubtful_stops(called)
        except Exception as error:  # noqa: BLE001  # halt the drives after any error
            self.get_logger().error(f'STOP: {type(error).__name__}: {error}')
            doubtful = {service: [] for service in called}
        halts = {
            f'{drive}/halt'
            for drive in self._drives
            if _stop_beside(drive) not in called - doubtful.keys()
        }
        for service in sorted(halts):
            self._triggers.call(service, partial(take, service))
        for service, others in doubtful.items():
            who = ', '.join(others) or 'a node that the graph does not show'
            text = f'offered by {who}, which leads neither drives nor legs: each drive is halted'
            self._report(f'{service}: {text}, too. Give that service another name', failed=True)
        counted |= (self._stops | halts) - doubtful.keys()
        if counted:
            _conclude(answer, answers, counted)
            return
        text = 'nothing here offers to be stopped'
        self.page.say(f'STOP: {text}', failed=True)
        answer.set_result(Stop(stands=False, text=text))

    def _doubtful_stops(self, services: Collection[str]) -> dict[str, list[str]]:
        """Return the services not offered by a robot's own node alone, with the other nodes.

        A robot's own service stays its own while no other node offers it: after a stall beyond
        the discovery lease, the graph shows the services of a node without the node.
        """
        others = {service: list[str]() for service in services}
        if not others:
            return {}
        for name, namespace in self.get_node_names_and_namespaces():
            node = f'{namespace.rstrip("/")}/{name}'
            with suppress(NodeNameNonExistentError):  # the node just left
                offered = dict(self.get_service_names_and_types_by_node(name, namespace))
                for service in offered.keys() & others.keys():
                    if TRIGGER not in offered[service]:
                        continue  # it is not called
                    if stops_robot(node, offered):
                        self._own_stops.add(service)
                    else:
                        others[service].append(node)
        return {
            name: nodes for name, nodes in others.items() if nodes or name not in self._own_stops
        }

    def _request_mode(self, mode: str) -> None:
        if self._set_mode is not None:
            kind: Any = self._set_mode.srv_type
            future = self._set_mode.call_async(kind.Request(mode=mode))
            future.add_done_callback(partial(self._answered, f'mode {mode}'))

    def _answered(self, what: str, future: Future) -> None:
        self._report(f'{what}: {text_of(future)}', failed=not succeeded(future))

    def _report(self, text: str, *, failed: bool) -> None:
        self.page.say(text, failed=failed)
        # separate lines: rclpy rejects different severities from one line
        if failed:
            self.get_logger().warning(text)
        else:
            self.get_logger().info(text)


def _conclude(
    answer: concurrent.futures.Future[Stop],
    answers: Mapping[str, tuple[bool, str]],
    counted: Collection[str],
) -> None:
    """Set the result of a STOP once all counted services succeeded, or one failed."""
    known = {name: answers[name] for name in answers if name in counted}
    failed = [f'{name}: {text}' for name, (ok, text) in known.items() if not ok]
    if not answer.done() and (failed or len(known) == len(counted) > 0):  # else it is answered
        text = failed[0] if failed else '. '.join(text for _, text in known.values())
        answer.set_result(Stop(stands=not failed, text=text))


def _stop_beside(node: str) -> str:
    """Return the stop service of the robot in whose namespace a node is."""
    return f'{node.rpartition("/")[0]}/{STOP}'


def main() -> int:
    """Run until Ctrl-C; return 0, or 1 if it could not start."""
    return run_program(NAME, _serve)


def _serve(stop: threading.Event) -> None:
    node = WebViewer()
    serve(node, node.seen_at, node.page.close, stop, node.border)
