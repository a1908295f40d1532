# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be reported of the controller."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from quad_description import Targets

from ..gait.schedule import Gait
from ..gait.velocity import Velocity
from ..policy.observation import Situation
from ..policy.runner import PolicyRunner, PolicyStep
from .modes import State


@dataclass(frozen=True, slots=True)
class Status:
    """The controller at one moment."""

    state: State  # what it is doing
    title: str  # its name, with the way to it as long as it stands up or lies down
    goal: State  # what it is on the way to
    gait: Gait  # the gait
    velocity: Velocity  # velocity that the gait walks
    faults: tuple[str, ...]  # latched faults with their reasons
    warnings: tuple[str, ...]  # what is not right but no fault
    joints_age: float  # time since the joint states in [s]
    imu_age: float  # time since the attitude in [s]
    battery: float | None  # charge 0 to 1, None when it is not known
    refused: int  # samples and commands that could not be used
    limited: int  # targets of single joints that were too fast and were cut
    unreachable: int  # steps in which a leg did not reach its target
    policy: str = ''  # name of the policy that is loaded; empty for none


class EventKind(Enum):
    """How an event is to be reported."""

    NEWS = 'news'
    WARNING = 'warning'
    TROUBLE = 'trouble'
    REPEATED = 'repeated'  # trouble of every step: reported now and then only


@dataclass(frozen=True, slots=True)
class Event:
    """Something that people should know."""

    kind: EventKind  # how it is to be reported
    text: str  # what happened, and the remedy if there is one


@dataclass(frozen=True, slots=True)
class Asked:
    """A policy that was asked in a step."""

    policy: PolicyRunner  # which one
    answer: PolicyStep  # what it answered
    step: int  # how often it was stepped since its reset; 1 for the first time


@dataclass(frozen=True, slots=True)
class Output:
    """What one step gives."""

    # positions of all joints in [rad]; None as long as no joint state was received
    targets: Targets | None
    shadow: Targets | None  # what the policy would do, in a dry run; None otherwise
    title: str  # name of the state, with the way to it
    ready: bool  # whether all measurements were received once that walking needs
    events: tuple[Event, ...]
    situation: Situation | None = None  # what the motion knew; None when nothing moved
    asked: Asked | None = None  # the policy that was asked, followed or watched; None for none


class Notices:
    """Compares what is the matter now with what was the matter in the step before."""

    def __init__(self) -> None:
        self._present: set[str] = set()

    def step(self, present: dict[str, str], over: dict[str, str]) -> Iterator[Event]:
        """Yield what has changed.

        Args:
            present: What is the matter, by a name for it.
            over: What to say when it is no longer, by the same names; nothing where there is none.
        """
        for name, text in present.items():
            if name not in self._present:
                yield Event(EventKind.WARNING, text)
        for name in sorted((self._present - set(present)) & set(over)):
            yield Event(EventKind.NEWS, over[name])
        self._present = set(present)
