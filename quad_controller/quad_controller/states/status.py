# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be reported of the controller."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from quad_description import Targets

from ..gait.schedule import Gait
from ..gait.velocity import Velocity
from ..policy.interface import Policy, PolicyStep
from .modes import State
from .motion import Situation


@dataclass(frozen=True, slots=True)
class Status:
    """The controller at one moment.

    Attributes:
        state: What it is doing.
        title: Its name, with the way to it as long as it stands up or lies down.
        goal: What it is on the way to.
        gait: The gait.
        velocity: Velocity that the gait walks.
        faults: Latched faults with their reasons.
        warnings: What is not right but no fault.
        joints_age: Time since the joint states in [s].
        imu_age: Time since the attitude in [s].
        battery: Charge 0 to 1, None when it is not known.
        refused: Samples and commands that could not be used.
        limited: Targets of single joints that were too fast and were cut.
        unreachable: Steps in which a leg did not reach its target.
        policy: Name of the policy that is loaded; empty for none.
    """

    state: State
    title: str
    goal: State
    gait: Gait
    velocity: Velocity
    faults: tuple[str, ...]
    warnings: tuple[str, ...]
    joints_age: float
    imu_age: float
    battery: float | None
    refused: int
    limited: int
    unreachable: int
    policy: str = ''


class EventKind(Enum):
    """How an event is to be reported."""

    NEWS = 'news'
    WARNING = 'warning'
    TROUBLE = 'trouble'
    REPEATED = 'repeated'  # trouble of every step: reported now and then only


@dataclass(frozen=True, slots=True)
class Event:
    """Something that people should know.

    Attributes:
        kind: How it is to be reported.
        text: What happened, and the remedy if there is one.
    """

    kind: EventKind
    text: str


@dataclass(frozen=True, slots=True)
class Asked:
    """A policy that was asked in a step.

    Attributes:
        policy: Which one.
        answer: What it answered.
        step: How often it was stepped since its reset; 1 for the first time.
    """

    policy: Policy
    answer: PolicyStep
    step: int


@dataclass(frozen=True, slots=True)
class Output:
    """What one step gives.

    Attributes:
        targets: Positions of all joints in [rad]; None as long as no joint state was received.
        shadow: What the policy would do, in a dry run; None otherwise.
        title: Name of the state, with the way to it.
        ready: Whether all measurements were received once that walking needs.
        events: News.
        situation: What the motion knew; None when nothing moved.
        asked: The policy that was asked, followed or watched; None for none.
    """

    targets: Targets | None
    shadow: Targets | None
    title: str
    ready: bool
    events: tuple[Event, ...]
    situation: Situation | None = None
    asked: Asked | None = None
