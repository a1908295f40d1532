# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot folder with collision meshes, as vendors ship it: links that would meet are refused."""

from __future__ import annotations

import math
from pathlib import Path
import shutil
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from control_msgs.action import FollowJointTrajectory
from moving_arm import goal_to, GoalRun, reach, READY
from processes import executable
import pytest
from topic_arm import TopicArm

from arm_bringup.description import expand_xacro
from arm_bringup.robots import installed_robots_folder

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario

FOLDED = [0.0, 1.7, 0.0, -3.0, 0.0, 1.5, 0.7]
"""A pose of the Panda within its limits, with the forearm in its base."""

FREE = [0.3, *READY[1:]]


def prism(radius: float, length: float) -> str:
    """Return a prism of eight sides along z as Wavefront OBJ."""
    turns = [math.pi * number / 4 for number in range(8)]
    lines = [
        f'v {radius * math.cos(turn)} {radius * math.sin(turn)} {side * length / 2}'
        for side in (-1, 1)
        for turn in turns
    ]
    return '\n'.join([*lines, *(f'f {n} {n + 1} {n + 8}' for n in range(1, 8))])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Make the Panda's folder with a mesh in the place of each capsule, beside a plain URDF."""
    panda, folder = installed_robots_folder() / 'panda', tmp_path / 'panda'
    shutil.copytree(panda, folder, ignore=shutil.ignore_patterns('*.xacro'))
    (folder / 'meshes').mkdir()
    robot = ET.fromstring(expand_xacro(panda / 'panda.urdf.xacro'))  # noqa: S314  our own
    for link in robot.iter('link'):
        for number, collision in enumerate(link.findall('collision')):
            geometry = collision.find('geometry')
            assert geometry is not None
            cylinder = geometry.find('cylinder')
            if cylinder is None:
                link.remove(collision)
                continue
            name = f'meshes/{link.get("name")}_{number}.obj'
            text = prism(*(float(cylinder.get(key, 0)) for key in ('radius', 'length')))
            (folder / name).write_text(text, encoding='utf-8')
            geometry.remove(cylinder)
            ET.SubElement(geometry, 'mesh', filename=name)
    ET.ElementTree(robot).write(folder / 'panda.urdf')
    return folder


def test_a_goal_in_which_meshes_meet_is_refused(isolation: Isolation, folder: Path) -> None:
    """With the links and the time; another one is reached."""
    command = [executable('arm_bringup', 'bringup'), str(folder), '--controller-only']
    with TopicArm(isolation, command, 'all is ready') as arm:
        refused = GoalRun(arm.client, goal_to(FOLDED, 6.0)).wait()[1]
        assert refused.error_code == FollowJointTrajectory.Result.INVALID_GOAL
        assert 'would collide at' in refused.error_string
        assert 'panda_link' in refused.error_string
        assert arm.at == READY
        reach(arm.client, goal_to(FREE, 2.0))
        assert arm.at[0] == pytest.approx(FREE[0], abs=1e-6)
