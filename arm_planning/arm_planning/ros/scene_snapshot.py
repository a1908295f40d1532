# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The planning scene that clients share: what may collide, and what else messages say of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from arm_model import Array, combined, ORIGIN, PlanningScene, Pose

from ..exceptions import PlanningCode, PlanningError

MIN_FULLNESS = 0.9  # share of its hull that a mesh fills at least without a note


@dataclass(frozen=True, slots=True, eq=False)
class ObjectDetails:
    """What collisions do not need of an object."""

    type_key: str = ''  # key of its type in a database
    type_db: str = ''  # which database
    subframes: Mapping[str, Pose] = field(default_factory=dict)  # poses in the object, by name
    # its shape_msgs/Mesh, in the order of its hulls; None for that of a prism
    meshes: Sequence[Any] = ()
    fullness: float = 1.0  # volume of its meshes as a share of that of their hulls, which count


@dataclass(frozen=True, slots=True, eq=False)
class AttachedDetails:
    """What collisions do not need of an attached body."""

    detach_posture: Any  # the trajectory_msgs/JointTrajectory that lets it go
    weight: float  # its weight in [kg]


OuterFrames = Callable[[str, Array], Pose]
"""Returns where a frame that neither robot nor scene has is in the root link, by its name and the
positions of all joints; raises PlanningError."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneSnapshot:
    """One state of the scene; immutable."""

    scene: PlanningScene  # what may collide: all joints of the robot move
    name: str = ''  # its name
    # of objects of the world and attached ones, by name
    details: Mapping[str, ObjectDetails] = field(default_factory=dict)
    # of attached bodies, by name
    attached_details: Mapping[str, AttachedDetails] = field(default_factory=dict)
    # red, green, blue and opacity, by object
    colors: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    # frames that clients named, in the root link
    fixed_frames: Mapping[str, Pose] = field(default_factory=dict)
    octomap: Any = None  # the octomap_msgs/OctomapWithPose in the root link; None for none
    world_frames: Sequence[str] = ()  # names of the world in which the root link stands
    outer_frames: OuterFrames | None = None  # frames of others, such as those of TF; None for none

    @property
    def root(self) -> str:
        """The link in which objects of the world are."""
        return self.scene.kinematics.root

    @property
    def notes(self) -> Sequence[str]:
        """Warnings about objects that count as larger than they are."""
        return [
            f'object {name!r} counts as the convex hull of its mesh, of which it fills'
            f' {100.0 * each.fullness:.0f} %; give it several meshes of convex parts where that'
            ' refuses too much'
            for name, each in self.details.items()
            if each.fullness < MIN_FULLNESS
        ]

    def link_of(self, frame: str) -> tuple[str, Pose]:
        """Return the link that carries a frame, and where the frame is in it.

        Args:
            frame: A link, an object or attached body, a subframe of one as ``object/subframe``,
                or a frame that was named; empty for the root link.

        Raises:
            PlanningError: It is unknown.
        """
        name = frame.removeprefix('/')
        if name in self.scene.kinematics.frames:
            return name, ORIGIN
        if not name or name in self.world_frames:
            return self.root, ORIGIN
        if name in self.fixed_frames:
            return self.root, self.fixed_frames[name]
        thing, separator, subframe = name.partition('/')
        found = self._thing(thing)
        if found is None or (separator and subframe not in self.details[thing].subframes):
            raise PlanningError(
                PlanningCode.FRAME_TRANSFORM_FAILURE,
                f'Unknown frame: {frame!r}; it must be a link, an object or object/subframe;'
                f' objects: {", ".join(self.details) or "none"}',
            )
        link, pose = found
        return link, combined(pose, self.details[thing].subframes[subframe]) if separator else pose

    def frame(self, frame: str, positions: Array) -> Pose:
        """Return where a frame is in the root link.

        Args:
            frame: As of :meth:`link_of`, or a frame of others.
            positions: Positions of all joints of the robot in [rad].

        Raises:
            PlanningError: It is unknown.
        """
        try:
            link, pose = self.link_of(frame)
        except PlanningError:
            if self.outer_frames is None:
                raise
            return self.outer_frames(frame.removeprefix('/'), positions)
        if link == self.root:
            return pose
        return combined(self.scene.kinematics.link_pose(link, positions), pose)

    def _thing(self, name: str) -> tuple[str, Pose] | None:
        if name in self.scene.objects:
            return self.root, self.scene.objects[name].pose
        if name in self.scene.attached_bodies:
            body = self.scene.attached_bodies[name]
            return body.link, body.object.pose
        return None
