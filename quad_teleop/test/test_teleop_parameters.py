# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable
import re
from types import SimpleNamespace
from typing import Any

from input_devices import InjectedDevices
from isolation import Isolation
import pytest
import rclpy
from rclpy.node import Node
from ros_client import RosClient
from std_srvs.srv import Trigger
from teleop_robot import TEST_TIMEOUT

from node_runner import ParameterError
from operator_input import OperatorInputError
from quad_msgs.srv import SetMode
from quad_teleop import Mode, TeleopError
from quad_teleop.motion import RobotRequest
from quad_teleop.nodes.teleop import DISCOVERY_TIMEOUT, RobotLink, TeleopGamepad, TeleopKeyboard
from quad_teleop.nodes.twist_mux import TwistMux


@pytest.mark.scenario
def test_each_stop_is_sent_and_ends_what_was_requested_before(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mode that still waits for its service is not sent later; answers are shown once.

    What waited in vain is shown, with the remedy, and not sent later, either.
    """
    clock = SimpleNamespace(monotonic=lambda: 0.0)
    monkeypatch.setattr('quad_teleop.nodes.teleop.time', clock)
    shown: list[str] = []
    handled: list[str] = []

    def serve(request: Any, response: Any) -> Any:
        handled.append(getattr(request, 'mode', 'stop'))
        response.success, response.message = True, 'as asked'
        return response

    with RosClient(isolation.domain_id) as client:
        robot = RobotLink(client.node, shown.append)

        def wait_for_service(name: str) -> None:
            service = next(c for c in client.node.clients if c.srv_name.endswith(name))
            client.spin_until(service.service_is_ready, TEST_TIMEOUT, name)

        def stopped(times: int) -> bool:
            return handled == ['stop'] * times and robot._stops._future is None

        client.node.create_service(Trigger, 'stop', serve)
        wait_for_service('stop')
        robot.handle(Mode.WALK, 0.0)
        robot.handle(RobotRequest.STOP, 0.1)
        client.spin_until(lambda: stopped(1), TEST_TIMEOUT, 'stop')
        robot.handle(RobotRequest.STOP, 0.2)
        client.spin_until(lambda: stopped(2), TEST_TIMEOUT, 'second stop')
        assert shown == ['stop: as asked']
        clock.monotonic = lambda: 1.0
        robot.handle(RobotRequest.STOP, 0.3)
        client.spin_until(lambda: stopped(3), TEST_TIMEOUT, 'third stop')
        assert shown == ['stop: as asked'] * 2

        robot.handle(Mode.STAND, 0.4)
        robot.serve(0.5 + DISCOVERY_TIMEOUT)
        assert shown[-1].startswith('stand: no service /set_mode; is controller_node running')
        client.node.create_service(SetMode, 'set_mode', serve)
        wait_for_service('set_mode')
        robot.serve(10.4)
        robot.handle(Mode.STAND, 10.5)
        client.spin_until(lambda: robot.mode is Mode.STAND, TEST_TIMEOUT, 'stand')
        assert handled == ['stop'] * 3 + ['stand']


ERRORS = ParameterError, TeleopError, OperatorInputError


def gamepad() -> TeleopGamepad:
    """Make the node without this machine's devices."""
    return TeleopGamepad(InjectedDevices())


def make(
    isolation: Isolation, node: Callable[[], Node], *parameters: str
) -> tuple[set[str], set[str]]:
    """Make a node from a command line; return the names of its parameters, and its topics."""
    words = [word for parameter in parameters for word in ('-p', parameter)]
    rclpy.init(args=['test', '--ros-args', *words], domain_id=isolation.domain_id)
    watcher = Node('watcher', use_global_arguments=False)
    try:
        made = node()
        names = set(made.get_parameters_by_prefix(''))
        topics = dict(made.get_publisher_names_and_types_by_node(made.get_name(), '/'))
        made.destroy_node()
        return names, set(topics)
    finally:
        left = watcher.get_node_names()
        watcher.destroy_node()
        rclpy.shutdown()
        assert left == ['watcher'], 'a node is gone whether it was refused or destroyed'


def source(**changes: str) -> str:
    """Return the parameters of a source of twist_mux."""
    values = {'topic': 'a', 'timeout': '1', 'priority': '3', **changes}
    return ' '.join(f'topics.a.{name}:={value}' for name, value in values.items())


STOP = source().replace('topics.a', 'locks.stop')


@pytest.mark.parametrize(
    ('node', 'parameters', 'message'),
    [
        (TeleopKeyboard, 'speeed:=0.2', "unknown parameter 'speeed'; did you mean 'speed'?"),
        (TeleopKeyboard, 'speed:=9', 'speed is 9: it must be 0.01 to 3.0'),
        (TeleopKeyboard, 'speed:=1.0', 'speed is 1.0: it must be between 0.01 and its limit 0.4'),
        (TeleopKeyboard, 'turn:=3.0', 'turn is 3.0: it must be between 0.01 and its limit 2.0'),
        (TeleopKeyboard, 'twist:=false', 'nothing would be published'),
        (TeleopKeyboard, 'angle_step:=0.4', 'angle_step is 0.4: it must be above 0 and at most'),
        (gamepad, 'preset:=xbux', "did you mean 'xbox'? There are: auto, xbox, ps, generic"),
        (gamepad, 'enable_button:=left_sholder', "'left_sholder': it must be south"),
        (
            gamepad,
            'deadman_full_deflection_timeout:=2.0',
            'it must be at least deadman_timeout, 3',
        ),
        (gamepad, 'turbo_spede:=1.0', "did you mean 'turbo_speed'?"),
        (TwistMux, 'use_stampd:=true', "'use_stampd'; did you mean 'use_stamped'?"),
        (TwistMux, 'topics.keyboard.topic:=key_vel', 'topics.keyboard.timeout is missing'),
        (TwistMux, 'topcs.keyboard.topic:=key_vel', "'topcs'; did you mean 'topics'?"),
        (TwistMux, 'topics.keyboard:=key_vel', 'unknown parameter topics.keyboard'),
        (TwistMux, source(priorty='1'), "did you mean 'topics.a.priority'?"),
        (TwistMux, source(priority='256'), 'topics.a.priority is 256: it must be 0 to 255'),
        (TwistMux, source(priority='1.5'), 'priority is 1.5: it must be a whole number'),
        (TwistMux, source(priority='true'), 'priority is True'),
        (TwistMux, source(timeout='-1.0'), 'timeout is -1'),
        (TwistMux, source(timeout='.nan'), 'timeout is nan'),
        (TwistMux, source(timeout='.inf'), 'timeout is inf'),
        (TwistMux, source(timeout='soon'), "timeout is 'soon'"),
        (TwistMux, source(topic='""'), 'topic is empty'),
        (TwistMux, source(topic='7'), 'topic is 7'),
        (TwistMux, f'{source()} {STOP}', 'a and stop both'),
        (TwistMux, STOP, 'no topics'),
    ],
)
def test_wrong_parameter_is_refused(
    isolation: Isolation, node: Callable[[], Node], parameters: str, message: str
) -> None:
    """A misspelt or senseless parameter is refused, with what it must be or what was meant."""
    with pytest.raises(ERRORS, match=re.escape(message)):
        make(isolation, node, *parameters.split())


@pytest.mark.parametrize(
    ('node', 'parameters', 'velocities'),
    [
        (TeleopKeyboard, 'speed:=0.3 turn:=1 stamped:=true twist:=false', '/cmd_vel_stamped'),
        (gamepad, 'preset:=ps enable_button:=right_trigger turbo_button:=none', '/cmd_vel'),
        (TwistMux, source(), '/cmd_vel_out'),
        (TwistMux, '', '/cmd_vel_out'),
    ],
)
def test_good_parameters_are_taken(
    isolation: Isolation, node: Callable[[], Node], parameters: str, velocities: str
) -> None:
    """What the READMEs name is accepted, whole numbers as times and speeds too."""
    words = parameters.split()
    names, topics = make(isolation, node, *words)
    assert {word.partition(':=')[0] for word in words} <= names
    assert [topic for topic in topics if 'cmd_vel' in topic] == [velocities]
