# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_planning move_group``: MoveIt's move_group for its clients."""

from __future__ import annotations

import sys
import threading

from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Empty

from arm_model import ArmError
from arm_model.ros import declare_description, Description
from node_runner import (
    destroyed_when_refused,
    LATCHED,
    notify_ready,
    ParameterError,
    ParameterReader,
    refuse_misspelt,
    run_program,
    spin,
)

from ..ros.background import Background
from ..ros.controllers import Controller, FOLLOW, KINDS
from ..ros.execute_action import ExecuteAction
from ..ros.execution import ExecutionLimits, TrajectoryExecution
from ..ros.kinematic_services import KinematicServices
from ..ros.motion_action import MotionAction, sequence, single_motion
from ..ros.path_watch import PathWatch
from ..ros.planner_queries import PlannerQueries
from ..ros.planning import PlanningThread
from ..ros.robot_groups import RobotGroups
from ..ros.scene_monitor import SceneMonitor
from ..ros.state_services import StateServices

NAME = 'move_group'

HELP = """\
Plan and execute motions of a robot among obstacles: MoveIt's interfaces.

usage: ros2 run arm_planning move_group --ros-args --params-file robot.yaml

parameters:
  robot_description, robot_description_semantic, joint_limits   what describes the robot
  trajectory_execution.allowed_start_tolerance                  [rad] (default 0.01)
  trajectory_execution.allowed_execution_duration_scaling       (default 1.1)
  trajectory_execution.allowed_goal_duration_margin             [s] (default 0.5)
  moveit_simple_controller_manager.controller_names             (default: <group>_controller)
  <controller>.joints                                           joints that it moves
  <controller>.type                                             FollowJointTrajectory (default),
                                            GripperCommand or ParallelGripperCommand
  <controller>.action_ns                                        its action (default: by type)
  <controller>.default                                          it comes first (default false)
"""


class MoveGroup(Node):
    """Serves clients of MoveIt."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Read the robot and offer everything.

        Raises:
            ArmError: The robot, or a parameter, is refused.
        """
        super().__init__(NAME)
        description = declare_description(self)
        robot = _robot(description)
        limits = _execution_limits(self)
        controllers = _controllers(self, robot)
        refuse_misspelt(self)
        semantic = self.create_publisher(String, 'robot_description_semantic', LATCHED)
        semantic.publish(String(data=description.srdf))
        monitor = SceneMonitor(self, robot)
        self._queries = Background(self, 'queries')
        queried = _robot(description)
        StateServices(self, monitor, self._queries, queried)
        KinematicServices(self, monitor, self._queries, queried)
        execution = TrajectoryExecution(self, controllers, monitor.received, limits)
        self._watch = Background(self, 'watch')
        PathWatch(monitor, execution, self._watch)
        ExecuteAction(self, execution)
        self._planning = Background(self, 'planning')
        planning = PlanningThread(self, monitor, self._planning, _robot(description))
        PlannerQueries(self)
        for kind in (single_motion(planning), sequence(planning)):
            MotionAction(self, kind, planning, self._planning, execution)
        # there is no octomap that would have to be cleared
        self.create_service(Empty, 'clear_octomap', lambda _request, response: response)

    def close(self) -> None:
        """End the threads."""
        self._queries.close()
        self._planning.close()
        self._watch.close()


def _robot(description: Description) -> RobotGroups:
    return RobotGroups(description.urdf, description.srdf, description.limits)


def _execution_limits(node: Node) -> ExecutionLimits:
    read = ParameterReader(node, 'trajectory_execution.')
    return ExecutionLimits(
        read.number(
            'allowed_start_tolerance',
            0.01,
            (0.0, 10.0),
            'how far the robot may be from the start of a trajectory; 0 is anywhere [rad]',
        ),
        read.number(
            'allowed_execution_duration_scaling',
            1.1,
            (1.0, 100.0),
            'how many times as long as planned a trajectory may take',
        ),
        read.number(
            'allowed_goal_duration_margin',
            0.5,
            (0.0, 100.0),
            'how much longer than that it may take [s]',
        ),
    )


def _controllers(node: Node, robot: RobotGroups) -> dict[str, Controller]:
    """Return the controllers; by default those of bring-up, one for each group.

    Those that are default come first: they get the joints that several move.
    """
    defaults = {f'{group}_controller': list(each) for group, each in robot.group_joints().items()}
    manager = 'moveit_simple_controller_manager.'
    names = ParameterReader(node, manager).texts(
        'controller_names', list(defaults), 'controllers that follow trajectories'
    )
    found, first = {}, []
    for name in names:
        read = ParameterReader(node, f'{manager}{name}.')
        joints = read.texts('joints', defaults.get(name, []), f'joints that {name} moves')
        kind = read.choice('type', FOLLOW.name, KINDS, f'what {name} takes')
        namespace = read.text('action_ns', kind.namespace, f'name of the action of {name}')
        if kind.single and len(joints) != 1:
            raise ParameterError(
                f'{manager}{name}.joints has {len(joints)} joints; a {kind.name} moves one'
            )
        if read.flag('default', f'{name} comes before those that are not', default=False):
            first.append(name)
        found[name] = Controller(tuple(joints), kind, namespace)
    return {name: found[name] for name in sorted(found, key=lambda name: name not in first)}


def _serve(stop: threading.Event) -> None:
    node = MoveGroup()
    try:
        notify_ready()
        spin([node], stop)
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
