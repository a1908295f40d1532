# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes of the controller that a person can request with one key or button."""

from __future__ import annotations

from enum import Enum


class Mode(Enum):
    """A mode of ``/set_mode``; the value is its name there."""

    LIE = 'lie'
    STAND = 'stand'
    WALK = 'walk'
    TURN = 'turn'
    GET_UP = 'get_up'

    @property
    def moves(self) -> bool:
        """Whether velocity commands do anything in it."""
        return self in {Mode.WALK, Mode.TURN}
