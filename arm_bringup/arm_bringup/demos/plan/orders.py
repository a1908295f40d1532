# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo asks move_group for, what comes back, and what it needs of its client."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from arm_model import AttachedBody, CollisionObject, Pose

from ..scenario import DriveClient
from .observer import Observer

SUCCESS, BLOCKED, UNKNOWN_STATE = 'SUCCESS', 'GOAL_IN_COLLISION', 'ROBOT_STATE_STALE'
"""Codes of MoveIt that the demo expects."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionOrder:
    """A motion that is asked for: to joint positions, or to a pose of the tip.

    Attributes:
        group: The group that moves.
        joints: Where its joints are to be in [rad] or [m]; empty for the pose.
        link: The link that is to be at the pose.
        pose: The pose in the root link.
        planner_id: The planner by MoveIt's name; empty for the default.
        speed: Factor of the limits of velocity and acceleration.
        replan: Plan anew where the scene changes during the execution.
    """

    group: str
    joints: Mapping[str, float] = field(default_factory=dict)
    link: str = ''
    pose: Pose | None = None
    planner_id: str = ''
    speed: float = 0.4
    replan: bool = False


@dataclass(frozen=True, slots=True)
class MotionEnd:
    """How a motion ended, as move_group says.

    Attributes:
        code: MoveIt's code by its name.
        message: Why.
        planning_time: Time of the last planning in [s].
        plans: How often it was planned.
    """

    code: str
    message: str
    planning_time: float
    plans: int


@dataclass(frozen=True, slots=True, eq=False)
class DisplayedPath:
    """A path of /display_planned_path.

    Attributes:
        robot: Name of the robot's model.
        start: Where all joints are as it begins in [rad] or [m].
        joints: Names of the joints that move.
        rows: Their positions in [rad] or [m], of one point after the other.
    """

    robot: str
    start: Mapping[str, float]
    joints: Sequence[str]
    rows: Sequence[Sequence[float]]

    @property
    def ghost(self) -> Mapping[str, float]:
        """Where its joints are at its end in [rad] or [m]."""
        return dict(zip(self.joints, self.rows[-1], strict=True)) if self.rows else {}


@dataclass(frozen=True, slots=True, eq=False)
class DisplayedScene:
    """What /monitored_planning_scene had last.

    Attributes:
        objects: Poses of the objects of the world in the root link.
        attached: Link of each attached body.
        joints: Where the joints are in [rad] or [m].
    """

    objects: Mapping[str, Pose] = field(default_factory=dict)
    attached: Mapping[str, str] = field(default_factory=dict)
    joints: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SceneChange:
    """A change of the scene, made as a whole.

    Attributes:
        add: Objects that come into the world.
        remove: Names of objects that leave it.
        attach: An object of the world that a link takes up.
        detach: An attached body that is put down where it is.
    """

    add: Sequence[CollisionObject] = ()
    remove: Sequence[str] = ()
    attach: AttachedBody | None = None
    detach: AttachedBody | None = None


class MotionRun(Protocol):
    """A motion on its way."""

    @property
    def executing(self) -> bool:
        """Whether it is planned, and begins."""

    @property
    def done(self) -> bool:
        """Whether it has ended."""

    def cancel(self) -> None:
        """Ask for its end."""

    def end(self) -> MotionEnd:
        """Return how it ended; once it is done."""


class PlanningClient(DriveClient, Protocol):
    """What the demo needs of ROS; :class:`.client.PlanClient` is the real one."""

    @property
    def observer(self) -> Observer:
        """Who measures at the joint states that come."""

    @property
    def paths(self) -> Sequence[DisplayedPath]:
        """All of /display_planned_path so far."""

    @property
    def scene(self) -> DisplayedScene:
        """The last of /monitored_planning_scene."""

    def change(self, change: SceneChange) -> None:
        """Change the scene."""

    def ik(
        self, group: str, link: str, pose: Pose, seed: Mapping[str, float], *, free: bool
    ) -> Mapping[str, float]:
        """Return joint positions for a pose of a link."""

    def send(self, order: MotionOrder) -> MotionRun:
        """Send a goal to move_action."""

    def grip(self, controller: str, position: float) -> None:
        """Move a gripper, and wait until it is there."""

    def show(self, words: str, planning_time: float) -> None:
        """Have something shown beside the drives."""
