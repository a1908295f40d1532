# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup plan_demo``: a simulated arm picks and places among obstacles."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
import json
import os
from pathlib import Path

from urdf_reader import parse_srdf, read_urdf

from arm_model import ArmError, Array, load_limits, RobotModel, start_pose
from process_supervisor import namespaced_parameters, RosOptions

from ...description import read_semantic
from ...exceptions import RobotError
from ...groups import joints_of_groups, MovedGroups
from ...motion import controller_names, planning_files
from ...robots import Robot
from ...session import locate
from ...stack import MOTION_NODE
from ..program import DemoArm, DemoProgram, DemoSetup
from ..scenario import PartsScenario
from .boxes import find_swing
from .client import PlanClient
from .figures import PlanFigures
from .motions import Motions
from .observer import Observer
from .results import PlanResults
from .sequence import Arm, PlanSequence
from .tool import flange_tool, GripperParts, gripping_tool, Tool
from .workcell import by_joint, find_workcell

DURATION_MARGIN = 20.0
"""How much longer than planned a motion may take on a busy computer in [s]."""
WITH_GRIPPER = '_hand'
"""What follows the name of a robot in that of its folder with a gripper."""


def with_gripper(arguments: argparse.Namespace) -> Robot:
    """Find the robot; of one that is asked for by name, its folder with a gripper if there is one.

    Args:
        arguments: What :func:`parse` returned.

    Raises:
        RobotError: There is no such robot.
    """
    robot = locate(arguments)
    if os.sep not in arguments.robot:
        both = argparse.Namespace(**{**vars(arguments), 'robot': robot.name + WITH_GRIPPER})
        with contextlib.suppress(RobotError):
            robot = locate(both)
            arguments.robot = both.robot
    return robot


def demo_files(robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups) -> Sequence[Path]:
    """Write the parameter files of the demo: those of a bring-up, and time for a busy computer.

    Args:
        robot: A robot with an SRDF and limits.
        folder: Where to.
        ros: Options of all nodes.
        groups: Its groups that are moved.
    """
    execution = {'allowed_goal_duration_margin': DURATION_MARGIN}
    values = {'move_group': {'ros__parameters': {'trajectory_execution': execution}}}
    path = folder / 'demo.yaml'
    path.write_text(json.dumps(values), encoding='utf-8')
    files = planning_files(robot, folder, ros, groups)
    return [*files, namespaced_parameters(path, ros, folder)]


@dataclass(frozen=True, slots=True)
class Robots:
    """What is read of a robot folder.

    Attributes:
        robot: The folder.
        urdf: The description.
        groups: The groups that are moved.
    """

    robot: Robot
    urdf: str
    groups: MovedGroups

    def model(self, group: str) -> RobotModel:
        """Build an arm.

        Args:
            group: Its group.

        Raises:
            ModelError: The files do not make an arm.
        """
        robot = self.robot
        tip = robot.tip_link if group == self.groups.arms[0] else ''
        limits = load_limits(robot.limits)
        folder = robot.description.parent
        semantic = read_semantic(robot)
        return RobotModel(self.urdf, semantic, limits, group, tip or None, folder=folder)

    def gripper(self, model: RobotModel) -> GripperParts | None:
        """Return the gripper of an arm, where it has one of one joint.

        Args:
            model: The arm.
        """
        joints = joints_of_groups(self.robot, self.groups)
        semantic = parse_srdf(read_semantic(self.robot))
        for each in model.end_effectors:
            if each.group in self.groups.tools and len(joints[each.group]) == 1:
                (joint,) = joints[each.group]
                limits = read_urdf(self.urdf).ranges()[joint]
                states = semantic.poses.get(each.group, {})
                closed = states.get('close', states.get('closed', {})).get(joint, limits.lower)
                opened = states.get('open', {}).get(joint, limits.upper)
                return GripperParts(each.group, joint, closed, opened)
        return None

    def arms(self) -> list[Arm]:
        """Return the arms; the first has a workcell where one was found.

        Raises:
            ModelError: The files do not make arms, or one has no pose to start from.
        """
        main = self.model(self.groups.arms[0])
        home = start_pose(main)
        tool, controller = self.tool(main, home)
        cell = find_workcell(main, tool)
        arms = [Arm(main, tool, cell, None, controller)]
        if cell is None:
            arms = [Arm(main, swing=find_swing(main, home, f'{main.group}_box'))]
        placed = by_joint(main, home)
        for group in self.groups.arms[1:]:
            model = self.model(group)
            model = model.with_others({**model.kinematics.others, **placed})
            begin = start_pose(model)
            arms.append(Arm(model, swing=find_swing(model, begin, f'{group}_box')))
            placed = {**placed, **by_joint(model, begin)}
        return arms

    def tool(self, model: RobotModel, home: Array) -> tuple[Tool, str]:
        """Return what an arm takes a part up with, and the controller of its gripper.

        Args:
            model: The arm.
            home: Joint positions from which it begins in [rad].
        """
        gripper = self.gripper(model)
        if gripper is not None and (tool := gripping_tool(model, gripper, home)):
            return tool, controller_names(self.robot, self.groups)[gripper.group]
        return flange_tool(model, home), ''


def set_up(demo: DemoArm) -> DemoSetup:
    """Find a workcell for the first arm, and a motion for each other one.

    Raises:
        ModelError: The files do not make arms, or one has no pose to start from.
    """
    arm = demo.session
    arms = Robots(arm.robot, arm.urdf, demo.groups).arms()
    observer, root = Observer(arm.urdf, arms[0].model), read_urdf(arm.urdf).root
    return DemoSetup(
        commands(arm.ros),
        lambda display: PartsScenario(
            display,
            demo.limits,
            arm.mode_service,
            demo.duration,
            lambda client, enter, look: PlanSequence(
                arms, enter, Motions(client, PlanResults(), look)
            ),
        ),
        lambda given_up: PlanClient(given_up, observer, root, arm.ros.namespace),
        PlanFigures(),
    )


def commands(ros: RosOptions) -> list[str]:
    """Return commands to try in a second terminal.

    Args:
        ros: Options of all nodes.
    """
    return [
        f'ros2 topic echo {ros.resolve("display_planned_path")}',
        f'ros2 service call {ros.resolve("get_planning_scene")} moveit_msgs/srv/GetPlanningScene',
    ]


DEMO = DemoProgram(
    name='plan_demo',
    description='Bring a simulated arm up with move_group, and have it pick and place among '
    'obstacles, go around a box that appears in its way, and refuse a blocked goal; further '
    'arms move in the same scene. Ends with what was measured at the joint states.',
    duration='repeat it until so many seconds are over, once at least (default: until Ctrl-C)',
    master=MOTION_NODE,
    set_up=set_up,
    beside=', and move_group',
    label='plan',
    find_robot=with_gripper,
    files=demo_files,
    plan=True,
    errors=(ArmError,),
)
