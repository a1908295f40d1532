# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What an arm takes a part up with: its gripper, or its flange; measured on the description."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import product
import math

import numpy as np
import pinocchio as pin

from arm_model import (
    Array,
    Box,
    Clearances,
    CollisionObject,
    combined,
    frozen,
    inverse,
    Pose,
    RobotModel,
)

PART = 'part'
"""Name of what is picked and placed."""
GAP = 0.003
"""Room between a flange and the part, and between the part and the table, in [m]."""
FINGER_ROOM = 0.006
"""Least room between an open gripper and the part in [m]."""
GRIP_ROOM = 0.001
"""Room at which fingers hold the part in [m]."""
DEPTH = 0.02
"""How far the part is between the fingers in [m]."""
WIDTHS = (0.08, 0.06, 0.05, 0.04, 0.03, 0.02, 0.01)
"""Widths of a part that is gripped in [m]; the widest that fits is taken."""
GRIPPED_HEIGHT = 0.08
"""Height of a part that is gripped in [m]."""
CUP_SHARE = 0.1
"""Longest suction cup, as a share of the reach."""
LONGER = 1.3
"""Length of the part, as a share of its width."""
WIDTH_SHARE, HEIGHT_SHARE = 0.07, 0.1
"""Width and height of a part below a flange, as shares of the reach."""
FAR = 1.0
"""Distances beyond this count as this in [m]."""
STEPS = 200
"""Places of a gripper that are looked at."""


@dataclass(frozen=True, slots=True)
class Gripper:
    """A gripper of one joint.

    Attributes:
        group: Its group in the SRDF.
        joint: Its joint.
        open: Where it is open in [m] or [rad].
        closed: Where it holds the part.
    """

    group: str
    joint: str
    open: float
    closed: float


@dataclass(frozen=True, slots=True, eq=False)
class Tool:
    """The end of an arm, with its z axis towards the part.

    Attributes:
        part: The part; its pose is in the tip link while it is held.
        height: Height of the part in [m].
        links: Links that the part may touch while it is held.
        gripper: The gripper; None where the part hangs at the flange.
    """

    part: CollisionObject
    height: float
    links: tuple[str, ...]
    gripper: Gripper | None = None

    @property
    def others(self) -> Mapping[str, float]:
        """Where joints beside the arm are on its way to the part in [m] or [rad]."""
        return {self.gripper.joint: self.gripper.open} if self.gripper else {}


def tool_links(model: RobotModel) -> tuple[str, ...]:
    """Return the links with shapes that the tip carries, or is fixed to.

    Args:
        model: The arm.
    """
    last = model.kinematics.parent_joint(model.tip)
    links = model.scene.link_shapes
    return tuple(link for link in links if model.kinematics.parent_joint(link) == last)


def extent(model: RobotModel, links: tuple[str, ...]) -> float:
    """Return how far links reach beyond the tip along its z axis at most in [m].

    Args:
        model: The arm, with the joints of its tool where they are to be.
        links: The links.
    """
    native, frame = model.kinematics.native, model.kinematics.frames[model.tip]
    placement = native.frames[frame].placement
    wanted = {model.kinematics.frames[link] for link in links}
    farthest = 0.0
    for thing in model.scene.geometry.geometryObjects:
        if thing.parentFrame not in wanted:
            continue
        thing.geometry.computeLocalAABB()
        box = thing.geometry.aabb_local
        in_tip = placement.actInv(thing.placement)
        for corner in product(*zip(box.min_, box.max_, strict=True)):
            farthest = max(farthest, float(in_tip.act(np.array(corner))[2]))
    return farthest


@dataclass(frozen=True, slots=True, eq=False)
class GripperParts:
    """What is known of a gripper before a part is chosen.

    Attributes:
        group: Its group.
        joint: Its joint.
        lower: Where it is closed in [m] or [rad].
        upper: Where it is open.
    """

    group: str
    joint: str
    lower: float
    upper: float


def flange_tool(model: RobotModel, home: Array) -> Tool:
    """Return the tool of an arm without a gripper: the part hangs below the flange, at a gap.

    The gap is the length of a suction cup: so long that the part is clear of the wrist.

    Args:
        model: The arm.
        home: Joint positions from which it begins in [rad].
    """
    links = tool_links(model)
    width, height = WIDTH_SHARE * model.reach, HEIGHT_SHARE * model.reach
    flange = extent(model, links) + height / 2
    for cup in np.arange(GAP, CUP_SHARE * model.reach, GAP).tolist():
        part = _part(width, height, flange + cup, 0.0)
        if _room(model, part, home, model.scene.link_shapes) >= GAP:
            break
    return Tool(part, height, links)


def gripping_tool(model: RobotModel, gripper: GripperParts, home: Array) -> Tool | None:
    """Return the tool of an arm with a gripper; None where nothing fits into that.

    Args:
        model: The arm.
        gripper: The gripper.
        home: Joint positions from which it begins in [rad].
    """
    opened = model.with_others({gripper.joint: gripper.upper})
    links = tool_links(opened)
    below = extent(opened, links) - DEPTH + GRIPPED_HEIGHT / 2
    turn = _closing_direction(model, gripper, links, home)
    for width in WIDTHS:
        part = _part(width, GRIPPED_HEIGHT, below, turn)
        if _room(opened, part, home, links) < FINGER_ROOM:
            continue
        for place in np.linspace(gripper.upper, gripper.lower, STEPS).tolist():
            closing = model.with_others({gripper.joint: place})
            if _room(closing, part, home, links) <= GRIP_ROOM:
                grip = Gripper(gripper.group, gripper.joint, gripper.upper, place)
                return Tool(part, GRIPPED_HEIGHT, links, grip)
    return None


def _closing_direction(
    model: RobotModel, gripper: GripperParts, links: tuple[str, ...], positions: Array
) -> float:
    """Return the direction in which the finger that moves most does so, about the tip's z axis."""
    ways = []
    places = [model.with_others({gripper.joint: at}) for at in (gripper.lower, gripper.upper)]
    for link in links:
        closed, opened = (
            combined(
                inverse(each.kinematics.link_pose(each.tip, positions)),
                each.kinematics.link_pose(link, positions),
            )
            for each in places
        )
        ways.append(opened.position - closed.position)
    way = max(ways, key=lambda each: float(np.linalg.norm(each[:2])))
    return math.atan2(way[1], way[0])


def _part(width: float, height: float, below: float, turn: float) -> CollisionObject:
    """Return a part below the tip, narrower in the direction in which fingers close on it."""
    box = Box(width, LONGER * width, height)
    return CollisionObject(PART, box, pose=Pose(about_z(turn), frozen([0.0, 0.0, below])))


def _room(
    model: RobotModel, part: CollisionObject, positions: Array, links: Collection[str]
) -> float:
    """Return the least distance between the part, where the tip holds it, and links in [m]."""
    at = combined(model.kinematics.link_pose(model.tip, positions), part.pose)
    scene = model.scene.with_object(part.at(at))
    distances = Clearances(scene).least(positions, FAR)
    rooms = [
        distance
        for (first, second), distance in zip(scene.pairs, distances.tolist(), strict=True)
        if PART in {first, second} and (first in links or second in links)
    ]
    return min(rooms, default=FAR)


def about_z(angle: float) -> Array:
    """Return a rotation matrix.

    Args:
        angle: Angle about the z axis in [rad].
    """
    cos, sin = math.cos(angle), math.sin(angle)
    return frozen(np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]))


def quaternion(pose: Pose) -> tuple[float, float, float, float]:
    """Return the orientation of a pose as x, y, z, w.

    Args:
        pose: The pose.
    """
    x, y, z, w = pin.Quaternion(np.array(pose.rotation)).coeffs().tolist()
    return x, y, z, w
