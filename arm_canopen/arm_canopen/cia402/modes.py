# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What an operation mode is to the master (CiA 402-2, clauses 10 to 16).

A mode writes its target object and returns its bits of the controlword. Every mode is
preloaded with the actual value before the drive is enabled or the mode switched, so that nothing
moves before a command. The modes that move are in ``position_modes.py`` and
``rate_modes.py``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from canopen_core import DriveError
from canopen_core.standard import Controlword, OperationMode, Statusword

from ..master.process_image import Writer
from ..master.scheduler import completed, Promise

TARGET_REACHED = int(Statusword.TARGET_REACHED)
NO_BITS = 0  # bits are plain numbers in the cycle, where operators of IntFlag cost too much


class Actual(NamedTuple):
    """Where a drive is, or is held."""

    # in [inc], as the drive reports it, so that no factor in bus.yml can make the target another
    # one
    position_inc: int
    velocity: float = 0.0  # in user units per second; a moving drive is braked from it
    velocity_dev: int = 0  # the same in device units, as the drive reports it
    torque: int = 0  # 0x6077 in device units, 0 when it is unknown


def fitting(target: Writer, value: int) -> int:
    """Return a target in device units, if its object can hold it."""
    low, high = target.limits
    if not low <= value <= high:
        raise DriveError(
            f'the target is {value} device units, but its object holds {low:g} to {high:g} only; '
            'are the scale factors in bus.yml right, and the type of the object in the EDS?'
        )
    return value


class Mode(ABC):
    """One operation mode of one drive.

    Attributes:
        number: Its value in 0x6060.
        halts_by_bit: Bit 8 of the controlword stops it; else the master brakes its set-points.
        cyclic: Its target acts on the drive in each cycle.
    """

    number: OperationMode
    halts_by_bit = True
    cyclic = False

    @property
    def by_sdo(self) -> bool:
        """Whether its target goes by SDO, because no RPDO carries it."""
        return False

    @abstractmethod
    def preload(self, actual: Actual) -> Promise[None]:
        """Forget any target and command what holds the drive where it is.

        Returns:
            Done when the drive has it; whatever stood in its target object before acts no more.
        """

    @abstractmethod
    def set_target(self, target: float) -> Promise[None]:
        """Accept a single target in user units.

        Returns:
            Done when the drive has it; rejected when it has refused it, or was stopped before.

        Raises:
            DriveError: The mode has no target, or the value does not fit.
        """

    def follow_target(self, target: float) -> Promise[None]:
        """Accept one of a stream of targets; :meth:`set_target` where the drive itself leads."""
        return self.set_target(target)

    @abstractmethod
    def step(self, now: float, period: float, statusword: int) -> int:
        """Advance a cycle in which the drive accepts targets; return the bits of this mode."""

    def withdraw(self, delivery: Promise[None], error: DriveError) -> bool:
        """Withdraw a target that the drive does not have yet, and reject its promise.

        Returns:
            Whether that was possible; else it is on its way.
        """
        return False

    def brake(self) -> None:  # noqa: B027  # most modes leave it to the drive
        """Come to rest by own means, for a halt, a switch or the end of a stream."""

    @property
    def braked(self) -> bool:
        """Whether what the mode commands stands still, as far as the mode itself leads it."""
        return True

    def reached(self, statusword: int) -> bool:
        """Whether the drive is where the last target is, as far as the mode knows."""
        return bool(statusword & TARGET_REACHED)

    @property
    def taken(self) -> bool:
        """Whether the drive has a target that was commanded after the last brake."""
        return True

    @property
    def offered(self) -> bool:
        """Whether a target is shown to the drive that it has not acknowledged yet."""
        return False

    def offer_again(self) -> None:  # noqa: B027  # most modes have nothing to acknowledge
        """Withdraw a target that is not acknowledged, and present it anew."""

    def goes_on_unanswered(self) -> bool:
        """Conclude from an acknowledge that does not come, though nothing was in its way.

        Returns:
            Whether the target counts as taken all the same.
        """
        return False

    @property
    def setpoint(self) -> float | None:
        """Position last commanded in user units, None in a mode that commands none."""
        return None


class NoMode(Mode):
    """Mode 0: nothing is commanded."""

    number = OperationMode.NO_MODE

    def preload(self, actual: Actual) -> Promise[None]:
        """Preload nothing."""
        return completed()

    def set_target(self, target: float) -> Promise[None]:
        """Refuse every target."""
        raise DriveError('no mode of operation is selected; select position_mode or another first')

    def step(self, now: float, period: float, statusword: int) -> int:
        """Command nothing."""
        return NO_BITS


class Homing(Mode):
    """Mode 6: bit 4 starts the method of 0x6098."""

    number = OperationMode.HOMING

    def __init__(self) -> None:
        self.started = False  # whether bit 4 is set

    def preload(self, actual: Actual) -> Promise[None]:
        """Preload nothing: without bit 4 nothing moves."""
        self.started = False
        return completed()

    def set_target(self, target: float) -> Promise[None]:
        """Refuse every target."""
        raise DriveError('the drive is homing and takes no target')

    def step(self, now: float, period: float, statusword: int) -> int:
        """Keep bit 4 while homing runs."""
        return Controlword.HOMING_START if self.started else NO_BITS
