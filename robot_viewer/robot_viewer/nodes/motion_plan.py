# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Conversions between MoveIt messages and plan groups, goals and planned motions.

The package needs moveit_msgs only for planning.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeAlias

from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from urdf_reader import (
    DescriptionError,
    find_group,
    KinematicTree,
    link_poses,
    parse_srdf,
    Transform,
    Vector,
)

Message: TypeAlias = Any  # messages have no types

LINE_POINTS = 80  # of the drawn tip path
PAUSE = 0.8  # between two replays of a plan in [s]
SHOWINGS = 3
"""Number of replays of a plan."""


@dataclass(frozen=True, slots=True)
class PlanGroup:
    """An SRDF group for which motions can be planned."""

    name: str
    joints: tuple[str, ...]  # from the base to the tip
    tip: str  # link to which a Cartesian goal applies
    states: Mapping[str, Mapping[str, float]]
    """Named states: joint positions in [rad] or [m] by joint."""


def plan_groups(tree: KinematicTree, semantic: str) -> dict[str, PlanGroup]:
    """Return the groups of an SRDF that can move, arms first.

    Raises:
        DescriptionError: The text is not an SRDF, or no group can move.
    """
    description = parse_srdf(semantic)
    found, reasons = {}, []
    for name in dict.fromkeys((*description.arms, *description.groups)):
        try:
            group = find_group(tree, description, name)
        except DescriptionError as error:
            reasons.append(str(error))
            continue
        states = {
            state: {joint: at for joint, at in positions.items() if joint in group.joints}
            for state, positions in description.poses.get(name, {}).items()
        }
        found[name] = PlanGroup(name, group.joints, group.tip, states)
    if not found:
        raise DescriptionError('; '.join(reasons) or 'the SRDF has no groups')
    return found


@dataclass(frozen=True, slots=True)
class PlannedMotion:
    """A planned trajectory."""

    joints: tuple[str, ...]  # the joints that move
    times: tuple[float, ...]  # of its points in [s], increasing
    points: tuple[tuple[float, ...], ...]  # positions in [rad] or [m], in the order of the joints

    @property
    def duration(self) -> float:
        """Duration in [s]."""
        return self.times[-1] if self.times else 0.0

    def at(self, time: float) -> dict[str, float]:
        """Return the joint positions at a time in [s], clamped to the ends of the motion."""
        tracks = zip(self.joints, zip(*self.points, strict=True), strict=True)
        return {joint: float(np.interp(time, self.times, track)) for joint, track in tracks}

    def shown(self, elapsed: float) -> dict[str, float] | None:
        """Return the joint positions of the replay; None after the last one."""
        number, time = divmod(elapsed, self.duration + PAUSE)
        return self.at(time) if number < SHOWINGS else None


def tip_line(
    tree: KinematicTree, tip: str, beside: Mapping[str, float], motion: PlannedMotion
) -> list[Vector]:
    """Return points of a link's path in the root link frame in [m]."""
    step = motion.duration / (LINE_POINTS - 1)
    return [
        link_poses(tree, {**beside, **motion.at(number * step)})[tip].translation
        for number in range(LINE_POINTS)
    ]


PLANNING_TIME = 5.0  # allowed by a request in [s]
JOINT_TOLERANCE = 1e-3  # of goals in [rad] or [m]


def plan_goal(group: PlanGroup, goal: Mapping[str, float], share: float) -> Message:
    """Return a plan-only moveit_msgs/MoveGroup goal.

    ``share`` is the velocity and acceleration scaling factor, above 0 to 1.
    """
    moveit = import_module('moveit_msgs.msg')
    message = import_module('moveit_msgs.action').MoveGroup.Goal()
    request, options = message.request, message.planning_options
    request.group_name, request.num_planning_attempts = group.name, 1
    request.allowed_planning_time = PLANNING_TIME
    request.max_velocity_scaling_factor = request.max_acceleration_scaling_factor = share
    request.start_state.is_diff = options.planning_scene_diff.is_diff = True
    options.planning_scene_diff.robot_state.is_diff = options.plan_only = True
    wanted = [
        moveit.JointConstraint(
            joint_name=name,
            position=position,
            tolerance_above=JOINT_TOLERANCE,
            tolerance_below=JOINT_TOLERANCE,
            weight=1.0,
        )
        for name, position in goal.items()
    ]
    request.goal_constraints.append(moveit.Constraints(joint_constraints=wanted))
    return message


def ik_request(
    group: PlanGroup, pose: Transform, frame: str, near: Mapping[str, float]
) -> Message:
    """Return a compute_ik request for a tip pose in a frame, seeded with ``near``."""
    message = import_module('moveit_msgs.srv').GetPositionIK.Request()
    asked = message.ik_request
    asked.group_name, asked.ik_link_name, asked.avoid_collisions = group.name, group.tip, True
    asked.robot_state.is_diff = True
    asked.robot_state.joint_state = JointState(name=list(near), position=list(near.values()))
    asked.pose_stamped = PoseStamped(header=Header(frame_id=frame), pose=pose_message(pose))
    return message


def positions_of(state: Message, group: PlanGroup) -> dict[str, float]:
    """Return the positions of a group in a moveit_msgs/RobotState."""
    positions = dict(zip(state.joint_state.name, state.joint_state.position, strict=False))
    return {name: positions[name] for name in group.joints if name in positions}


def planned_motion(trajectory: Message) -> PlannedMotion:
    """Return the motion of a moveit_msgs/RobotTrajectory."""
    joints = trajectory.joint_trajectory
    times = (p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in joints.points)
    points = (tuple(map(float, point.positions)) for point in joints.points)
    return PlannedMotion(tuple(joints.joint_names), tuple(times), tuple(points))


def refusal(error_code: Message) -> str:
    """Return the text of an error code; empty for success."""
    kind = type(error_code)
    if error_code.val == kind.SUCCESS:
        return ''
    names = (name for name in dir(type(kind)) if name.isupper())
    called = (name for name in names if getattr(kind, name, None) == error_code.val)
    code = next(called, f'code {error_code.val}')
    return f'{code}: {error_code.message}' if error_code.message else code


def box_message(
    name: str, size: tuple[float, float, float], pose: Transform, frame: str
) -> Message:
    """Return a scene diff that adds a box with edges in [m], centred at a pose in a frame."""
    solid = import_module('shape_msgs.msg').SolidPrimitive
    box = solid(type=solid.BOX, dimensions=list(size))
    shapes = {'pose': pose_message(pose), 'primitives': [box], 'primitive_poses': [Pose()]}
    return scene_change('ADD', name, Header(frame_id=frame), **shapes)


def scene_change(operation: str, name: str, header: Header, **values: object) -> Message:
    """Return a scene diff that applies a moveit_msgs/CollisionObject operation to an object."""
    moveit = import_module('moveit_msgs.msg')
    code = getattr(moveit.CollisionObject, operation)
    thing = moveit.CollisionObject(id=name, header=header, operation=code, **values)
    scene = moveit.PlanningScene(is_diff=True)
    scene.robot_state.is_diff = True
    scene.world.collision_objects.append(thing)
    return scene


def transform_of(pose: Pose) -> Transform:
    """Convert a geometry_msgs/Pose; an all-zero quaternion becomes the identity."""
    place, turn = pose.position, pose.orientation
    rotation = (turn.x, turn.y, turn.z, turn.w)
    if not any(rotation):  # the message left it out
        return Transform((place.x, place.y, place.z))
    return Transform((place.x, place.y, place.z), rotation)


def pose_message(pose: Transform) -> Pose:
    """Convert to a geometry_msgs/Pose."""
    (x, y, z), (a, b, c, d) = pose.translation, pose.rotation
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=a, y=b, z=c, w=d))
