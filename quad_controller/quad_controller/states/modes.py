# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The states of the controller and the words with which they are requested."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..gait.schedule import Gait


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
