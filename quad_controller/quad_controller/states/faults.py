# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What ends a motion, and how."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from enum import Enum, IntEnum


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
    TARGET = 'target'
    PAUSE = 'pause'


REACTIONS: Mapping[Fault, Reaction] = {
    Fault.JOINTS: Reaction.HOLD,  # nobody knows where the legs are
    Fault.IMU: Reaction.STAND,
    Fault.FALLEN: Reaction.HOLD,  # legs in the air find no ground, and may be jammed
    Fault.BATTERY: Reaction.LIE_DOWN,
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
