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


@dataclass(slots=True)  # not frozen, which would make it at five times the cost
class AxisFeedback:
    """What is known of one drive at the start of a cycle, made anew for each.

    Attributes:
        name: Name of the drive in bus.yml.
        online: Booted, and its heartbeat is there.
        state: State of the power drive system.
        mode: Mode of operation as displayed in 0x6061.
        position: Actual position in user units (rad for a revolute joint); the last one of a lost
            drive, NaN before the first.
        velocity: Actual velocity in user units per second.
        setpoint: Position last commanded in user units; equals ``position`` while disabled.
        followable: A position set-point of a source is sent in this cycle: the drive is online,
            Operation Enabled and in a cyclic position mode, and nothing else moves it.
        refusal: Why the drive accepts no stream of positions; None when it does. A drive that
            moves and has stopped to send its TPDOs is followable for another second in spite of
            it, so that the source can bring the whole arm to rest on its path; then it is halted.
        age: Age of the oldest of these values in [s]; infinite while they are unknown.
        speed_limit: Greatest velocity that the drive takes (0x607F) in user units per second;
            infinite where it has none.
    """

    name: str
    online: bool
    state: DriveState
    mode: int
    position: float
    velocity: float
    setpoint: float
    followable: bool
    refusal: Refusal | None = None
    age: float = 0.0
    speed_limit: float = math.inf


@dataclass(slots=True)  # as above
class Setpoint:
    """A position, and what the drive shall add to its own control on the way there.

    Attributes:
        position: In user units.
        velocity: Feed-forward in user units per second (0x60B1, usually the rate of the
            position); it has an effect in mode 8, where an RPDO carries the object.
        effort: Feed-forward in units of effort (0x60B2, such as the weight of what hangs on the
            axis); likewise.
    """

    position: float
    velocity: float = 0.0
    effort: float = 0.0


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
