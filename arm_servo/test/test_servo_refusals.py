# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes that are refused, in the process of a master or of a person."""

from __future__ import annotations

from collections.abc import Callable
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from input_devices import InjectedDevices
from isolation import Isolation
from model_robots import FOLDER, texts, two_arms_texts
import pytest
import rclpy
from rclpy.node import Node

from arm_model import ArmError
from arm_servo.ros.canopen_backend import CanopenMotion
from arm_servo.ros.group_motion import Offers
from arm_servo.teleop.servo_gamepad import ServoGamepad
from arm_servo.teleop.servo_keyboard_input import ServoKeyboardInput
from node_runner import ParameterError
from operator_input import OperatorInputError

SPACE = '/refused'  # nodes of tests of before may still be known in the domain
TWO_ARMS = {
    'robot_description': two_arms_texts()[0],
    'robot_description_semantic': two_arms_texts()[1],
    'group': 'left',
    'other_groups': ['right'],
    'limits': two_arms_texts()[2],
}


def motion() -> CanopenMotion:
    """Make the motion nodes on a bus without drives."""
    bus: Any = SimpleNamespace(bus=SimpleNamespace(nodes=[], joints=(), file='bus.yml'))
    return CanopenMotion(bus, Offers())


def gamepad() -> Node:
    """Make the node without this machine's devices."""
    return ServoGamepad(InjectedDevices())


def parameters(folder: Path, **values: object) -> list[str]:
    """Write parameters for all nodes of a process, with those of an arm."""
    urdf, srdf = texts('gp110')
    arm = {'robot_description': urdf, 'robot_description_semantic': srdf}
    file = folder / 'parameters.yaml'
    limits = FOLDER / 'gp110' / 'limits.yaml'
    if table := values.pop('limits', None):
        limits = folder / 'limits.yaml'
        limits.write_text(json.dumps({'joint_limits': table}))
    whole = arm | {'joint_limits': str(limits)} | values
    file.write_text(json.dumps({'/**': {'ros__parameters': whole}}))
    return ['--ros-args', '--params-file', str(file)]


@pytest.mark.parametrize(
    ('make', 'values', 'reason'),
    [
        (motion, {'robot_description': ''}, 'no robot_description'),
        (motion, {'robot_description': '<robot/>'}, 'robot_description: .*no <link>'),
        (motion, {'robot_description_semantic': 'none'}, 'robot_description_semantic: .*no XML'),
        (motion, {'limits': {'elbow': {}}}, r'/limits\.yaml: joint joint_1_s is missing'),
        (motion, {'publish_joint_states': 3}, 'publish_joint_states is 3'),
        (motion, {'group': 'arm'}, "'arm'"),
        (motion, {'joints': ['a', 'b']}, 'not those of the group'),
        (motion, {}, 'bus.yml has no drive'),
        (
            motion,
            TWO_ARMS | {'controller_name': 'right_controller'},
            'another group of this robot',
        ),
        (ServoKeyboardInput, {'sped': 0.1}, "did you mean 'speed'"),
        (ServoKeyboardInput, {'speed': 1.5}, 'speed is 1.5: it must be 0.01 to 1.0'),
        (ServoKeyboardInput, {'rate': 1}, 'rate is 1: it must be 10.0 to 500.0'),
        (gamepad, {'enable_button': 'eastt'}, "did you mean 'east'"),
        (gamepad, {'deadman_timeout': 20}, 'must be at least deadman_timeout, 20'),
        (gamepad, {'preset': 'xbux'}, "did you mean 'xbox'"),
    ],
)
def test_a_refused_node_leaves_nothing_in_the_graph(
    isolation: Isolation,
    tmp_path: Path,
    make: Callable[[], object],
    values: dict[str, object],
    reason: str,
) -> None:
    """Neither the node whose parameter is wrong nor those before it are left in the process."""
    args = [*parameters(tmp_path, **values), '-r', f'__ns:={SPACE}']
    rclpy.init(args=args, domain_id=isolation.domain_id)
    try:
        watcher = Node('watcher')
        with pytest.raises((ParameterError, ArmError, OperatorInputError), match=reason):
            make()
        nodes = watcher.get_node_names_and_namespaces()
        assert [name for name, space in nodes if space == SPACE] == ['watcher']
        watcher.destroy_node()
    finally:
        rclpy.shutdown()
