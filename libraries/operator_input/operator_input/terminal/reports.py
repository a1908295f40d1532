# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Answers of a terminal."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntFlag


class Kitty(IntFlag):
    """Progressive enhancements of the Kitty keyboard protocol (its section of that name)."""

    DISAMBIGUATE = 1
    EVENT_TYPES = 2
    ALTERNATE_KEYS = 4
    ALL_KEYS = 8
    TEXT = 16


NO_FLAGS = Kitty(0)


class ReportKind(Enum):
    """Which question a report answers."""

    KITTY_FLAGS = 'CSI ? u'
    DEVICE_ATTRIBUTES = 'CSI c'
    STATUS = 'CSI 5 n'


@dataclass(frozen=True, slots=True)
class Report:
    """An answer of the terminal.

    Attributes:
        kind: The question.
        flags: Of KITTY_FLAGS: the enhancements that are on.
    """

    kind: ReportKind
    flags: Kitty = NO_FLAGS
