# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameter files of MoveIt and ros2_control load as they are; what is wrong is reported."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import core_commands
from core_commands import core_of
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
    offers: Offers, tmp_path: Path, isolation: Isolation, monkeypatch: pytest.MonkeyPatch
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
    file.write_text(json.dumps(document(**nodes)), encoding='utf-8')
    rclpy.init(args=['--ros-args', '--params-file', str(file)], domain_id=isolation.domain_id)
    made: list[Any] = []
    reported: list[str] = []

    def make_node(name: str) -> Node:
        made.append(node := Node(name))
        return node

    try:
        build_motion(make_node, offers)
        with monkeypatch.context() as patch:
            logger = SimpleNamespace(info=reported.append)
            patch.setattr(Node, 'get_logger', lambda _: logger)
            check_names(made)
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


def jogged(core: MotionCore, joint: str, speed: float) -> float:
    """Jog a joint for 4 s; return where the first joint is then in [rad]."""
    for cycle in range(400):
        core_commands.jog(core, {joint: speed}, 0.01 * cycle)
        core.step(0.01 * cycle, 0.01)
    return float(core.state.position[0])


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
    upper, others = robot('panda').limits.upper[0], ready('panda')[1:].tolist()
    settings = CoreSettings(servo=servo_parameters(**values).settings)
    core = core_of('panda', settings, [upper - 0.5, *others])
    assert upper - jogged(core, 'panda_joint1', 1.0) == pytest.approx(margin, abs=2e-3)
    core.reset([upper - 0.05, *others])
    assert jogged(core, 'panda_joint1', -0.5) < upper - 0.5


@pytest.mark.parametrize('threshold', [0.01, 0.03])
def test_jogs_come_to_rest_at_the_proximity_threshold(threshold: float) -> None:
    """In front of the other links of the arm."""
    parameters = servo_parameters(self_collision_proximity_threshold=threshold)
    settings = CoreSettings(servo=parameters.settings, clearance=parameters.clearance)
    core = core_of('panda', settings)
    jogged(core, 'panda_joint6', -1.0)
    assert core.model.clearance(core.state.position) == pytest.approx(threshold, abs=2e-3)


@pytest.mark.parametrize('margins', [[0.1, 0.1], [-0.1], [3.0]])
def test_margins_that_do_not_fit_the_joints_are_refused(margins: list[float]) -> None:
    """With the joint, or the count."""
    with pytest.raises(ModelError, match='joint_limit_margins'):
        servo_parameters(joint_limit_margins=margins)


CONTROL_GP110 = 'gp110_arm_controller'


def refused(node: str, **parameters: object) -> list[tuple[str, str]]:
    """Check a file that has parameters of one node."""
    nodes: dict[str, Any] = {'controller_manager': {'controller_name': CONTROL_GP110}}
    return check_parameters(GroupModels([robot('gp110')]), document(**nodes | {node: parameters}))


@pytest.mark.parametrize(
    ('node', 'parameters', 'words'),
    [
        (CONTROL_GP110, {'constraints': {'goal_tim': 1.0}}, "mean 'constraints.goal_time'"),
        (CONTROL_GP110, {'constraints': {'joint_1_s': {'goal': 'near'}}}, "'near'"),
        (CONTROL_GP110, {'joints': ['elbow']}, 'not those of the group'),
        (CONTROL_GP110, {'following_error_limit': -1.0}, 'following_error_limit'),
        ('servo_node', {'moveit_servo': {'move_group_name': 'hand'}}, "'hand'"),
        ('servo_node', {'moveit_servo.scale.linaer': 0.1}, "mean 'moveit_servo.scale.linear'"),
        ('servo_node', {'tip_link': 'elsewhere'}, "'elsewhere'"),
        ('/joint_state_broadcaster', {'update_rate': 'often'}, "'often'"),
    ],
)
def test_each_mistake_is_reported_in_the_words_of_the_node(
    node: str, parameters: dict[str, object], words: str
) -> None:
    """Without the nodes; the one is named, and no other one complains."""
    ((name, reason),) = refused(node, **parameters)
    assert name == node.lstrip('/')
    assert words in reason


def test_what_is_right_and_what_is_for_others_passes() -> None:
    """Whole numbers for numbers, parameters of other controllers; for every node, as in rcl."""
    assert refused(CONTROL_GP110, constraints={'goal_time': 1}, open_loop_control=True) == []
    assert refused('rviz', constraints={'goal_tim': 1}) == []
    assert refused('/**', use_sim_time=False) == []
    assert refused('/**', following_delay=9.0)[0][0] == CONTROL_GP110
