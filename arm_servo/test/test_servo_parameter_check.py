# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the nodes would refuse of a parameter file is reported without them."""

from __future__ import annotations

from typing import Any

from model_robots import robot
import pytest

from arm_model.ros import GroupModels
from arm_servo import check_parameters

CONTROLLER = 'gp110_arm_controller'
NAMED = {'controller_manager': {'ros__parameters': {'controller_name': CONTROLLER}}}


def refused(node: str, **parameters: object) -> list[tuple[str, str]]:
    """Check a file that has parameters of one node."""
    document: dict[str, Any] = {**NAMED, node: {'ros__parameters': parameters}}
    return check_parameters(GroupModels([robot('gp110')]), document)


@pytest.mark.parametrize(
    ('node', 'parameters', 'words'),
    [
        (CONTROLLER, {'constraints': {'goal_tim': 1.0}}, "mean 'constraints.goal_time'"),
        (CONTROLLER, {'constraints': {'joint_1_s': {'goal': 'near'}}}, "'near'"),
        (CONTROLLER, {'joints': ['elbow']}, 'not those of the group'),
        (CONTROLLER, {'following_error_limit': -1.0}, 'following_error_limit'),
        ('servo_node', {'moveit_servo': {'move_group_name': 'hand'}}, "'hand'"),
        ('servo_node', {'moveit_servo.scale.linaer': 0.1}, "mean 'moveit_servo.scale.linear'"),
        ('servo_node', {'tip_link': 'elsewhere'}, "'elsewhere'"),
        ('/joint_state_broadcaster', {'update_rate': 'often'}, "'often'"),
    ],
)
def test_each_mistake_is_reported_in_the_words_of_the_node(
    node: str, parameters: dict[str, object], words: str
) -> None:
    """The node is named, and no other one complains."""
    ((name, reason),) = refused(node, **parameters)
    assert name == node.lstrip('/')
    assert words in reason


def test_what_is_right_and_what_is_for_others_passes() -> None:
    """Whole numbers for numbers, parameters of other controllers and nodes."""
    assert refused(CONTROLLER, constraints={'goal_time': 1}, open_loop_control=True) == []
    assert refused('rviz', constraints={'goal_tim': 1}) == []
    assert refused('/**', use_sim_time=False) == []


def test_parameters_for_every_node_count() -> None:
    """As in rcl, each node takes what it declares."""
    assert refused('/**', following_delay=9.0)[0][0] == CONTROLLER
