# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot arm as the motion core sees it: joints, limits, kinematics, distances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any

import numpy as np
import pinocchio as pin
from urdf_reader import Group, parse_srdf, SemanticDescription

from .arrays import Array, frozen, Native
from .clearances import Clearances, LeastClearance, Proximity
from .description import Description
from .exceptions import CommandError, description_refused, ModelError
from .limits import JointLimits, merge_limits
from .pose import Pose, turned_twists
from .scene import PlanningScene


class RobotModel:
    """An arm: a group of joints, in a chain or a tree, with a base and a tip link.

    Poses and Jacobians are expressed in the base link; twists and Jacobian rows are linear before
    angular, taken at the origin of the tip. Positions are plain angles, also of continuous joints.
    It caches the kinematics of the last position, so it belongs to one loop.

    Attributes:
        name: Name of the robot.
        group: Name of the group.
        base: Name of its base link.
        tip: Name of its tip link.
        limits: Limits of the joints, with their names.
        poses: Named poses of the SRDF, in the order of the joints.
        notes: What was passed over in description and SRDF, in words.
        scene: The shapes and the pairs of them that are checked; for any thread.
        reach: Greatest distance of the tip from the first joint's axis frame in [m].
    """

    @description_refused()
    def __init__(
        self,
        urdf: str,
        srdf: str,
        limits: Mapping[str, Any],
        group: str | None = None,
        tip: str | None = None,
    ) -> None:
        """Build and check the arm.

        Args:
            urdf: Robot description as XML text.
            srdf: Semantic description as XML text.
            limits: The table ``joint_limits`` of a limits file.
            group: The group; by default the only one of the SRDF.
            tip: The tip link; by default the end of the group's chain.

        Raises:
            ModelError: The three do not fit together; the message names what to mend.
        """
        description, semantic = Description(urdf), parse_srdf(srdf)
        chosen = semantic.group(group if group is not None else _only(semantic))
        names = description.group_joints(chosen, semantic)
        self.name, self.group = description.name, chosen.name
        self._model = _reduced(description, names)
        self.base, self.tip = _ends(description, chosen, semantic, names, tip)
        ordered = list(self._model.names)[1:]  # after the universe; of a chain, from the base out
        notes = list(description.notes)
        self.limits: JointLimits = merge_limits(ordered, description.joints, limits, notes)
        self.poses = _poses(self.limits, semantic.poses.get(chosen.name, {}), notes)
        self.notes = tuple(notes)
        self._data = self._model.createData()
        self._tip_frame = self._model.getFrameId(self.tip)
        self._base_frame = self._model.getFrameId(self.base)
        if self._model.frames[self._base_frame].parentJoint:
            raise ModelError(f'group {self.group}: its base link {self.base!r} is moved by it')
        self._at = b''  # positions of the kinematics that are cached
        self.scene = PlanningScene(self._model, description.shapes, semantic.checks)
        self._clearances = Clearances(self.scene)
        self.reach = self._reach()

    def __len__(self) -> int:
        """Return the number of joints."""
        return len(self.limits)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return self.limits.names

    @property
    def serial(self) -> bool:
        """Whether all joints are on one chain, which ends in the tip."""
        return len(self._trunk()) == len(self)

    @property
    def pairs(self) -> Sequence[tuple[str, str]]:
        """Links of each pair of shapes that is checked for collision."""
        return self.scene.pairs

    @property
    def frames(self) -> Sequence[str]:
        """Names of the links that can be asked for."""
        return [f.name for f in self._model.frames if f.type == pin.FrameType.BODY]

    def pose(self, positions: Array, link: str | None = None) -> Pose:
        """Return the pose of a link in the base link.

        Args:
            positions: Joint positions in [rad].
            link: Name of the link; by default the tip.

        Raises:
            CommandError: There is no such link.
        """
        self._update(positions)
        base = self._placement(self._base_frame)
        placement = base.actInv(self._placement(self._frame(link)))
        return Pose(placement.rotation.copy(), placement.translation.copy())

    def jacobian(self, positions: Array) -> Array:
        """Return the Jacobian of the tip (6, n), expressed in the base link.

        Args:
            positions: Joint positions in [rad].
        """
        self._update(positions)
        world = pin.getFrameJacobian(
            self._model, self._data, self._tip_frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        rotation = self._placement(self._base_frame).rotation
        return turned_twists(rotation, world)

    def nearest(self, positions: Array, within: float, count: int) -> list[Proximity]:
        """Return the nearest pairs of shapes with the gradients of their distances.

        Args:
            positions: Joint positions in [rad].
            within: Greatest distance of interest in [m].
            count: How many pairs at most.
        """
        return self._clearances.nearest(positions, within, count)

    def clearance(self, positions: Array, within: float = math.inf) -> float:
        """Return the least distance between two shapes in [m]; infinity when none are checked.

        Args:
            positions: Joint positions in [rad].
            within: Distance of interest in [m]; where it is more, a lower bound is good enough.
        """
        distances = self._clearances.least(positions, within)
        return float(distances.min(initial=math.inf))

    def least_clearance(self, places: Array, within: float) -> LeastClearance:
        """Return the two links that come nearest to each other at any of some places.

        Args:
            places: Joint positions in [rad] (m, n).
            within: Distance of interest in [m]; where it is more, a lower bound is good enough.
        """
        least = LeastClearance(within)
        for positions in places[self._clearances.provably_clear(places, within) :]:
            distances = self._clearances.least(positions, within)
            pair = int(distances.argmin())
            if distances[pair] < least.distance:
                least = LeastClearance(float(distances[pair]), self.pairs[pair])
        return least

    def stays_apart(self, lower: Array, upper: Array, within: float) -> bool:
        """Whether no shapes are as near at any positions between bounds, as far as is known.

        Args:
            lower: Least joint positions in [rad].
            upper: Greatest joint positions in [rad].
            within: The distance of interest in [m].
        """
        return self._clearances.apart(lower, upper, within)

    def clearances(self) -> Clearances:
        """Return what measures distances for another thread than the owner's."""
        return Clearances(self.scene)

    def check_link(self, link: str | None) -> None:
        """Make sure that a link can be asked for.

        Args:
            link: Its name; None is the tip.

        Raises:
            CommandError: There is no such link.
        """
        if link is not None and not self._model.existFrame(link, pin.FrameType.BODY):
            known = ', '.join(self.frames)
            raise CommandError(f'there is no link {link!r} in {self.name}; links: {known}')

    def index(self, joint: str) -> int:
        """Return the place of a joint.

        Raises:
            CommandError: The arm has no such joint.
        """
        if joint not in self.limits.names:
            known = ', '.join(self.limits.names)
            raise CommandError(f'there is no joint {joint!r} in {self.group}; joints: {known}')
        return self.limits.names.index(joint)

    def _update(self, positions: Array) -> None:
        at = positions.tobytes()
        if at == self._at:
            return
        pin.computeJointJacobians(self._model, self._data, positions)
        self._at = at

    def _placement(self, frame: int) -> Native:
        return pin.updateFramePlacement(self._model, self._data, frame)

    def _frame(self, link: str | None) -> int:
        self.check_link(link)
        return int(self._tip_frame if link is None else self._model.getFrameId(link))

    def _trunk(self) -> list[int]:
        """Return the joints that move the tip, from the base out."""
        return list(self._model.supports[self._model.frames[self._tip_frame].parentJoint])[1:]

    def _reach(self) -> float:
        """Sum the lengths from joint to joint out to the tip."""
        lengths = [
            np.linalg.norm(self._model.jointPlacements[joint].translation)
            for joint in self._trunk()[1:]
        ]
        tip = self._model.frames[self._tip_frame].placement.translation
        return float(sum(lengths) + np.linalg.norm(tip))


def _only(semantic: SemanticDescription) -> str:
    if len(semantic.groups) != 1:
        known = ', '.join(semantic.groups) or 'none'
        raise ModelError(f'the SRDF has the groups {known}: choose one (parameter group)')
    return next(iter(semantic.groups))


def _ends(
    description: Description,
    group: Group,
    semantic: SemanticDescription,
    joints: Sequence[str],
    tip: str | None,
) -> tuple[str, str]:
    """Return the base link and the tip link of a group."""
    chains = list(group.chains)
    for name in group.subgroups:
        chains += semantic.group(name).chains
    end = tip or (chains[-1][1] if chains else description.joints[joints[-1]].child)
    tree = description.tree
    inward = {tree.root, *(joint.parent for joint in tree.chain(tree.root, end))}
    bases = [base for base, _ in chains] or [description.joints[joints[0]].parent]
    base = next((link for link in bases if link in inward), bases[0])
    moving = [joint for joint in tree.chain(tree.root, base) if joint.name in joints]
    base = moving[0].parent if moving else base  # a lift below the chain of the arm
    tree.chain(base, end)  # or says why not
    return base, end


def _poses(
    limits: JointLimits, poses: Mapping[str, Mapping[str, float]], notes: list[str]
) -> Mapping[str, Array]:
    """Return the poses that the arm can take; the others are noted."""
    found: dict[str, Array] = {}
    for name, pose in poses.items():
        if missing := [joint for joint in limits.names if joint not in pose]:
            other = ', '.join(sorted(set(pose) - set(limits.names)))
            has = f', and has {other}, which the group has not' if other else ''
            notes.append(f'pose {name!r} of the SRDF lacks joint {missing[0]}{has}; left out')
            continue
        values = frozen([pose[joint] for joint in limits.names])
        outside = (values < limits.lower) | (values > limits.upper)
        if outside.any():
            joint = limits.names[int(np.argmax(outside))]
            notes.append(f'pose {name!r} of the SRDF: {joint} is beyond its limits; left out')
            continue
        found[name] = values
    return found


def _reduced(description: Description, joints: Sequence[str]) -> Native:
    """Build the kinematics, all joints but the group's locked at the middle or zero."""
    try:
        model = pin.buildModelFromXML(description.xml)
    except (RuntimeError, ValueError, ArithmeticError) as error:
        raise ModelError(f'the robot description makes no kinematic tree: {error}') from error
    rest = pin.neutral(model)
    rest = np.clip(rest, model.lowerPositionLimit, model.upperPositionLimit)
    locked = [number for number in range(1, model.njoints) if model.names[number] not in joints]
    return pin.buildReducedModel(model, locked, rest)
