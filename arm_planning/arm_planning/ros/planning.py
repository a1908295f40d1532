# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions that are planned for clients: the thread that plans, and what they see of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
import time
from typing import Any

from moveit_msgs.msg import DisplayTrajectory, PlannerInterfaceDescription, RobotTrajectory
from moveit_msgs.msg import RobotState as StateMessage
from moveit_msgs.srv import GetMotionPlan, QueryPlannerInterfaces
from rclpy.node import Node

from arm_model import Array, RobotModel
from node_runner import LATCHED

from ..exceptions import PlanningCode, PlanningError
from ..industrial.planner import PLANNER_IDS
from ..planner import FREE_MOTION, Planner
from .background import Background, error_code
from .motion_request import OMPL, PILZ, RequestReader
from .robot_groups import RobotGroups
from .robot_state import state_message, trajectory_message
from .scene_changes import apply_scene, scene_for
from .scene_monitor import SceneMonitor
from .scene_snapshot import SceneSnapshot


@dataclass(frozen=True, slots=True, eq=False)
class PlannedMotion:
    """What a client gets of a plan.

    Attributes:
        start: Where it begins.
        trajectory: The motion.
        planning_time: How long planning took in [s].
    """

    start: StateMessage
    trajectory: RobotTrajectory
    planning_time: float


class GroupPlanners:
    """The planner of each group of a robot, made anew when joints beside it have moved."""

    def __init__(self, robot: RobotGroups) -> None:
        """Make none yet.

        Args:
            robot: The robot.
        """
        self._robot = robot
        self._planners: dict[str, tuple[RobotModel, Planner]] = {}
        self._seeds = count()

    def at(self, group: str, positions: Array) -> tuple[RobotModel, Planner]:
        """Return model and planner of a group, with the joints beside it where they are.

        Args:
            group: Its name.
            positions: Positions of all joints of the robot in [rad].

        Raises:
            PlanningError: There is no such group, or it cannot be moved.
        """
        model = self._robot.model_at(group, positions)
        known = self._planners.get(group)
        if known is None or known[0] is not model:
            # another seed: a plan that was not found is not searched for in the same way again
            known = self._planners[group] = model, Planner(model, seed=next(self._seeds))
        return known


class PlanningThread:
    """Plans in a thread of its own, with a robot of its own."""

    def __init__(
        self, node: Node, monitor: SceneMonitor, background: Background, robot: RobotGroups
    ) -> None:
        """Offer plan_kinematic_path, query_planner_interface and display_planned_path.

        Args:
            node: The node.
            monitor: The scene and where the joints are.
            background: The thread.
            robot: The robot, for that thread alone.
        """
        self._monitor, self._robot = monitor, robot
        self._planners = GroupPlanners(robot)
        self._displayed = node.create_publisher(DisplayTrajectory, 'display_planned_path', LATCHED)
        background.serve(GetMotionPlan, 'plan_kinematic_path', self._serve, _refuse)
        node.create_service(QueryPlannerInterfaces, 'query_planner_interface', _interfaces)

    def prepare(self, message: Any, scene_diff: Any = None) -> Callable[[], PlannedMotion]:  # noqa: ANN401
        """Return what plans a motion; called in the executor, what it returns in the thread.

        Args:
            message: The moveit_msgs/MotionPlanRequest.
            scene_diff: A moveit_msgs/PlanningScene that counts for this plan only.

        Raises:
            PlanningError: The request is refused.
        """
        if not message.group_name:
            known = ', '.join(self._robot.names)
            raise PlanningError(
                PlanningCode.INVALID_GROUP_NAME, f'group_name is empty; groups: {known}'
            )
        snapshot, positions = self._monitor.start(message.start_state, message.group_name)
        if scene_diff is not None and scene_diff.is_diff:
            snapshot = apply_scene(snapshot, scene_diff, positions)
        return lambda: self._plan(message, snapshot, positions)

    def display(self, planned: PlannedMotion) -> None:
        """Show a motion to listeners.

        Args:
            planned: The motion.
        """
        self._displayed.publish(
            DisplayTrajectory(
                model_id=self._robot.name,
                trajectory=[planned.trajectory],
                trajectory_start=planned.start,
            )
        )

    def _plan(self, message: Any, snapshot: SceneSnapshot, positions: Array) -> PlannedMotion:  # noqa: ANN401
        begin = time.monotonic()
        model, planner = self._planners.at(message.group_name, positions)
        request = RequestReader(model, snapshot, positions).request(message)
        plan = planner.plan(request, scene_for(snapshot, model.scene))
        start = state_message(self._robot.joints, positions, snapshot.root)
        trajectory = trajectory_message(model.joints, plan.path, snapshot.root)
        return PlannedMotion(start, trajectory, time.monotonic() - begin)

    def _serve(self, request: Any) -> Callable[[], Any]:  # noqa: ANN401
        work = self.prepare(request.motion_plan_request)

        def answer() -> Any:  # noqa: ANN401
            planned = work()
            self.display(planned)
            response = GetMotionPlan.Response()
            filled = response.motion_plan_response
            filled.error_code = error_code()
            filled.group_name = request.motion_plan_request.group_name
            filled.trajectory_start = planned.start
            filled.trajectory = planned.trajectory
            filled.planning_time = planned.planning_time
            return response

        return answer


def _refuse(response: Any, error: PlanningError) -> None:  # noqa: ANN401
    response.motion_plan_response.error_code = error_code(error.code, str(error))


def _interfaces(_request: Any, response: Any) -> Any:  # noqa: ANN401
    response.planner_interfaces = [
        PlannerInterfaceDescription(
            name='RRT-Connect', pipeline_id=OMPL, planner_ids=list(FREE_MOTION)
        ),
        PlannerInterfaceDescription(
            name='PTP, LIN, CIRC', pipeline_id=PILZ, planner_ids=list(PLANNER_IDS)
        ),
    ]
    return response
