# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Model of a robot arm: joints, limits, kinematics, distances."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
import copy
from dataclasses import dataclass
from itertools import combinations
import math
from pathlib import Path
import threading
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from urdf_reader import EndEffector, find_group, KinematicTree, Pair, parse_srdf, read_urdf

from .arrays import Array, frozen, Native, Pose, turned_twists
from .exceptions import CommandError, description_refused, limits_refused, ModelError, SceneError
from .kinematics import Kinematics
from .limits import JointLimits, load_limits, merge_limits
from .scene.clearances import Clearances, Proximity
from .scene.links import link_shapes, with_default_collisions
from .scene.objects import AllowedCollisionMatrix
from .scene.planning_scene import PlanningScene

MIN_REACH = 0.01  # reach of a group that is shorter, such as a finger that slides, in [m]


class _Thread(threading.local):
    """Latest results of one thread in a scene."""

    def __init__(self, scene: PlanningScene) -> None:
        self.data: Native = scene.kinematics.native.createData()
        self.at = b''  # the positions of that
        self.clearances = Clearances(scene)


class RobotModel:
    """An arm: a group of joints, in a chain or a tree, with a base and a tip link.

    Poses and Jacobians are expressed in the base link; twists and Jacobian rows are linear before
    angular, taken at the origin of the tip. Positions are plain angles, also of continuous joints.
    Thread-safe: each thread has its own cache of the last position and distances.

    Attributes:
        poses: Named poses of the SRDF, in the order of the joints.
        world_frames: Frames to which a fixed virtual joint of the SRDF attaches the root link.
        end_effectors: End effectors of the SRDF that are fixed to a link of the group.
        notes: Warnings about ignored parts of URDF and SRDF.
        notes_beside_contact: Warnings except those about pairs of links in contact.
        kinematics: The joints of the group and their mimic joints; thread-safe.
        allowed: Collisions allowed by the SRDF, and between links always in contact.
        moved_by_others: Pairs of links that other groups move against each other, by group;
            :attr:`scene` does not check them.
        scene: Scene in which distances are measured, at first the robot alone; thread-safe.
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
        *,
        folder: Path | None = None,
        moved_by_others: Mapping[str, Collection[str]] | None = None,
    ) -> None:
        """Build and check the arm.

        Args:
            group: The group; by default the only SRDF group that is not an end effector.
            tip: The tip link; by default the end of the group's chain.
            moved_by_others: Joints that other groups move, by group. Links that they move against
                each other are not checked until a scene provides their positions.

        Raises:
            ModelError: URDF, SRDF and limits contradict; the message names what to correct.
        """
        tree, semantic = read_urdf(urdf), parse_srdf(srdf)
        chosen = find_group(tree, semantic, group, tip)
        self.name, self.group = tree.name, chosen.name
        self.base, self.tip = chosen.base, chosen.tip
        self.world_frames = semantic.world_frames
        self._tree = tree
        self.kinematics = Kinematics(tree, chosen.joints)
        self._model = self.kinematics.native
        self.end_effectors: Sequence[EndEffector] = tuple(
            each
            for each in semantic.end_effectors
            if each.parent_group in {'', chosen.name}
            and each.parent_link in self.kinematics.frames
            and self.kinematics.parent_joint(each.parent_link)
        )
        shapes = link_shapes(tree, folder)
        notes = list(shapes.notes)
        self.limits: JointLimits = merge_limits(self.kinematics.joints, tree, limits, notes)
        self.poses = _poses(self.limits, semantic.poses.get(chosen.name, {}), notes)
        self._tip_frame = self.kinematics.frames[self.tip]
        self._base_frame = self.kinematics.frames[self.base]
        if self._model.frames[self._base_frame].parentJoint:
            raise ModelError(f'group {self.group}: its base link {self.base!r} is moved by it')
        allowed, contact_notes = AllowedCollisionMatrix.of_srdf(semantic), list[str]()
        self.scene = with_default_collisions(
            PlanningScene(self.kinematics, shapes.by_link, allowed),
            tree,
            self.limits.lower,
            self.limits.upper,
            contact_notes,
        )
        self.notes_beside_contact = tuple(notes)
        notes += contact_notes
        self.allowed = self.scene.allowed
        self.moved_by_others: Mapping[str, frozenset[Pair]] = {
            other: frozenset(_moved_by(self._tree, self.scene.link_shapes, joints))
            for other, joints in (moved_by_others or {}).items()
        }
        if self.moved_by_others:
            unknown = frozenset().union(*self.moved_by_others.values())
            self.scene = self.scene.with_allowed(self.allowed.with_entries(unknown, True))
        self.notes = tuple(notes)
        self._thread = _Thread(self.scene)
        self.reach = self._reach()

    @classmethod
    def from_files(
        cls,
        urdf: Path | str,
        srdf: Path | str,
        limits: Path | str,
        group: str | None = None,
        tip: str | None = None,
    ) -> RobotModel:
        """Build an arm from its files; relative mesh names start at the URDF's folder.

        Args:
            limits: Joint limits file in the format of MoveIt's joint_limits.yaml.

        Raises:
            ModelError: A file cannot be read, or the files contradict each other.
        """
        table, folder = load_limits(limits), Path(urdf).parent
        texts = _text(Path(urdf), read_urdf), _text(Path(srdf), parse_srdf)
        with limits_refused(limits):
            return cls(*texts, table, group, tip, folder=folder)

    def __len__(self) -> int:
        """Return the number of joints."""
        return len(self.limits)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return self.limits.names

    @property
    def serial(self) -> bool:
        """Whether all joints are on one chain that ends in the tip."""
        trunk = {self._model.names[joint] for joint in self._trunk()}
        return trunk.issuperset(self.joints)

    @property
    def pairs(self) -> Sequence[tuple[str, str]]:
        """Links of each pair of shapes checked for collisions."""
        return self.scene.pairs

    def assumption(self, known: Collection[str] = ()) -> str:
        """Describe the assumed positions of joints outside the group that affect checked links.

        Args:
            known: Joints whose positions are known.

        Returns:
            A sentence; empty if there is no such joint, so that distances are exact.
        """
        checked = set(map(frozenset, self.pairs))
        moved: dict[str, list[str]] = {}  # what moves with each joint beside the group
        for joint in self._tree.movable():
            source = joint.name if joint.mimic is None else joint.mimic.source
            if source not in self.joints and source not in known:
                moved.setdefault(source, []).append(joint.name)
        assumed = [
            f'{name} at {self.kinematics.others[name]:g}'
            for name, joints in moved.items()
            if not checked.isdisjoint(_moved_by(self._tree, self.scene.link_shapes, joints))
        ]
        if not assumed:
            return ''
        return (
            f'group {self.group}: collisions are checked with {", ".join(assumed)}, wherever that'
            ' really is; keep it there, or leave room'
        )

    @property
    def frames(self) -> Sequence[str]:
        """Names of the links that :meth:`pose` accepts."""
        return tuple(self.kinematics.frames)

    def pose(self, positions: Array, link: str | None = None) -> Pose:
        """Return the pose of a link in the base link.

        Args:
            link: Name of the link; by default the tip.

        Raises:
            CommandError: There is no such link.
        """
        self.check_link(link)
        frame = self._tip_frame if link is None else self.kinematics.frames[link]
        self._update(positions)
        placement = self._placement(self._base_frame).actInv(self._placement(frame))
        return Pose(placement.rotation.copy(), placement.translation.copy())

    def jacobian(self, positions: Array) -> Array:
        """Return the Jacobian of the tip (6, n), expressed in the base link."""
        self._update(positions)
        world = pin.getFrameJacobian(
            self._model, self._thread.data, self._tip_frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        rotation = self._placement(self._base_frame).rotation
        return turned_twists(rotation, self.kinematics.projected(world))

    def lowest(self, positions: Array) -> float:
        """Return the lowest z of any joint or the tip in the base link in [m]."""
        self._update(positions)
        base = self._placement(self._base_frame)
        places = [self._thread.data.oMi[joint].translation for joint in self._trunk()]
        places.append(self._placement(self._tip_frame).translation)
        return float(min(base.actInv(place)[2] for place in places))

    def nearest(self, positions: Array, within: float, count: int) -> list[Proximity]:
        """Return the nearest pairs of shapes with the gradients of their distances."""
        return self.clearances.nearest(positions, within, count)

    def clearance(self, positions: Array, within: float = math.inf) -> float:
        """Return the least distance between two shapes in [m]; infinity when none are checked.

        Distances beyond ``within`` may be lower bounds.
        """
        distances = self.clearances.least(positions, within)
        return float(distances.min(initial=math.inf))

    def use_scene(self, clearances: Clearances) -> None:
        """Measure all distances in another scene from now on; call it in the control loop.

        Args:
            clearances: Clearances of a scene with this model's kinematics. Query it once outside
                the loop before, because the first query measures every pair.

        Raises:
            SceneError: The scene is of another group or robot.
        """
        self.check_scene(clearances.scene)
        self.scene, self._thread.clearances = clearances.scene, clearances

    def check_scene(self, scene: PlanningScene) -> None:
        """Refuse a scene of another group or robot with a SceneError."""
        if scene.kinematics.joints != self.joints:
            joints = ', '.join(scene.kinematics.joints)
            raise SceneError(f'the scene is not that of {self.group}: its joints are {joints}')

    def check_link(self, link: str | None) -> None:
        """Refuse an unknown link with a CommandError; None is the tip."""
        if link is not None and link not in self.kinematics.frames:
            known = ', '.join(self.frames)
            raise CommandError(f'there is no link {link!r} in {self.name}; links: {known}')

    def index(self, joint: str) -> int:
        """Return the index of a joint, or raise a CommandError."""
        if joint not in self.limits.names:
            known = ', '.join(self.limits.names)
            raise CommandError(f'there is no joint {joint!r} in {self.group}; joints: {known}')
        return self.limits.names.index(joint)

    def with_others(self, places: Mapping[str, float]) -> RobotModel:
        """Return a copy in which joints outside the group have other positions, also in the scene.

        Args:
            places: Their positions in [rad], by joint. Joints left out keep theirs; joints of the
                group are ignored, so a state of the whole robot is accepted.

        Raises:
            CommandError: A position is not finite.
        """
        kinematics = self.kinematics.with_others(places)
        if kinematics is self.kinematics:
            return self
        moved = copy.copy(self)
        moved.kinematics, moved.scene = kinematics, self.scene.with_others(kinematics)
        # of its own copy
        moved._model, moved._thread = kinematics.native, _Thread(moved.scene)  # noqa: SLF001
        return moved

    @property
    def clearances(self) -> Clearances:
        """Clearances of the present scene for this thread."""
        thread = self._thread
        if thread.clearances.scene is not self.scene:
            thread.clearances = Clearances(self.scene)
        return thread.clearances

    def _update(self, positions: Array) -> None:
        thread, at = self._thread, positions.tobytes()
        if at == thread.at:
            return
        expanded = self.kinematics.expanded(positions)
        pin.computeJointJacobians(self._model, thread.data, expanded)
        thread.at = at

    def _placement(self, frame: int) -> Native:
        return pin.updateFramePlacement(self._model, self._thread.data, frame)

    def _trunk(self) -> list[int]:
        """Return the joints that move the tip, from the base out."""
        return list(self._model.supports[self._model.frames[self._tip_frame].parentJoint])[1:]

    def _reach(self) -> float:
        """Sum the distances from joint to joint out to the tip."""
        lengths = [
            np.linalg.norm(self._model.jointPlacements[joint].translation)
            for joint in self._trunk()[1:]
        ]
        tip = self._model.frames[self._tip_frame].placement.translation
        return max(float(sum(lengths) + np.linalg.norm(tip)), MIN_REACH)


def _moved_by(
    tree: KinematicTree, links: Iterable[str], joints: Collection[str]
) -> Iterator[Pair]:
    """Return the pairs of links that the given joints move against each other."""
    above = {
        link: {joint.name for joint in tree.chain(tree.root, link)} & set(joints) for link in links
    }
    for first, second in combinations(above, 2):
        if above[first] != above[second]:
            yield frozenset((first, second))


def _poses(
    limits: JointLimits, poses: Mapping[str, Mapping[str, float]], notes: list[str]
) -> Mapping[str, Array]:
    """Return the named poses within limits; add a note for each other one."""
    found: dict[str, Array] = {}
    for name, pose in poses.items():
        if missing := [joint for joint in limits.names if joint not in pose]:
            other = ', '.join(sorted(set(pose) - set(limits.names)))
            has = f' ({other} is none of them)' if other else ''
            if len(missing) == len(limits.names):
                notes.append(f'pose {name!r} of the SRDF has no joint of the group{has}; left out')
                continue
            notes.append(
                f'pose {name!r} of the SRDF leaves {", ".join(missing)} where they are{has}: it is'
                ' a goal for clients, and no pose to start from'
            )
            continue
        values = frozen([pose[joint] for joint in limits.names])
        outside = (values < limits.lower) | (values > limits.upper)
        if outside.any():
            joint = limits.names[int(np.argmax(outside))]
            notes.append(f'pose {name!r} of the SRDF: {joint} is beyond its limits; left out')
            continue
        found[name] = values
    return found


def _text(path: Path, read: Callable[[str], object]) -> str:
    """Read a text file, or raise an error with its name."""
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f'{path}: {error}') from error
    with description_refused(str(path)):
        read(text)
    return text


FOLDER = Path(__file__).with_name('panda')


@dataclass(frozen=True, slots=True)
class ArmNames:
    """Names of the parts of an arm; unknown ones are empty."""

    joints: tuple[str, ...] = ()  # the joints, from the base to the tool
    base: str = ''  # the base link
    tool: str = ''  # the tool link


@description_refused()
def names_of(urdf: str, srdf: str = '', group: str = '', tip: str = '') -> ArmNames:
    """Find the names of an arm.

    Args:
        srdf: Semantic description as XML text; without it, the arm is the longest chain.
        tip: The tool link; by default the end of the chain.

    Raises:
        ModelError: A text cannot be read, or there is no such group or chain.
    """
    tree = read_urdf(urdf)
    semantic = parse_srdf(srdf) if srdf else None
    if semantic is not None and semantic.groups:
        first = next(iter(semantic.arms), next(iter(semantic.groups)))
        found = find_group(tree, semantic, group or first, tip or None)
        return ArmNames(found.joints, found.base, found.tip)
    links = [tree.root, *(joint.child for joint in tree.joints)]
    end = tip or max(links, key=lambda link: len(_moving(tree, link)))
    return ArmNames(tuple(_moving(tree, end)), tree.root, end)


def _moving(tree: KinematicTree, end: str) -> list[str]:
    return [joint.name for joint in tree.chain(tree.root, end) if joint.independent]


class ArmFiles(NamedTuple):
    """The files of an arm, in the order of :meth:`.RobotModel.from_files`."""

    urdf: Path  # the description
    srdf: Path  # groups, named poses, pairs of links that may touch
    limits: Path  # limits of the joints, in the format of MoveIt's joint_limits.yaml


def example_files() -> ArmFiles:
    """Return the files of a Franka Emika Panda: 7 joints, a hand, capsules for its links."""
    return ArmFiles(FOLDER / 'panda.urdf', FOLDER / 'panda.srdf', FOLDER / 'limits.yaml')
