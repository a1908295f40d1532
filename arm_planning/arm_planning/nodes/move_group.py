# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_planning move_group``: MoveIt's move_group for its clients.

:class:`PathWatch` rechecks running trajectories when the scene changes.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import Future
import pathlib
import sys
import threading
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from std_msgs.msg import String

from arm_model import ArmError, Array, compiled_scene, LimitsError, PlanningScene
from arm_trajectory import Path, PathCheck
from node_runner import (
    destroyed_when_refused,
    LATCHED,
    log_defects,
    notify_ready,
    ParameterReader,
    run_program,
    spin,
)

from ..exceptions import PlanningError
from ..moveit_package import MoveItPackage, read_package
from ..moveit_settings import misspelt, of_nothing
from ..ros.actions import ExecuteAction, MotionAction, sequence, single_motion
from ..ros.background import as_refusal, Background
from ..ros.execution import Execution, INVALIDATED, TrajectoryExecution
from ..ros.parameters import (
    declare_controllers,
    declare_execution_limits,
    declare_others,
    declare_parameters,
)
from ..ros.planning import PlanningThreads
from ..ros.robot_groups import RobotGroups
from ..ros.scene_monitor import SceneMonitor
from ..ros.services import PlannerQueries, RobotServices
from ..ros.trajectories import part_of, path_of

NAME = 'move_group'

HELP = """\
Plan and execute motions of a robot among obstacles: MoveIt's interfaces.

usage: ros2 run arm_planning move_group --moveit-config DIR
       ros2 run arm_planning move_group --ros-args --params-file robot.yaml

options:
  --moveit-config DIR     a package as the MoveIt Setup Assistant writes it, as it is
  --xacro-arg NAME:=VALUE an argument of its xacro files; may be repeated

parameters, each before what the package says:
  robot_description, robot_description_semantic, joint_limits   what describes the robot
  robot_description_kinematics, robot_description_planning,
  ompl, pilz_industrial_motion_planner                          MoveIt's, as its launch files do
  frame_prefix                                                  of robot_state_publisher
  allow_trajectory_execution                                    (default true)
  trajectory_execution.allowed_start_tolerance                  [rad] (default 0.01)
  trajectory_execution.allowed_execution_duration_scaling       (default 1.1)
  trajectory_execution.allowed_goal_duration_margin             [s] (default 0.5)
  trajectory_execution.execution_duration_monitoring            (default true)
  moveit_simple_controller_manager.controller_names             (default: <group>_controller)
  <controller>.joints                                           joints that it moves
  <controller>.type                                             FollowJointTrajectory (default),
                                            GripperCommand or ParallelGripperCommand
  <controller>.action_ns                                        its action (default: by type)
  <controller>.default                                          it comes first (default false)
  <controller>.command_joint, <controller>.max_effort           of a GripperCommand
"""


class MoveGroup(Node):
    """Serves clients of MoveIt."""

    @destroyed_when_refused
    def __init__(self, package: MoveItPackage | None = None) -> None:
        """Read the robot and offer all services; a package supplies missing parameters."""
        super().__init__(NAME)
        given = declare_parameters(self, package)
        description, settings = given.description, given.settings
        try:
            robot = RobotGroups(description.urdf, description.srdf, description.limits)
        except PlanningError as error:
            if not isinstance(error.__cause__, LimitsError):
                raise
            text = f'{error} (joint_limits: {description.limits_file})'
            raise PlanningError(error.code, text) from error
        self.groups = robot.names
        prefix = ParameterReader(self).text(
            'frame_prefix', '', 'what robot_state_publisher puts before frames in TF'
        )
        limits = declare_execution_limits(self)
        controllers = declare_controllers(self, robot, given.places)
        declare_others(self, given.names)
        for line in (
            *misspelt(given.names, given.places),
            *of_nothing(
                given.names, given.places, robot.names, robot.all_joints, list(controllers)
            ),
        ):
            self.get_logger().warning(line)
        semantic = self.create_publisher(String, 'robot_description_semantic', LATCHED)
        semantic.publish(String(data=description.srdf))
        monitor = SceneMonitor(self, robot, prefix)
        self._queries = Background(self, 'queries')
        RobotServices(self, monitor, self._queries, settings)
        execution = TrajectoryExecution(
            self,
            controllers,
            monitor.received,
            limits,
            followers=robot.kinematics.mimics,
            continuous=robot.continuous,
        )
        self._watch = Background(self, 'watch')
        PathWatch(monitor, execution, self._watch)
        ExecuteAction(self, execution)
        self._planning = Background(self, 'planning')
        # the core may have to be compiled, which would cost the first plan its time
        self._planning.submit(lambda: compiled_scene(robot.scene), lambda _: None, 'core')
        planning = PlanningThreads(
            self,
            monitor,
            self._planning,
            settings=settings,
            cartesian_limits=given.cartesian_limits,
        )
        PlannerQueries(self, settings.planners)
        for kind in (single_motion(planning, self.get_logger().warning), sequence(planning)):
            MotionAction(self, kind, planning, self._planning, execution)

    def close(self) -> None:
        """End the threads."""
        self._queries.close()
        self._planning.close()
        self._watch.close()


LOOKS = 400  # places on a trajectory at which the arm is looked for

AMBIGUOUS = 0.02
"""Points of the path this much farther away than the nearest may still be the arm's, in [rad]."""

LATENCY = 0.1
"""Margin before that point from which the trajectory is checked in [s]: joint states are late."""


class PathWatch:
    """Stops executions whose path is no longer clear; runs in the node's executor."""

    def __init__(
        self, monitor: SceneMonitor, execution: TrajectoryExecution, background: Background
    ) -> None:
        """Check executions after each change of the scene, and as they begin.

        The scene may have changed since a trajectory was planned.
        """
        self._monitor, self._execution, self._background = monitor, execution, background
        self._is_looking, self._looks_again = False, False
        monitor.on_change = execution.on_start = self._look
        execution.on_failure = self._find_out

    def _find_out(self, failed: Execution) -> None:
        """Find out whether a controller gave up because of the scene."""
        scene, here = self._monitor.snapshot.scene, self._monitor.positions()

        def found(done: Future[str]) -> None:
            contact = '' if done.cancelled() or done.exception() else done.result()
            self._execution.explain(failed, contact and _words(contact))

        self._background.submit(lambda: contact_ahead(failed.way, here, scene), found)

    def _look(self) -> None:
        """Check all executions in the present scene; again after a check that is under way."""
        self._looks_again = self._is_looking
        if self._is_looking or not (running := self._execution.running):
            return
        self._is_looking = True
        scene, here = self._monitor.snapshot.scene, self._monitor.positions()

        def contacts() -> list[str]:
            return [_contact(each.way, here, scene) for each in running]

        self._background.submit(contacts, lambda done: self._looked(running, done))

    def _looked(self, running: Sequence[Execution], done: Future[list[str]]) -> None:
        self._is_looking = False
        if done.cancelled():
            return
        for execution, contact in zip(running, done.result(), strict=True):
            if contact:
                self._execution.stop(execution, INVALIDATED, _words(contact))
        if self._looks_again:
            self._look()


def _words(contact: str) -> str:
    return f'the way is not clear in the present scene: {contact}'


def _contact(trajectory: Any, here: Array, scene: PlanningScene) -> str:  # noqa: ANN401
    """Return the contact ahead; a path that cannot be checked counts as not clear."""
    try:
        return contact_ahead(trajectory, here, scene)
    except Exception as error:  # noqa: BLE001  # one trajectory must not stop the others
        return f'what is left of the trajectory cannot be looked at: {as_refusal(error)}'


def contact_ahead(
    trajectory: Any,  # noqa: ANN401  # messages have no type
    here: Array,
    scene: PlanningScene,
) -> str:
    """Describe the contact on the rest of a trajectory; empty if it is clear.

    The trajectory was checked and includes the motion to its first point. All joints may move.
    """
    joints = list(scene.kinematics.joints)
    moved = [name for name in trajectory.joint_names if name in joints]
    if len(trajectory.points) < 2 or not moved:
        return ''  # nothing that the robot has moves
    path = path_of(part_of(trajectory, moved))
    columns = [joints.index(name) for name in moved]
    passed = passed_time(path, here[columns])

    def rows(times: Array) -> Array:
        found = np.tile(here, (len(times), 1))
        found[:, columns] = path.positions(times + passed)
        return found

    contact = PathCheck(scene).contact(rows, path.duration - passed)
    if contact is None:
        return ''
    first, second = contact.links
    return f'{first} and {second} would touch in {contact.time:.1f} s'


def passed_time(path: Path, positions: Array) -> float:
    """Return a time of the path in [s] at or shortly before the arm's present position."""
    times = np.linspace(0.0, path.duration, LOOKS)
    apart = np.abs(path.positions(times) - positions).max(axis=1)
    first = int((apart <= apart.min() + AMBIGUOUS).argmax())
    return max(float(times[first]) - LATENCY, 0.0)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        'move_group', usage=argparse.SUPPRESS, add_help=False, allow_abbrev=False
    )
    parser.add_argument('--moveit-config', type=pathlib.Path)
    parser.add_argument('--xacro-arg', action='append', default=[])
    arguments = parser.parse_args(remove_ros_args(sys.argv)[1:])
    for each in arguments.xacro_arg:
        if ':=' not in each:
            parser.error(f'--xacro-arg {each}: write NAME:=VALUE')
    return arguments


def _serve(stop: threading.Event) -> None:
    arguments = _arguments()
    package = None
    if arguments.moveit_config is not None:
        pairs = (each.partition(':=') for each in arguments.xacro_arg)
        package = read_package(arguments.moveit_config, {name: value for name, _, value in pairs})
    node = MoveGroup(package)
    try:
        notify_ready()
        node.get_logger().info(f'ready: motions of {", ".join(node.groups)} can be planned')
        spin([node], stop, survive=log_defects(node))
    finally:
        node.close()
        node.destroy_node()


def main() -> int:
    """Run until Ctrl-C or SIGTERM.

    Returns:
        Exit code: 0, or 1 when parameters or the robot are refused.
    """
    return run_program(NAME, _serve, ArmError, help_text=HELP)


if __name__ == '__main__':
    sys.exit(main())
