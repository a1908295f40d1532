# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion sources, which command drives in each SYNC cycle, and reasons why a drive refuses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
import math
from typing import Protocol

from canopen_core.standard import DriveState


class RefusalCause(Enum):
    """Why a drive accepts no targets; the value is a text that follows the drive's name."""

    OFFLINE = 'is offline'
    NOT_OPERATIONAL = 'is not in the NMT state Operational'
    STATE_UNKNOWN = 'does not show its state'
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
    """Why a drive accepts no targets."""

    cause: RefusalCause  # cause, for programs
    detail: str = ''  # details in words; may be empty

    def __str__(self) -> str:
        """Return a sentence without its subject, the drive."""
        return f'{self.cause.value}: {self.detail}' if self.detail else self.cause.value


@dataclass(slots=True)  # not frozen, which takes five times as long to create
class AxisFeedback:
    """State of one drive at the start of a cycle, created in each cycle.

    Positions are in user units (rad for a revolute joint), velocities in user units per second.
    """

    name: str  # name of the drive in bus.yml
    online: bool  # booted, and not lost since
    state: DriveState  # of the power drive system
    mode: int  # mode of operation as displayed in 0x6061
    position: float  # actual position; the last one of a lost drive, NaN before the first
    velocity: float  # actual velocity
    setpoint: float  # last commanded position; equals ``position`` while disabled
    # the drive accepts a position set-point in this cycle: it is online, Operation Enabled and in
    # a cyclic position mode, and nothing else moves it
    followable: bool
    # why it accepts no stream of positions; None if it accepts one. A moving drive whose TPDOs
    # stop nevertheless stays followable for a second, so that the source can stop the whole arm
    # on its path; then the drive is halted
    refusal: Refusal | None = None
    age: float = 0.0  # age of the oldest of these values in [s]; infinite if unknown
    speed_limit: float = math.inf  # maximum velocity of the drive (0x607F)


@dataclass(slots=True)  # as above
class Setpoint:
    """A position set-point with its feed-forward.

    Feed-forward has an effect in mode 8, if an RPDO carries its object.
    """

    position: float  # in user units
    velocity: float = 0.0  # 0x60B1 in user units per second, usually the rate of the position
    effort: float = 0.0  # 0x60B2 in units of effort, such as the gravity load of the axis


class MotionSource(Protocol):
    """Interface of controllers that command positions of one or more drives in each cycle.

    It runs in the thread of the SYNC cycle: it must not block, wait or call ROS.
    """

    @property
    def axes(self) -> Sequence[str]:
        """Names of the drives that it commands; they never change."""

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | Setpoint | None]:
        """Return the set-points of this cycle.

        A new stream must start at ``feedback[i].setpoint``; a set-point for an axis that is not
        ``followable`` is ignored.

        Args:
            now: Steady time of the cycle in [s].
            period: Time to the next cycle in [s].
            feedback: State of each axis, in the order of :attr:`axes`.

        Returns:
            For each axis the position to command in user units, optionally with feed-forward,
            or None to leave it where it is.
        """

    def released(self, axis: str, refusal: Refusal) -> None:
        """Handle the loss of an axis, whose set-points are ignored until attached again.

        It is also called for an axis lost before if a client stops or moves it: a motion that the
        source has planned for the axis is outdated then.

        Args:
            axis: Name of the drive.
            refusal: Reason, such as a single target, another mode, a fault or a loss.
        """
