# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The kinematic tree of a group: its joints, and the mimic joints that follow them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import copy
from dataclasses import dataclass
from functools import lru_cache
import math

import numpy as np
import pinocchio as pin
from urdf_reader import KinematicTree, Mimic

from .arrays import Array, frozen, Mask, Native, Pose
from .exceptions import CommandError, ModelError

CONTINUOUS_BOUND = 1e9
"""Position range of continuous joints in [rad], so that their positions are plain angles."""

LINK = 'link '  # what the frame of a link is called in pinocchio, before the name of the link


@dataclass(frozen=True, slots=True, eq=False)
class RelativeMotion:
    """Effect of the joints between two bodies on their relative motion."""

    # sense in which each joint moves the second body against the first: 1, -1, or 0 for a joint
    # that is not between them
    sign: Array
    # how far each joint moves a point of the first at most in [m/rad], less the extent of the
    # first where the joint turns
    rate: Array
    turning: Mask  # the joints between them that turn


class Kinematics:
    """Joints of a group and the mimic joints that follow them; all other joints are fixed.

    Immutable, so any thread may read it. Columns are in the order of ``native``: joints of
    the group and mimic joints. ``expanded`` and ``projected`` convert from the group's joints
    to columns and back.

    Attributes:
        native: The pinocchio model; links are frames of it.
        joints: Joints of the group, in the order of ``native``; of a chain, from the base out.
        root: The fixed link in which poses of ``native`` are expressed.
        frames: Frame number of each link in ``native``, by link.
        others: Fixed positions of joints outside the group in [rad], by joint; without mimic
            joints.
        mimics: Mimic relations of the robot, by joint.
    """

    def __init__(self, tree: KinematicTree, group: Sequence[str]) -> None:
        """Build the tree; joints outside the group are at 0, or at the limit nearest to 0.

        Raises:
            ModelError: The URDF does not define a kinematic tree.
        """
        self._tree = tree
        self._full = full = _full(tree)
        mimics = {joint.name: joint.mimic for joint in tree.joints if joint.mimic is not None}
        moving = {*group, *(name for name, mimic in mimics.items() if mimic.source in group)}
        standing = [joint.name for joint in tree.movable() if joint.name not in moving]
        self.mimics: Mapping[str, Mimic] = mimics
        self._locked = [
            number for number in range(1, full.njoints) if full.names[number] not in moving
        ]
        nearest = np.clip(pin.neutral(full), full.lowerPositionLimit, full.upperPositionLimit)
        standing_at = {
            name: float(nearest[full.idx_qs[full.getJointId(name)]])
            for name in standing
            if name not in mimics
        }
        self._stand(standing_at)
        self.root = tree.root
        self.frames: Mapping[str, int] = {
            frame.name.removeprefix(LINK): number
            for number, frame in enumerate(self.native.frames)
            if frame.type == pin.FrameType.BODY
        }
        columns = list(self.native.names)[1:]  # after the universe
        self.joints = tuple(name for name in columns if name in group)
        self._factors = np.zeros((len(columns), len(self.joints)))
        self._offsets = np.zeros(len(columns))
        for row, name in enumerate(columns):
            followed = mimics.get(name, Mimic(name))
            self._factors[row, self.joints.index(followed.source)] = followed.multiplier
            self._offsets[row] = followed.offset
        self._plain = len(columns) == len(self.joints)

    def with_others(self, places: Mapping[str, float]) -> Kinematics:
        """Return a copy in which joints outside the group have other positions.

        Args:
            places: Their positions in [rad], by joint. Joints left out keep theirs; joints that
                are not in :attr:`others` are ignored, so a state of the whole robot is accepted.

        Raises:
            CommandError: A position is not finite.
        """
        others = {name: float(places.get(name, place)) for name, place in self.others.items()}
        for name, place in others.items():
            if not math.isfinite(place):
                raise CommandError(f'{name}: its position is {place}; it must be finite')
        if others == self.others:
            return self
        moved = copy.copy(self)
        moved._stand(others)  # noqa: SLF001  # its own copy
        return moved

    def of_joints(self, joints: Sequence[str]) -> Kinematics:
        """Return the kinematics of another set of joints; all others keep their positions."""
        return Kinematics(self._tree, joints).with_others(self.others)

    def expanded(self, positions: Array) -> Array:
        """Return the positions of all columns."""
        if self._plain:
            return positions
        expanded: Array = self._factors @ positions + self._offsets
        return expanded

    def projected(self, columns: Array) -> Array:
        """Convert derivatives from all columns to the joints of the group (..., n)."""
        return columns if self._plain else columns @ self._factors

    def bounded(self, columns: Array) -> Array:
        """Convert non-negative bounds of derivatives from all columns to the group (..., n)."""
        return columns if self._plain else columns @ np.abs(self._factors)

    def link_pose(self, link: str, positions: Array) -> Pose:
        """Return the pose of a link in the root link; too slow for a control cycle."""
        data = self.native.createData()
        pin.forwardKinematics(self.native, data, self.expanded(np.asarray(positions, dtype=float)))
        placement = pin.updateFramePlacement(self.native, data, self.frames[link])
        return Pose(frozen(placement.rotation), frozen(placement.translation))

    def parent_joint(self, link: str) -> int:
        """Return the number of the joint that moves a link; 0 for a fixed link."""
        return int(self.native.frames[self.frames[link]].parentJoint)

    def _stand(self, others: Mapping[str, float]) -> None:
        """Fix the joints outside the group at some positions."""
        full, places = self._full, pin.neutral(self._full)
        self.others = others
        for name, place in others.items():
            places[full.idx_qs[full.getJointId(name)]] = place
        for name, mimic in self.mimics.items():
            if mimic.source in others:
                place = mimic.multiplier * others[mimic.source] + mimic.offset
                places[full.idx_qs[full.getJointId(name)]] = place
        self.native: Native = pin.buildReducedModel(full, self._locked, places)
        self.relative_motion = lru_cache(maxsize=None)(self._relative_motion)
        self.moves = lru_cache(maxsize=None)(self._moves)

    def _moves(self, body: int, other: int) -> bool:
        """Whether the group moves two bodies against each other, given their parent joints."""
        sign = self.relative_motion(body, other).sign
        return bool(self.bounded(np.abs(sign)).any())

    def _relative_motion(self, body: int, other: int) -> RelativeMotion:
        """Return the relative motion of two bodies, given their parent joints.

        The link lengths between a joint and a body bound the distance of any point of the body.
        """
        model = self.native
        # the joints from the body in to the common trunk, and from there out to the other
        above, below = list(model.supports[body]), list(model.supports[other])
        inward = [joint for joint in above if joint not in below][::-1]
        outward = [joint for joint in below if joint not in above]
        sign, rate = np.zeros(model.nv), np.zeros(model.nv)
        turning = np.zeros(model.nv, dtype=bool)
        sign[[joint - 1 for joint in outward]] = 1.0
        sign[[joint - 1 for joint in inward]] = -1.0
        reach = 0.0
        # from the body joint by joint towards the other one
        for joint in (*inward, *outward):
            length = float(np.linalg.norm(model.jointPlacements[joint].translation))
            slides = str(model.joints[joint].shortname()).startswith('JointModelP')
            reach += length * (joint in outward) + (self._travel(joint) if slides else 0.0)
            rate[joint - 1] = 1.0 if slides else reach
            turning[joint - 1] = not slides
            reach += length * (joint in inward)
        return RelativeMotion(sign, rate, turning)

    def _travel(self, joint: int) -> float:
        """Return the greatest travel of a prismatic joint from its zero in [m]."""
        model = self.native
        extremes = np.maximum(np.abs(model.lowerPositionLimit), np.abs(model.upperPositionLimit))
        columns = list(model.names)[1:]
        sources = extremes[[columns.index(name) for name in self.joints]]
        followed = np.abs(self._factors[joint - 1]) @ sources + abs(self._offsets[joint - 1])
        return float(followed)


def _full(tree: KinematicTree) -> Native:
    try:
        model = pin.buildModelFromXML(tree.bare_urdf(CONTINUOUS_BOUND))
    except (RuntimeError, ValueError, ArithmeticError) as error:
        limits = ((joint.name, joint.limit) for joint in tree.joints)
        if lacking := [name for name, limit in limits if limit and 'effort' not in limit]:
            raise ModelError(f'joint {lacking[0]}: <limit> has no effort; write 0') from error
        raise ModelError(f'the robot description makes no kinematic tree: {error}') from error
    for frame in model.frames:  # pinocchio confuses a link and a joint of one name
        if frame.type == pin.FrameType.BODY:
            frame.name = LINK + frame.name
    return model
