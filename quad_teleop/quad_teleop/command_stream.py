# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When to publish a velocity: steadily while active, a few zeros at the end, and then nothing."""

from __future__ import annotations

import operator_input
from operator_input.command_stream import RESTS

from .exceptions import SettingError
from .velocity import Velocity, ZERO

ZEROS = RESTS
"""Zeros at the end of a motion."""


class CommandStream(operator_input.CommandStream[Velocity]):
    """Turns the velocity that is wanted now into messages; it ends with zeros."""

    def __init__(self, period: float) -> None:
        """Start idle.

        Args:
            period: Time between two messages of the same velocity [s].

        Raises:
            SettingError: The period is not positive.
        """
        try:
            super().__init__(period, lambda _: ZERO)
        except ValueError as error:
            raise SettingError(str(error)) from error
