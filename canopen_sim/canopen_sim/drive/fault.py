# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong in a simulated drive, as values (codes of CiA 402-2, table of error codes)."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from ..services.emcy_producer import EmcyProducer


class DriveFault(Enum):
    """Faults of a drive; each value is the name that services and scenario files use."""

    OVER_CURRENT = 'over_current'
    OVER_TEMPERATURE = 'over_temperature'
    OVER_VOLTAGE = 'over_voltage'
    UNDER_VOLTAGE = 'under_voltage'
    FOLLOWING_ERROR = 'following_error'
    ENCODER_LOSS = 'encoder_loss'
    BLOCKED_MOTOR = 'blocked_motor'
    STO = 'sto'

    @property
    def code(self) -> int:
        """Error code for 0x603F and EMCY; 0 when it is no fault of the state machine."""
        return FAULT_KINDS[self].code

    @property
    def at_once(self) -> bool:
        """The torque is gone at once, whatever fault reaction 0x605E asks for."""
        return FAULT_KINDS[self].at_once

    @property
    def text(self) -> str:
        """What it is, in words."""
        return FAULT_KINDS[self].text


class FaultKind(NamedTuple):
    """What a fault does.

    Attributes:
        code: Error code; 0 for none.
        at_once: The torque is gone at once, whatever fault reaction 0x605E asks for.
        text: What it is, in words.
    """

    code: int
    at_once: bool
    text: str


FAULT_KINDS: dict[DriveFault, FaultKind] = {
    DriveFault.OVER_CURRENT: FaultKind(0x2310, True, 'too much current at the output'),
    DriveFault.OVER_TEMPERATURE: FaultKind(0x4310, False, 'the drive is too hot'),
    DriveFault.OVER_VOLTAGE: FaultKind(0x3210, False, 'the DC link has too much voltage'),
    DriveFault.UNDER_VOLTAGE: FaultKind(0x3220, True, 'the DC link has too little voltage'),
    DriveFault.FOLLOWING_ERROR: FaultKind(0x8611, False, 'the motor is too far from its demand'),
    DriveFault.ENCODER_LOSS: FaultKind(0x7305, True, 'the encoder gives no signal'),
    DriveFault.BLOCKED_MOTOR: FaultKind(0x7121, False, 'the motor is stuck'),
    DriveFault.STO: FaultKind(0, True, 'safe torque off: no torque, and no fault'),
}


class SharedErrors:
    """Errors of a device; one that several axes have is gone when all have lost it."""

    def __init__(self, errors: EmcyProducer) -> None:
        """Tell of them through the producer of the device."""
        self._errors = errors
        self._axes: dict[int, set[int]] = {}

    def report(self, axis: int, code: int, now: float) -> None:
        """Say that an axis has an error since a time in [s]."""
        self._axes.setdefault(code, set()).add(axis)
        self._errors.report(code, now)

    def clear(self, axis: int, code: int, now: float) -> None:
        """Say that an axis has an error no more."""
        axes = self._axes.get(code, set())
        axes.discard(axis)
        if not axes:
            self._errors.clear(code, now)

    def forget(self, axis: int) -> None:
        """Forget what an axis had, as after switching on."""
        for axes in self._axes.values():
            axes.discard(axis)
