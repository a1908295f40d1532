# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts MoveIt's motion plan requests to requests of the core."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from geometry_msgs.msg import Point, Quaternion
import numpy as np

from arm_model import (
    Array,
    combined,
    frozen,
    inverse,
    ORIGIN,
    PlacedShape,
    Pose,
    RobotModel,
)
from arm_model.ros import pose_of, primitive_shape, xyzw

from ..exceptions import coded, PlanningCode, PlanningError
from ..moveit_settings import MoveItSettings, PIPELINES
from ..pilz_planner import PLANNER_IDS
from ..planner import DEFAULT_PLANNER, FREE_MOTION, unknown_planner
from ..requests import (
    CircPoint,
    CircPointKind,
    DEFAULT_TIMEOUT,
    Goal,
    JointGoal,
    MotionRequest,
    OrientationConstraint,
    Parameterization,
    PathConstraints,
    PoseGoal,
    PositionConstraint,
)
from .scene import SceneSnapshot

OMPL, PILZ = PIPELINES

START_BOUNDS_ERROR = 0.01
"""How far a joint may be beyond a limit at the start in [rad], because drives rest slightly off;
MoveIt's start_state_max_bounds_error. Execution allows the same when the motion begins."""

ROUNDING = 1e-9  # by how much joint constraints may miss each other for rounding in [rad] or [m]

BAD_GOAL = PlanningCode.INVALID_GOAL_CONSTRAINTS


class RequestReader:
    """Reads requests for one group in one scene, with the robot at rest.

    Attributes:
        start: Positions of the group's joints in [rad], clamped if they are just beyond a limit.
    """

    def __init__(
        self,
        model: RobotModel,
        snapshot: SceneSnapshot,
        positions: Array,
        settings: MoveItSettings | None = None,
    ) -> None:
        self._settings = settings or MoveItSettings()
        self._model, self._snapshot, self._positions = model, snapshot, positions
        place = dict(zip(snapshot.scene.kinematics.joints, positions.tolist(), strict=True))
        start = np.array([place[name] for name in model.joints])
        within = np.clip(start, model.limits.lower, model.limits.upper)
        self.start = frozen(np.where(np.abs(start - within) <= START_BOUNDS_ERROR, within, start))

    def request(self, message: Any) -> MotionRequest:  # noqa: ANN401  # messages have no type
        """Convert a moveit_msgs/MotionPlanRequest; the motion starts at :attr:`start`."""
        if message.pipeline_id not in {'', *PIPELINES}:
            known = ', '.join(PIPELINES)
            raise PlanningError(
                PlanningCode.PLANNING_FAILED,
                f'No planning pipeline {message.pipeline_id!r}; choose one of {known}',
            )
        if not message.goal_constraints:
            raise _bad_goal('no goal constraints; a goal has joints or a pose')
        if message.trajectory_constraints.constraints or message.reference_trajectories:
            raise _bad_goal('trajectory_constraints and reference_trajectories are not supported')
        via = self._via(message.path_constraints)
        constraints = None if via else self.constraints(message.path_constraints)
        return MotionRequest(
            start=self.start,
            goals=tuple(self.goal(each) for each in message.goal_constraints),
            planner_id=self._planner_id(message),
            velocity_scaling=scaling_factor(
                'velocity', message.max_velocity_scaling_factor, self._settings.velocity_scaling
            ),
            acceleration_scaling=scaling_factor(
                'acceleration',
                message.max_acceleration_scaling_factor,
                self._settings.acceleration_scaling,
            ),
            timeout=planning_time(message.allowed_planning_time),
            attempts=max(message.num_planning_attempts, 1),
            constraints=constraints,
            via=via,
            max_cartesian_speed=max(message.max_cartesian_speed, 0.0),
            cartesian_speed_link=message.cartesian_speed_limited_link,
        )

    def _planner_id(self, message: Any) -> str:  # noqa: ANN401
        """Return our name of the requested planner."""
        planners = self._settings.planners
        if (message.pipeline_id or self._settings.default_pipeline) == PILZ:
            return message.planner_id or self._settings.default_industrial
        name = planners.name(message.planner_id, message.group_name)
        if name in {'', *FREE_MOTION, *PLANNER_IDS}:
            return name
        if not planners.search(name):
            listed = planners.groups.get(message.group_name) or FREE_MOTION
            raise unknown_planner(name, listed)
        return DEFAULT_PLANNER

    def goal(self, message: Any) -> Goal:  # noqa: ANN401
        """Convert moveit_msgs/Constraints to a goal."""
        if message.visibility_constraints:
            raise _bad_goal('visibility constraints are not supported')
        positions, turns = message.position_constraints, message.orientation_constraints
        if message.joint_constraints:
            if positions or turns:
                raise _bad_goal('a goal has joint constraints or a pose, not both')
            return self._joint_goal(message.joint_constraints)
        if len(positions) > 1 or len(turns) > 1 or not (positions or turns):
            raise _bad_goal(
                f'{len(positions)} position and {len(turns)} orientation constraints; a pose has'
                ' one of each at most, and one of them at least'
            )
        return self._pose_goal(positions, turns)

    def constraints(self, message: Any) -> PathConstraints | None:  # noqa: ANN401
        """Convert moveit_msgs/Constraints to path constraints; None if they are empty."""
        if message.visibility_constraints:
            raise _bad_goal('visibility constraints are not supported')
        joints = self._joint_ranges(message.joint_constraints)
        turns = [self._orientation(each) for each in message.orientation_constraints]
        places = [self._positions_in(each) for each in message.position_constraints]
        if not (joints or turns or places):
            return None
        return PathConstraints(joints, turns, places)

    def pose(self, message: Any, frame: str, what: str) -> Pose:  # noqa: ANN401
        """Convert a geometry_msgs/Pose given in a frame to a pose in the root link."""
        with coded(BAD_GOAL):
            place = pose_of(message.position, message.orientation, what)
        return combined(self._snapshot.frame(frame, self._positions), place)

    def on_link(self, pose: Pose, frame: str) -> tuple[str, Pose]:
        """Return the link that carries a frame (empty: the tip), and its pose for the frame's."""
        link, place = self._link_of(frame)
        return link, combined(pose, inverse(place))

    def _link_of(self, frame: str) -> tuple[str, Pose]:
        """Return the link that carries a frame (empty for the tip), and the frame's pose in it."""
        if not frame:
            return self._model.tip, ORIGIN
        with coded(PlanningCode.INVALID_LINK_NAME, 'link_name'):
            return self._snapshot.link_of(frame)

    def _joint_goal(self, messages: Sequence[Any]) -> JointGoal:
        ranges = self._joint_ranges(messages)
        wanted = {name: position for name, position, _, _ in map(self._leading, messages)}
        positions, tolerance = np.array(self.start), np.zeros(len(self.start))
        for place, name in enumerate(self._model.joints):
            if name in ranges:
                lower, upper = ranges[name]
                positions[place] = min(max(wanted[name], lower), upper)
                tolerance[place] = min(positions[place] - lower, upper - positions[place])
        return JointGoal(frozen(positions), frozen(tolerance))

    def _joint_ranges(self, messages: Sequence[Any]) -> dict[str, tuple[float, float]]:
        ranges: dict[str, tuple[float, float]] = {}
        continuous = dict(zip(self._model.joints, self._model.limits.continuous, strict=True))
        for each in messages:
            name, position, below, above = self._leading(each)
            if name not in self._model.joints:
                known = ', '.join(self._model.joints)
                raise _bad_goal(f'no joint {name!r} in {self._model.group}; joints: {known}')
            numbers = (each.position, each.tolerance_above, each.tolerance_below)
            if not all(map(math.isfinite, numbers)) or min(numbers[1:]) < 0.0:
                raise _bad_goal(
                    f'joint constraint of {each.joint_name}: position and tolerances are'
                    f' {numbers}; they must be finite, the tolerances not negative'
                )
            before = ranges.get(name, (-math.inf, math.inf))
            if name in ranges and continuous[name]:
                middle = 0.5 * sum(before)
                position = middle + math.remainder(position - middle, math.tau)
            lower = max(before[0], position - below)
            upper = min(before[1], position + above)
            if lower > upper + ROUNDING:
                raise _bad_goal(f'joint constraints of {name} contradict each other')
            ranges[name] = (lower, max(lower, upper))
        return ranges

    def _leading(self, message: Any) -> tuple[str, float, float, float]:  # noqa: ANN401
        """Return joint, position and tolerances of a constraint; mimic joints give the source."""
        name, position = message.joint_name, message.position
        below, above = message.tolerance_below, message.tolerance_above
        mimic = self._model.kinematics.mimics.get(name)
        if mimic is None or mimic.source not in self._model.joints or not mimic.multiplier:
            return name, position, below, above
        if mimic.multiplier < 0.0:
            below, above = above, below
        scale = abs(mimic.multiplier)
        position = (position - mimic.offset) / mimic.multiplier
        return mimic.source, position, below / scale, above / scale

    def _pose_goal(self, positions: Sequence[Any], turns: Sequence[Any]) -> PoseGoal:
        names = {each.link_name for each in (*positions, *turns)}
        if len(names) > 1:
            raise _bad_goal(
                f'position of {positions[0].link_name}, orientation of another link:'
                f' {turns[0].link_name}; a goal is for one link'
            )
        link, _ = self._link_of(next(iter(names)))
        here = self._snapshot.frame(link, self._positions)
        rotation, place = here.rotation, here.position
        within = PathConstraints(
            orientations=[self._orientation(each) for each in turns],
            positions=[self._positions_in(each) for each in positions],
        )
        for turn in within.orientations:
            rotation = frozen(turn.rotation @ turn.in_link.T)
        for point in within.positions:
            place = frozen(point.regions[0].pose.position - rotation @ point.offset)
        return PoseGoal(Pose(rotation, place), link, within)

    def _positions_in(self, message: Any) -> PositionConstraint:  # noqa: ANN401
        region, what = message.constraint_region, f'position constraint of {message.link_name!r}'
        count = len(region.primitives)
        if region.meshes or not count or len(region.primitive_poses) != count:
            raise _bad_goal(
                f'{what}: its region has {count} primitives, {len(region.primitive_poses)} poses'
                f' and {len(region.meshes)} meshes; give it primitives, and a pose for each'
            )
        with coded(BAD_GOAL):
            offset = pose_of(message.target_point_offset, Quaternion(), what).position
        link, place = self._link_of(message.link_name)
        regions = []
        for primitive, pose in zip(region.primitives, region.primitive_poses, strict=True):
            with coded(BAD_GOAL):
                shape = primitive_shape(primitive, what)
            lengths = [float(each) for each in primitive.dimensions]
            if not all(0.0 <= each < math.inf for each in lengths):
                raise _bad_goal(f'{what}: the lengths of its region are {lengths}')
            regions.append(PlacedShape(shape, self.pose(pose, message.header.frame_id, what)))
        return PositionConstraint(link, frozen(place.position + place.rotation @ offset), regions)

    def _orientation(self, message: Any) -> OrientationConstraint:  # noqa: ANN401
        what = f'orientation constraint of {message.link_name!r}'
        tolerance = np.array(
            [
                message.absolute_x_axis_tolerance,
                message.absolute_y_axis_tolerance,
                message.absolute_z_axis_tolerance,
            ]
        )
        if not (np.isfinite(tolerance).all() and (tolerance >= 0.0).all()):
            raise _bad_goal(f'{what}: its tolerances are {tolerance.tolist()}')
        quaternion = xyzw(message.orientation)
        if not any(quaternion) and tolerance.min() < math.pi:
            raise _bad_goal(
                f'{what}: its orientation is all zeros; give a quaternion of length 1, w = 1 for'
                ' no turn'
            )
        with coded(BAD_GOAL):
            pose = pose_of(Point(), message.orientation, what)
        frame = self._snapshot.frame(message.header.frame_id, self._positions)
        rotation = frame.rotation @ pose.rotation
        if message.parameterization not in set(Parameterization):
            raise _bad_goal(
                f'{what}: no parameterization {message.parameterization}; choose'
                ' XYZ_EULER_ANGLES (0) or ROTATION_VECTOR (1)'
            )
        link, place = self._link_of(message.link_name)
        return OrientationConstraint(
            link,
            frozen(rotation),
            frozen(tolerance),
            Parameterization(message.parameterization),
            place.rotation,
        )

    def _via(self, message: Any) -> CircPoint | None:  # noqa: ANN401
        """Return the auxiliary point of CIRC, given as a path constraint as in Pilz' planner."""
        kinds = [kind for kind in CircPointKind if kind.value == message.name]
        if not kinds:
            return None
        if len(message.position_constraints) != 1:
            raise _bad_goal(
                f'path constraint {message.name!r}: CIRC needs one position constraint in it'
            )
        region = message.position_constraints[0].constraint_region
        if len(region.primitive_poses) != 1:
            raise _bad_goal(f'path constraint {message.name!r}: CIRC needs one primitive_pose')
        frame = message.position_constraints[0].header.frame_id
        point = self.pose(region.primitive_poses[0], frame, message.name).position
        return CircPoint(kinds[0], frozen(point))


def planning_time(given: float) -> float:
    """Return the planning time in [s]; 0 or less means not given, as in MoveIt."""
    if not math.isfinite(given):
        raise PlanningError(
            PlanningCode.FAILURE, f'allowed_planning_time is {given:g} s; it must be finite'
        )
    return given if given > 0.0 else DEFAULT_TIMEOUT


def scaling_factor(what: str, value: float, default: float = 1.0) -> float:
    """Return a scaling factor; 0 means not given."""
    if not 0.0 <= value <= 1.0:
        raise PlanningError(
            PlanningCode.FAILURE,
            f'max_{what}_scaling_factor is {value:g}; it must be above 0 and 1 at most',
        )
    return value or default


def _bad_goal(reason: str) -> PlanningError:
    return PlanningError(BAD_GOAL, reason)
