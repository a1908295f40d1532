# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameter files of MoveIt and ros2_control load as they are: every name, and its default."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import core_commands
from isolation import Isolation
from model_robots import FOLDER, ready, robot, texts
import pytest
import rclpy
from rclpy.node import Node
import yaml

from arm_model import ModelError
from arm_model.ros import GroupModels
from arm_servo import check_parameters, CoreSettings, MotionCore
from arm_servo.ros.group_motion import check_names, Offers
from arm_servo.ros.parameter_check import ParameterSheet
from arm_servo.ros.servo_commands import declare_servo, ServoParameters
from arm_servo.ros.topics_backend import build_motion

pytestmark = pytest.mark.slow

GROUP = 'panda_arm'
CONTROLLER = f'{GROUP}_controller'

UPSTREAM: dict[str, dict[str, Any]] = yaml.safe_load(
    (Path(__file__).parent / 'upstream_parameters.yaml').read_text(encoding='utf-8')
)
SERVO, MOVE_GROUP, CONTROL = (UPSTREAM[name] for name in ('servo', 'move_group', 'control'))


class NoAliases(yaml.SafeDumper):
    """Writes what rcl reads."""

    def ignore_aliases(self, data: object) -> bool:
        """Write everything as often as it occurs."""
        return True


def document(**nodes: dict[str, Any]) -> dict[str, Any]:
    """Return a parameter file."""
    return {name: {'ros__parameters': table} for name, table in nodes.items()}


@pytest.mark.parametrize(
    'nodes',
    [
        {'servo_node': SERVO},
        {'servo_node': SERVO | MOVE_GROUP},
        {'servo_node': UPSTREAM['servo_humble'] | MOVE_GROUP},
        {
            CONTROLLER: CONTROL,
            'joint_state_broadcaster': UPSTREAM['broadcaster'],
            'controller_manager': UPSTREAM['manager'],
        },
        {'/**': MOVE_GROUP},
    ],
    ids=['servo', 'servo with planners', 'servo of Humble', 'ros2_control', 'planners'],
)
def test_upstream_parameters_are_accepted(nodes: dict[str, dict[str, Any]]) -> None:
    """No node refuses one of them, in one process or in several."""
    assert check_parameters(GroupModels([robot('panda')]), document(**nodes)) == []


@pytest.mark.parametrize('offers', [Offers(trajectories=False), Offers()])
def test_nodes_begin_with_upstream_parameters(
    offers: Offers, tmp_path: Path, isolation: Isolation
) -> None:
    """The nodes themselves, with everything at once from a file, and name what has no effect."""
    urdf, srdf = texts('panda')
    arm = {
        'robot_description': urdf,
        'robot_description_semantic': srdf,
        'joint_limits': str(FOLDER / 'panda' / 'limits.yaml'),
    }
    file = tmp_path / 'parameters.yaml'
    nodes = {
        '/**': arm | MOVE_GROUP,
        'servo_node': SERVO,
        CONTROLLER: CONTROL,
        'controller_manager': UPSTREAM['manager'],
    }
    file.write_text(yaml.dump(document(**nodes), Dumper=NoAliases), encoding='utf-8')
    rclpy.init(args=['--ros-args', '--params-file', str(file)], domain_id=isolation.domain_id)
    made: list[Any] = []
    reported: list[str] = []

    def make_node(name: str) -> Node:
        node = Node(name)
        made.append(node)
        return node

    try:
        build_motion(make_node, offers)
        sheets: list[Any] = [
            SimpleNamespace(
                get_logger=lambda: SimpleNamespace(info=reported.append),
                get_parameters_by_prefix=node.get_parameters_by_prefix,
                has_parameter=node.has_parameter,
                _parameter_overrides=node._parameter_overrides,
            )
            for node in made
        ]
        check_names(sheets)
    finally:
        for node in made:
            node.destroy_node()
        rclpy.shutdown()
    (line,) = reported
    assert 'moveit_servo.use_smoothing' in line
    assert 'moveit_servo.check_collisions' not in line
    assert 'robot_description,' not in line


def servo_parameters(**values: object) -> ServoParameters:
    """Return what the servo reads of a configuration."""
    sheet = ParameterSheet('servo_node', {'moveit_servo': values})
    return declare_servo(cast('Node', sheet), robot('panda'))


@pytest.mark.parametrize(
    ('values', 'margin'),
    [
        ({}, 0.0),
        ({'joint_limit_margins': [0.1]}, 0.1),
        ({'joint_limit_margins': [0.3, *[0.1] * 6]}, 0.3),
        ({'joint_limit_margin': 0.2}, 0.2),
    ],
)
def test_jogs_come_to_rest_at_the_margins_of_the_joint_limits(
    values: dict[str, object], margin: float
) -> None:
    """Where moveit_servo of Jazzy and of Humble does; an arm beyond one may go back."""
    settings = CoreSettings(servo=servo_parameters(**values).settings)
    core, upper = MotionCore(robot('panda'), settings), robot('panda').limits.upper[0]
    core.reset([upper - 0.5, *ready('panda')[1:].tolist()])
    for cycle in range(300):
        core_commands.jog(core, {'panda_joint1': 1.0}, 0.01 * cycle)
        core.step(0.01 * cycle, 0.01)
    assert upper - core.state.position[0] == pytest.approx(margin, abs=2e-3)
    core.reset([upper - 0.05, *ready('panda')[1:].tolist()])
    for cycle in range(100):
        core_commands.jog(core, {'panda_joint1': -1.0}, 0.01 * cycle)
        core.step(0.01 * cycle, 0.01)
    assert core.state.position[0] < upper - 0.5


@pytest.mark.parametrize('threshold', [0.01, 0.03])
def test_jogs_come_to_rest_at_the_proximity_threshold(threshold: float) -> None:
    """In front of the other links of the arm."""
    parameters = servo_parameters(self_collision_proximity_threshold=threshold)
    core = MotionCore(
        robot('panda'), CoreSettings(servo=parameters.settings, clearance=parameters.clearance)
    )
    core.reset(ready('panda'))
    for cycle in range(400):
        core_commands.jog(core, {'panda_joint6': -1.0}, 0.01 * cycle)
        core.step(0.01 * cycle, 0.01)
    assert core.model.clearance(core.state.position) == pytest.approx(threshold, abs=2e-3)


@pytest.mark.parametrize('margins', [[0.1, 0.1], [-0.1], [3.0]])
def test_margins_that_do_not_fit_the_joints_are_refused(margins: list[float]) -> None:
    """With the joint, or the count."""
    with pytest.raises(ModelError, match='joint_limit_margins'):
        servo_parameters(joint_limit_margins=margins)
