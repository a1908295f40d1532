# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Why a drive accepts no targets, or why a motion source lost it, as data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class RefusalCause(Enum):
    """What keeps a drive from accepting targets; the value follows the name of the drive."""

    OFFLINE = 'is offline'
    NOT_OPERATIONAL = 'is not in the NMT state Operational'
    STATE_UNKNOWN = 'has not sent its state yet'
    SILENT = 'does not send its TPDOs'
    FAULT = 'is faulted'
    NOT_ENABLED = 'is not enabled'
    MODE_CHANGE = 'does not show the selected mode of operation'
    OTHER_MODE = 'is in a mode that follows no stream of positions'
    HALTED = 'is halted'
    SINGLE_TARGET = 'moves to a single target'
    NOT_FOLLOWING = 'does not follow its set-points'
    CYCLE_FAILED = 'failed in the cycle of the master'
    SETPOINT_REFUSED = 'was sent a set-point that it cannot take'
    OTHER_SOURCE = 'was taken over by another motion source'
    MODE_SELECTED = 'was switched to another mode'
    COMMANDED = 'was taken over by a command'
    SHUTDOWN = 'is shut down'


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a drive accepts no targets.

    Attributes:
        cause: What keeps it from accepting them, for programs.
        detail: More of it in words; may be empty.
    """

    cause: RefusalCause
    detail: str = ''

    def __str__(self) -> str:
        """Return it as a sentence without its subject, which is the drive."""
        return f'{self.cause.value}: {self.detail}' if self.detail else self.cause.value
