# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plans motions for clients: the planning threads, responses, and display of plans."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count, groupby, pairwise
import time
from typing import Any

from moveit_msgs.msg import (
    DisplayTrajectory,
    MotionSequenceResponse,
    MoveItErrorCodes,
    RobotTrajectory,
)
from moveit_msgs.msg import RobotState as StateMessage
from moveit_msgs.srv import GetMotionPlan, GetMotionSequence
from rclpy.node import Node

from arm_model import Array, frozen, RobotModel
from node_runner import LATCHED

from ..exceptions import coded, PlanningCode, PlanningError
from ..moveit_settings import MoveItSettings
from ..pilz_motions import CartesianLimits
from ..pilz_planner import check_radii, SequenceItem
from ..planner import CANCELED, Planner
from ..requests import MotionRequest
from .background import Background, error_code
from .motion_request import RequestReader
from .robot_groups import RobotGroups
from .scene import SceneSnapshot
from .scene_changes import apply_scene, scene_for
from .scene_monitor import SceneMonitor
from .trajectories import state_message, trajectory_message


@dataclass(frozen=True, slots=True, eq=False)
class PlannedMotion:
    """Planning result for a client."""

    start: StateMessage  # where it begins
    # the motion; a sequence has one for each change of the group
    trajectories: Sequence[RobotTrajectory]
    planning_time: float  # how long planning took in [s]
    notes: Sequence[str] = ()  # what a person should know, such as where it is slower than asked


@dataclass(frozen=True, slots=True)
class _GroupRun:
    """Consecutive items of a sequence that move the same group: one trajectory."""

    group: str  # name of the group
    first: int  # number of the first item
    items: Sequence[Any]  # the moveit_msgs/MotionSequenceItem


SEEDS = count()  # seeds of planners: a second attempt at a plan searches in another way


class GroupPlanners:
    """The planner of each group of a robot, rebuilt when joints outside the group have moved."""

    def __init__(
        self, robot: RobotGroups, cartesian_limits: CartesianLimits | None = None
    ) -> None:
        self._robot, self._cartesian_limits = robot, cartesian_limits
        self._planners: dict[str, tuple[RobotModel, Planner]] = {}

    def at(self, group: str, positions: Array) -> tuple[RobotModel, Planner]:
        """Return model and planner of a group, with joints outside it at positions in [rad]."""
        model = self._robot.model_at(group, positions)
        known = self._planners.get(group)
        if known is None or known[0] is not model:
            planner = Planner(model, self._cartesian_limits, seed=next(SEEDS))
            known = self._planners[group] = model, planner
        return known


class PlanningThreads:
    """Plans in one thread per group, so that groups do not wait for each other."""

    def __init__(
        self,
        node: Node,
        monitor: SceneMonitor,
        background: Background,
        *,
        settings: MoveItSettings | None = None,
        cartesian_limits: CartesianLimits | None = None,
    ) -> None:
        self._monitor, self._background, self._settings = monitor, background, settings
        # those of each lane, in its thread
        self._planners = defaultdict[str, GroupPlanners](
            lambda: GroupPlanners(monitor.robot, cartesian_limits)
        )
        self._displayed = node.create_publisher(DisplayTrajectory, 'display_planned_path', LATCHED)
        background.serve(
            GetMotionPlan,
            'plan_kinematic_path',
            self._serve,
            _refuse,
            lambda asked: str(asked.motion_plan_request.group_name),
        )
        background.serve(
            GetMotionSequence,
            'plan_sequence_path',
            self._serve_sequence,
            _refuse_sequence,
            lambda asked: sequence_group(asked.request.items),
        )

    def is_moving(self, group: str) -> bool:
        """Whether a joint of a group moves."""
        return self._monitor.is_moving(group)

    def prepare(
        self,
        message: Any,  # noqa: ANN401
        scene_diff: Any = None,  # noqa: ANN401
        is_canceled: Callable[[], bool] = lambda: False,
    ) -> Callable[[], PlannedMotion]:
        """Return a function that plans a motion in the thread; call this one in the executor.

        Args:
            scene_diff: A moveit_msgs/PlanningScene that applies to this plan only.
            is_canceled: Returns whether the goal is canceled; if so, the search ends at once.
        """
        if not message.group_name:
            known = ', '.join(self._monitor.robot.names)
            raise PlanningError(
                PlanningCode.INVALID_GROUP_NAME, f'group_name is empty; groups: {known}'
            )
        snapshot, positions = self._monitor.start(message.start_state, message.group_name)
        snapshot = _changed(snapshot, scene_diff, positions)
        return lambda: _noted(
            snapshot, lambda: self._plan(message, snapshot, positions, is_canceled)
        )

    def prepare_sequence(
        self,
        items: Sequence[Any],
        scene_diff: Any = None,  # noqa: ANN401
        is_canceled: Callable[[], bool] = lambda: False,
    ) -> Callable[[], PlannedMotion]:
        """Return a function that plans a sequence, as :meth:`prepare`; no items, no motion."""
        if not items:
            return lambda: PlannedMotion(StateMessage(), [], 0.0, ['no items: nothing moves'])
        runs = _group_runs(items)
        snapshot, positions = self._monitor.start(items[0].req.start_state, runs[0].group)
        for number, run in enumerate(runs[1:], 1):
            if run.group not in [each.group for each in runs[:number]]:
                positions = self._begin(run, positions)
        snapshot = _changed(snapshot, scene_diff, positions)
        return lambda: _noted(
            snapshot, lambda: self._plan_sequence(runs, snapshot, positions, is_canceled)
        )

    def _begin(self, run: _GroupRun, positions: Array) -> Array:
        """Return all joint positions, with those at which the first item of a group begins."""
        state = run.items[0].req.start_state
        if state.attached_collision_objects:
            raise PlanningError(
                PlanningCode.INVALID_ROBOT_STATE,
                f'sequence: item {run.first} attaches bodies; the first item of all may',
            )
        _, given = self._monitor.start(state, run.group)
        joints = self._monitor.robot.group_joints()[run.group]
        places = dict(zip(self._monitor.robot.joints, given.tolist(), strict=True))
        return self._moved(positions, {name: places[name] for name in joints if name in places})

    def _moved(self, positions: Array, places: Mapping[str, float]) -> Array:
        joints = self._monitor.robot.joints
        return frozen(
            [places.get(name, at) for name, at in zip(joints, positions.tolist(), strict=True)]
        )

    def display(self, planned: PlannedMotion) -> None:
        """Publish a motion for display."""
        self._displayed.publish(
            DisplayTrajectory(
                model_id=self._monitor.robot.name,
                trajectory=list(planned.trajectories),
                trajectory_start=planned.start,
            )
        )

    def _plan(
        self,
        message: Any,  # noqa: ANN401
        snapshot: SceneSnapshot,
        positions: Array,
        is_canceled: Callable[[], bool],
    ) -> PlannedMotion:
        begin, group = time.monotonic(), message.group_name
        model, planner = self._planners[group].at(group, positions)
        request = RequestReader(model, snapshot, positions, self._settings).request(message)
        plan = planner.plan(
            request,
            scene_for(snapshot, model.scene),
            lambda: is_canceled() or self._background.is_closing,
        )
        start = state_message(self._monitor.robot.joints, positions, snapshot.root)
        trajectory = trajectory_message(model.joints, plan.path, snapshot.root)
        return PlannedMotion(start, [trajectory], time.monotonic() - begin, plan.notes)

    def _plan_sequence(
        self,
        runs: Sequence[_GroupRun],
        snapshot: SceneSnapshot,
        start: Array,
        is_canceled: Callable[[], bool],
    ) -> PlannedMotion:
        begin, positions = time.monotonic(), start
        planners = self._planners[runs[0].group]
        trajectories = []
        notes: list[str] = []
        for run in runs:
            model, planner = planners.at(run.group, positions)
            read = self._item_reader(model, snapshot, positions, is_canceled)
            items = [
                SequenceItem(partial(read, number, item.req), item.blend_radius)
                for number, item in enumerate(run.items, run.first)
            ]
            plan = planner.plan_sequence(items, scene_for(snapshot, model.scene), run.first)
            trajectories.append(trajectory_message(model.joints, plan.path, snapshot.root))
            end = dict(zip(model.joints, plan.path.end.position.tolist(), strict=True))
            positions = self._moved(positions, end)
            notes += plan.notes
        return PlannedMotion(
            state_message(self._monitor.robot.joints, start, snapshot.root),
            trajectories,
            time.monotonic() - begin,
            notes,
        )

    def _item_reader(
        self,
        model: RobotModel,
        snapshot: SceneSnapshot,
        positions: Array,
        is_canceled: Callable[[], bool],
    ) -> Callable[[int, Any, Array | None], MotionRequest]:
        """Return a function that reads an item of a sequence, given its number, message and start.

        The start, which is the end of the previous item, replaces what the message leaves out.
        """

        def read(number: int, message: Any, start: Array | None) -> MotionRequest:  # noqa: ANN401
            with coded(place=f'sequence: item {number}'):
                if is_canceled():
                    raise PlanningError(PlanningCode.PREEMPTED, CANCELED)
                here = positions
                if start is not None:
                    here = self._moved(here, dict(zip(model.joints, start.tolist(), strict=True)))
                return RequestReader(model, snapshot, here, self._settings).request(message)

        return read

    def _serve_sequence(self, request: Any) -> Callable[[], Any]:  # noqa: ANN401
        work = self.prepare_sequence(request.request.items)
        return lambda: GetMotionSequence.Response(
            response=sequence_response(*self._displayed_plan(work))
        )

    def _serve(self, request: Any) -> Callable[[], Any]:  # noqa: ANN401
        work = self.prepare(request.motion_plan_request)

        def answer() -> Any:  # noqa: ANN401
            response = GetMotionPlan.Response()
            filled = response.motion_plan_response
            filled.error_code, planned = self._displayed_plan(work)
            filled.group_name = request.motion_plan_request.group_name
            filled.trajectory_start = planned.start
            (filled.trajectory,) = planned.trajectories
            filled.planning_time = planned.planning_time
            return response

        return answer

    def _displayed_plan(
        self, work: Callable[[], PlannedMotion]
    ) -> tuple[MoveItErrorCodes, PlannedMotion]:
        planned = work()
        self.display(planned)
        return error_code(reason='; '.join(planned.notes)), planned


def sequence_group(items: Sequence[Any]) -> str:
    """Return the group in whose thread the items of a sequence are planned."""
    return str(items[0].req.group_name) if items else ''


def sequence_response(code: MoveItErrorCodes, planned: PlannedMotion | None) -> Any:  # noqa: ANN401
    """Return a moveit_msgs/MotionSequenceResponse."""
    response = MotionSequenceResponse(error_code=code)
    if planned is not None:
        response.sequence_start = planned.start
        response.planned_trajectories = list(planned.trajectories)
        response.planning_time = planned.planning_time
    return response


def _noted(snapshot: SceneSnapshot, plan: Callable[[], PlannedMotion]) -> PlannedMotion:
    """Plan, and add the notes on objects of the scene to the result."""
    try:
        planned = plan()
    except PlanningError as error:
        raise PlanningError(error.code, '; '.join((str(error), *snapshot.notes))) from error
    return replace(planned, notes=(*planned.notes, *snapshot.notes))


def _changed(
    snapshot: SceneSnapshot,
    diff: Any,  # noqa: ANN401
    positions: Array,
) -> SceneSnapshot:
    """Apply the scene change of a request, whether or not it sets is_diff."""
    if diff is None:
        return snapshot
    diff.is_diff = True
    return apply_scene(snapshot, diff, positions)


def _refuse_sequence(response: Any, error: PlanningError) -> None:  # noqa: ANN401
    response.response.error_code = error_code(error.code, str(error))


def _refuse(response: Any, error: PlanningError) -> None:  # noqa: ANN401
    response.motion_plan_response.error_code = error_code(error.code, str(error))


def _group_runs(items: Sequence[Any]) -> list[_GroupRun]:
    """Return the items of a moveit_msgs/MotionSequenceRequest by group, in their order."""
    radii = [item.blend_radius for item in items]
    check_radii(radii)
    groups = [item.req.group_name for item in items]
    for number, (item, group) in enumerate(zip(items, groups, strict=True)):
        if not group:
            raise PlanningError(
                PlanningCode.INVALID_GROUP_NAME, f'sequence: item {number}: group_name is empty'
            )
        state = item.req.start_state
        has_state = state.joint_state.name or state.attached_collision_objects
        if group in groups[:number] and has_state:
            raise PlanningError(
                PlanningCode.INVALID_ROBOT_STATE,
                f'sequence: item {number} has a start state, and {group} is moved before it; only'
                ' the first item of a group may have one',
            )
    for number, ((group, following), radius) in enumerate(
        zip(pairwise(groups), radii, strict=False)
    ):
        if group != following and radius > 0.0:
            raise PlanningError(
                PlanningCode.INVALID_MOTION_PLAN,
                f'sequence: item {number} has a blend radius of {radius:g} m, and the next moves'
                f' {following} instead of {group}; give 0',
            )
    numbered = groupby(enumerate(items), key=lambda pair: pair[1].req.group_name)
    runs = [(group, list(pairs)) for group, pairs in numbered]
    return [_GroupRun(group, pairs[0][0], [item for _, item in pairs]) for group, pairs in runs]
