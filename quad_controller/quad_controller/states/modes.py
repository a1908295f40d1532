# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States, mode requests, faults, parameters and reports of the controller."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum
import math

from quad_description import EMPTY_BATTERY, MAX_TILT, Targets
from robot_primitives import setting, switch

from ..exceptions import check_settings, ParameterError
from ..gait.parameters import Gait
from ..gait.velocity import Velocity
from ..policy.observation import Situation
from ..policy.runner import PolicyRunner, PolicyStep


class Reaction(IntEnum):
    """Reaction to a fault; with several faults, the largest value applies."""

    STAND = 1
    LIE_DOWN = 2
    HOLD = 3


class Fault(Enum):
    """Kinds of fault; the value is a readable subject."""

    JOINTS = 'joint states'
    IMU = 'attitude'
    FALLEN = 'fall'
    BATTERY = 'battery'
    SERVO = 'servo'
    TARGET = 'target'
    PAUSE = 'pause'


REACTIONS: Mapping[Fault, Reaction] = {
    Fault.JOINTS: Reaction.HOLD,  # where the legs are is unknown
    Fault.IMU: Reaction.STAND,
    Fault.FALLEN: Reaction.HOLD,  # legs in the air find no ground, and may be jammed
    Fault.BATTERY: Reaction.LIE_DOWN,
    Fault.SERVO: Reaction.LIE_DOWN,
    Fault.TARGET: Reaction.HOLD,
    Fault.PAUSE: Reaction.LIE_DOWN,  # the hardware node may have begun it
}

LYING_FAULTS = frozenset({Fault.JOINTS, Fault.FALLEN})
"""What stops a robot on its way down, if it was in order when the way down was requested."""


class FaultLatch:
    """Latches faults until they are cleared."""

    def __init__(self) -> None:
        self._faults: dict[Fault, str] = {}

    @property
    def texts(self) -> tuple[str, ...]:
        """Each fault with its reason."""
        return tuple(f'{fault.value}: {reason}' for fault, reason in self._faults.items())

    @property
    def reaction(self) -> Reaction | None:
        """Required reaction; None without a fault."""
        return max((REACTIONS[fault] for fault in self._faults), default=None)

    def latch(self, fault: Fault, reason: str) -> bool:
        """Latch a fault; return whether it is new."""
        new = fault not in self._faults
        if new:
            self._faults[fault] = reason
        return new

    def texts_without(self, fault: Fault) -> tuple[str, ...]:
        """Return all other faults with their reasons."""
        return tuple(
            f'{f.value}: {reason}' for f, reason in self._faults.items() if f is not fault
        )

    def clear(self) -> None:
        """Clear all faults."""
        self._faults.clear()

    def keep(self, faults: Collection[Fault]) -> tuple[str, ...]:
        """Clear all faults but these; return the cleared ones by name."""
        gone = tuple(fault.value for fault in self._faults if fault not in faults)
        self._faults = {f: reason for f, reason in self._faults.items() if f in faults}
        return gone


class State(Enum):
    """State of the controller; the value is its readable name."""

    RELAX = 'relax'
    LIE = 'lie'
    STAND = 'stand'
    WALK = 'walk'
    TURN = 'turn'
    POLICY = 'policy'
    GET_UP = 'get_up'
    FAULT = 'fault'


GAIT_STATES = frozenset({State.STAND, State.WALK, State.TURN})
"""States in which the geometric gait moves the legs."""

MOVING_STATES = frozenset({State.WALK, State.TURN, State.POLICY})
"""States in which the robot follows velocities."""

ON_FEET = GAIT_STATES | {State.POLICY}
"""States in which the legs carry the robot."""

UPRIGHT_STATES = ON_FEET | {State.GET_UP, State.FAULT}
"""States in which the robot is on its legs or getting there, and what is wrong is a fault."""

WAYS_DOWN = frozenset({State.LIE, State.RELAX})
"""Modes that no fault keeps a robot from: they need nothing but the last targets."""

ALIASES = {
    'sit': 'lie',
    'recovery_stand': 'get_up',
    'trot': 'gait:trot',
    'crawl': 'gait:crawl',
    'pace': 'gait:pace',
}
"""Other words for modes, which other robots have."""

GAIT_PREFIX = 'gait:'

MODES = (
    *(state.value for state in State if state is not State.FAULT),
    *(GAIT_PREFIX + gait.value for gait in Gait),
)
"""The words that can be requested."""


@dataclass(frozen=True, slots=True)
class ModeRequest:
    """State and gait that a mode name requests."""

    state: State  # state to go to
    gait: Gait | None = None  # gait to walk with, None for the one that is set


def parse_mode(text: str) -> ModeRequest | None:
    """Parse a mode name or alias; return None if it is unknown."""
    word = text.strip().lower()
    word = ALIASES.get(word, word)
    if word not in MODES:
        return None
    if word.startswith(GAIT_PREFIX):
        return ModeRequest(State.WALK, Gait(word.removeprefix(GAIT_PREFIX)))
    return ModeRequest(State(word))


@dataclass(frozen=True, slots=True)
class Answer:
    """Response to a request."""

    accepted: bool  # whether it is followed
    message: str  # what happens now, or why not and what can be done


@dataclass(frozen=True, slots=True)
class StateParameters:
    """All controller parameters except those of gait and policy."""

    # 10 set-points a second carry no trot of 0.28 s: it goes 0.08 of 0.2 m/s, and 0.19 with 25
    period: float = setting(0.02, 0.002, 0.04, 'time between two steps [s]')
    command_timeout: float = setting(0.5, 0.05, 10.0, 'an older velocity counts as zero [s]')
    warn_age: float = setting(0.06, 0.01, 5.0, 'older joint states and attitudes are reported [s]')
    hold_age: float = setting(0.2, 0.02, 5.0, 'with older ones nothing moves on [s]')
    fault_age: float = setting(0.5, 0.05, 10.0, 'older ones are a fault [s]')
    max_tilt: float = setting(MAX_TILT, 0.1, math.pi, 'more is a fall [rad]')
    max_turn_rate: float = setting(8.0, 1.0, 100.0, 'a faster body is falling [rad/s]')
    fall_time: float = setting(0.1, 0.0, 2.0, 'how long it must be so [s]')
    low_battery: float = setting(
        EMPTY_BATTERY, 0.0, 0.9, 'charge 0 to 1 below which the robot lies down; 0: never'
    )
    battery_time: float = setting(3.0, 0.0, 60.0, 'how long it must be so [s]')
    require_imu: bool = switch(True, 'no leg moves without a known attitude')
    lie_height: float = setting(
        0.055, 0.01, 1.0, "hip axes above the feet's centres when it lies [m]"
    )
    blend_speed: float = setting(1.0, 0.1, 10.0, 'fastest joint between two poses [rad/s]')
    blend_time: float = setting(1.0, 0.2, 10.0, 'shortest time between two poses [s]')
    hold_band: float = setting(
        0.25, 0.02, 3.2, 'a held joint that is further off is not pulled back [rad]'
    )
    # the set-points of soft servos are ahead of the joints, and faster for a moment; cutting them
    # at the speed of the joints costs a trot 1 to 7 % of its own, with 1.1 to 10 N m/rad
    setpoint_speed_ratio: float = setting(
        1.0, 0.05, 5.0, 'speed of set-points per speed of joints; 2: nothing of a trot is cut'
    )
    policy_fallback_walks: bool = switch(
        False, 'the gait walks on when a policy fails, instead of standing'
    )
    get_up_swings: bool = switch(
        False, 'the mode get_up may throw the robot off its back, at full speed'
    )

    def __post_init__(self) -> None:
        """Reject values outside of their ranges.

        Raises:
            ParameterError: A value is out of range; the message gives name and range.
        """
        check_settings(self)
        if not self.warn_age <= self.hold_age <= self.fault_age:
            raise ParameterError(
                f'warn_age {self.warn_age}, hold_age {self.hold_age} and fault_age '
                f'{self.fault_age} must grow in this order'
            )


@dataclass(frozen=True, slots=True)
class Status:
    """Snapshot of the controller."""

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
    """How to report an event."""

    NEWS = 'news'
    WARNING = 'warning'
    TROUBLE = 'trouble'
    REPEATED = 'repeated'  # trouble of every step: reported now and then only


@dataclass(frozen=True, slots=True)
class Event:
    """An event to report to the user."""

    kind: EventKind  # how it is to be reported
    text: str  # what happened, and the remedy if there is one


@dataclass(frozen=True, slots=True)
class Asked:
    """A policy that was run in a step, and its answer."""

    policy: PolicyRunner  # which one
    answer: PolicyStep  # what it answered
    step: int  # how often it was stepped since its reset; 1 for the first time


@dataclass(frozen=True, slots=True)
class Output:
    """Result of one step."""

    # positions of all joints in [rad]; None as long as no joint state was received
    targets: Targets | None
    shadow: Targets | None  # what the policy would do, in a dry run; None otherwise
    title: str  # name of the state, with the way to it
    ready: bool  # whether all measurements were received once that walking needs
    events: tuple[Event, ...]
    situation: Situation | None = None  # what the motion knew; None when nothing moved
    asked: Asked | None = None  # the policy that was asked, followed or watched; None for none


class Notices:
    """Reports conditions that begin or end between two steps."""

    def __init__(self) -> None:
        self._present: set[str] = set()

    def step(self, present: dict[str, str], over: dict[str, str]) -> Iterator[Event]:
        """Yield an event for each change.

        Args:
            present: Text of each present condition, by name.
            over: Texts for conditions that end, by the same names; without one, no event.
        """
        for name, text in present.items():
            if name not in self._present:
                yield Event(EventKind.WARNING, text)
        for name in sorted((self._present - set(present)) & set(over)):
            yield Event(EventKind.NEWS, over[name])
        self._present = set(present)
