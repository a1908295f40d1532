# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The states of the controller, the words with which they are requested, and what ends them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum

from ..gait.schedule import Gait


class Reaction(IntEnum):
    """What the robot does; the larger one prevails when several faults are there."""

    STAND = 1
    LIE_DOWN = 2
    HOLD = 3


class Fault(Enum):
    """Why; the value says what it is about, for people."""

    JOINTS = 'joint states'
    IMU = 'attitude'
    FALLEN = 'fall'
    BATTERY = 'battery'
    SERVO = 'servo'
    TARGET = 'target'
    PAUSE = 'pause'


REACTIONS: Mapping[Fault, Reaction] = {
    Fault.JOINTS: Reaction.HOLD,  # nobody knows where the legs are
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
    """Keeps faults until they are cleared."""

    def __init__(self) -> None:
        self._faults: dict[Fault, str] = {}

    @property
    def texts(self) -> tuple[str, ...]:
        """Each fault with its reason."""
        return tuple(f'{fault.value}: {reason}' for fault, reason in self._faults.items())

    @property
    def reaction(self) -> Reaction | None:
        """What to do, None without a fault."""
        return max((REACTIONS[fault] for fault in self._faults), default=None)

    def latch(self, fault: Fault, reason: str) -> bool:
        """Keep a fault; return whether it is new."""
        new = fault not in self._faults
        if new:
            self._faults[fault] = reason
        return new

    def texts_without(self, fault: Fault) -> tuple[str, ...]:
        """Return each of the others with its reason."""
        return tuple(
            f'{f.value}: {reason}' for f, reason in self._faults.items() if f is not fault
        )

    def clear(self) -> None:
        """Forget all."""
        self._faults.clear()

    def keep(self, faults: Collection[Fault]) -> tuple[str, ...]:
        """Forget all but these; return what was forgotten, by name."""
        gone = tuple(fault.value for fault in self._faults if fault not in faults)
        self._faults = {f: reason for f, reason in self._faults.items() if f in faults}
        return gone


class State(Enum):
    """What the controller is doing; the value is its name for people."""

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
    """What a word requests."""

    state: State  # state to go to
    gait: Gait | None = None  # gait to walk with, None for the one that is set


def parse_mode(text: str) -> ModeRequest | None:
    """Return what a word requests, None when it is not a mode."""
    word = text.strip().lower()
    word = ALIASES.get(word, word)
    if word not in MODES:
        return None
    if word.startswith(GAIT_PREFIX):
        return ModeRequest(State.WALK, Gait(word.removeprefix(GAIT_PREFIX)))
    return ModeRequest(State(word))


@dataclass(frozen=True, slots=True)
class Answer:
    """What becomes of a request."""

    accepted: bool  # whether it is followed
    message: str  # what happens now, or why not and what can be done
