# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion sources: what moves the drives in step with SYNC, and why a drive does not follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
import math
from typing import Protocol

from canopen_core.standard import DriveState


class RefusalCause(Enum):
    """What keeps a drive from accepting targets; the value follows the name of the drive."""

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

    cause: RefusalCause  # what keeps it from accepting them, for programs
    detail: str = ''  # more of it in words; may be empty

    def __str__(self) -> str:
        """Return it as a sentence without its subject, which is the drive."""
        return f'{self.cause.value}: {self.detail}' if self.detail else self.cause.value


@dataclass(slots=True)  # not frozen, which would make it at five times the cost
class AxisFeedback:
    """What is known of one drive at the start of a cycle, made anew for each.

    Positions are in user units (rad for a revolute joint), velocities in those per second.
    """

    name: str  # name of the drive in bus.yml
    online: bool  # booted, and its heartbeat is there
    state: DriveState  # of the power drive system
    mode: int  # mode of operation as displayed in 0x6061
    position: float  # actual one; the last one of a lost drive, NaN before the first
    velocity: float  # actual one
    setpoint: float  # position last commanded; equals ``position`` while disabled
    # a position set-point of a source is sent in this cycle: the drive is online, Operation
    # Enabled and in a cyclic position mode, and nothing else moves it
    followable: bool
    # why it accepts no stream of positions; None when it does. A drive that moves and has stopped
    # to send its TPDOs is followable for another second in spite of it, so that the source can
    # bring the whole arm to rest on its path; then it is halted
    refusal: Refusal | None = None
    age: float = 0.0  # of the oldest of these values in [s]; infinite while they are unknown
    speed_limit: float = math.inf  # greatest velocity that it takes (0x607F)


@dataclass(slots=True)  # as above
class Setpoint:
    """A position, and what the drive shall add to its own control on the way there.

    Feed-forward has an effect in mode 8, where an RPDO carries its object.
    """

    position: float  # in user units
    velocity: float = 0.0  # of 0x60B1 in user units per second, usually the rate of the position
    effort: float = 0.0  # of 0x60B2, such as the weight of what hangs on the axis


class MotionSource(Protocol):
    """Something that commands positions of one or more drives, cycle by cycle.

    It runs in the thread of the SYNC cycle: it must not block, wait or call ROS.
    """

    @property
    def axes(self) -> Sequence[str]:
        """Names of the drives that it commands, fixed for its life."""

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | Setpoint | None]:
        """Answer the set-points of this cycle.

        A new stream must start at ``feedback[i].setpoint``; a set-point for an axis that is not
        ``followable`` is ignored.

        Args:
            now: Steady time of the cycle in [s].
            period: Time to the next cycle in [s].
            feedback: State of each axis, in the order of :attr:`axes`.

        Returns:
            For each axis the position to command in user units, alone or with its feed-forward,
            or None to leave it where it is.
        """

    def released(self, axis: str, refusal: Refusal) -> None:
        """Learn that an axis was taken away; until attached again its set-points are ignored.

        It is called for an axis that was away before, too, where a client stops or moves it:
        what the source was about to begin when it gets the axis back is older than that.

        Args:
            axis: Name of the drive.
            refusal: Why: a single target, another mode, a fault, a loss.
        """
