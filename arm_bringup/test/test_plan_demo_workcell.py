# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of planning finds where arms that it does not know can work."""

from __future__ import annotations

from pathlib import Path

import pytest

from arm_bringup.demos.plan.boxes import distance_of, is_free
from arm_bringup.demos.plan.main import Robots
from arm_bringup.demos.plan.tool import PART
from arm_bringup.demos.plan.workcell import PILLAR, TABLE
from arm_bringup.description import read_description
from arm_bringup.groups import moved_groups
from arm_bringup.robots import find_robot
from arm_model import AttachedBody, combined
from arm_planning import Planner

pytestmark = pytest.mark.slow

ROBOTS = Path(__file__).parents[1] / 'robots'


def robots(folder: Path) -> Robots:
    """Return what is read of a robot folder."""
    robot = find_robot(f'{folder}/', folder)
    return Robots(robot, read_description(robot), moved_groups(robot))


@pytest.mark.parametrize('name', ['panda_hand', 'prbt', 'gp110'])
def test_each_of_our_arms_has_a_workcell(name: str) -> None:
    """It reaches both places, the pillar is between them, and it begins in none of it."""
    (arm,) = robots(ROBOTS / name).arms()
    assert arm.cell is not None
    assert arm.tool is not None
    assert bool(arm.gripper) == (name == 'panda_hand')
    model = arm.model.with_others({**arm.model.kinematics.others, **arm.tool.others})
    scene = model.scene
    for each in arm.cell.obstacles:
        scene = scene.with_object(each)
    assert Planner(model).is_valid(arm.cell.home, scene) is None
    for station in arm.cell.stations:
        around = scene.with_object(station.part)
        assert model.pose(station.joints).is_close(station.above) or (
            abs(model.pose(station.joints).position - station.above.position).max() < 1e-4
        )
        assert distance_of(around, station.joints, PART) > 0.0
        bottom = station.part.pose.position[2] - arm.tool.height / 2
        (table,) = (each for each in arm.cell.obstacles if each.name == TABLE)
        assert bottom > table.pose.position[2]
        held = combined(station.grasp, arm.tool.part.pose)
        assert abs(held.position - station.part.pose.position).max() < 1e-9
    body = AttachedBody(arm.tool.part, model.tip, frozenset(arm.tool.links))
    first, second = (station.joints for station in arm.cell.stations)
    assert not is_free(scene.with_attached(body), first, second)
    assert is_free(scene.without(PILLAR).with_attached(body), first, second)


def test_a_gripper_closes_on_the_part_and_opens_around_it() -> None:
    """The part fits between the fingers of the Panda, and they meet it before they are closed."""
    panda = robots(ROBOTS / 'panda_hand')
    (arm,) = panda.arms()
    assert arm.tool is not None
    gripper = arm.tool.gripper
    assert gripper is not None
    assert (gripper.group, gripper.joint) == ('hand', 'panda_finger_joint1')
    assert 0.0 < gripper.closed < gripper.open == 0.035  # its SRDF's
    assert arm.gripper == 'hand_controller'
