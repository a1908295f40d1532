# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a simulated device can be told to do wrong on its bus, as values."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from typing import TypeAlias

from arm_canopen.standard.sdo_abort import AbortCode

from ..drive.fault import DriveFault


class BusFault(Enum):
    """Ways in which a device misbehaves on the bus, or is not there at all.

    Each value is the name that services and scenario files use.
    """

    SDO_DELAY = 'sdo_delay'
    SDO_SILENCE = 'sdo_silence'
    SDO_ABORT = 'sdo_abort'
    TPDO_LOSS = 'tpdo_loss'
    TPDO_DELAY = 'tpdo_delay'
    RPDO_LOSS = 'rpdo_loss'
    RPDO_DELAY = 'rpdo_delay'
    FRAME_LOSS = 'frame_loss'
    HEARTBEAT_STOP = 'heartbeat_stop'
    WRONG_IDENTITY = 'wrong_identity'
    DISCONNECT = 'disconnect'
    POWER_OFF = 'power_off'
    REBOOT = 'reboot'


Fault: TypeAlias = BusFault | DriveFault

FAULT_TEXTS: dict[Fault, str] = {
    BusFault.SDO_DELAY: 'answers SDOs late',
    BusFault.SDO_SILENCE: 'does not answer SDOs',
    BusFault.SDO_ABORT: 'aborts SDOs',
    BusFault.TPDO_LOSS: 'loses PDOs that it sends',
    BusFault.TPDO_DELAY: 'sends PDOs late',
    BusFault.RPDO_LOSS: 'misses PDOs',
    BusFault.RPDO_DELAY: 'takes PDOs late',
    BusFault.FRAME_LOSS: 'loses frames of both directions',
    BusFault.HEARTBEAT_STOP: 'sends no heartbeat and answers no guarding',
    BusFault.WRONG_IDENTITY: 'says that it is another device',
    BusFault.DISCONNECT: 'is cut off from the bus and goes on by itself',
    BusFault.POWER_OFF: 'has no power',
    BusFault.REBOOT: 'starts anew',
    **{fault: fault.text for fault in DriveFault},
}
"""What a device does under each fault, in words."""

_RANDOM = ('probability', 'count', 'seed')
SETTINGS: dict[Fault, tuple[str, ...]] = {
    BusFault.SDO_DELAY: ('delay',),
    BusFault.SDO_SILENCE: ('object', *_RANDOM),
    BusFault.SDO_ABORT: ('object', 'abort', *_RANDOM),
    BusFault.TPDO_LOSS: ('pdo', *_RANDOM),
    BusFault.TPDO_DELAY: ('pdo', 'delay', *_RANDOM),
    BusFault.RPDO_LOSS: ('pdo', *_RANDOM),
    BusFault.RPDO_DELAY: ('pdo', 'delay', *_RANDOM),
    BusFault.FRAME_LOSS: _RANDOM,
    BusFault.HEARTBEAT_STOP: (),
    BusFault.WRONG_IDENTITY: ('device_type', 'vendor', 'product', 'revision', 'serial'),
    BusFault.DISCONNECT: (),
    BusFault.POWER_OFF: ('position_kept',),
    BusFault.REBOOT: ('position_kept',),
    **dict.fromkeys(DriveFault, ('axis',)),
}
"""Which fields of :class:`FaultInjection` each fault uses, beside its duration."""

LASTING = frozenset({DriveFault.STO, DriveFault.BLOCKED_MOTOR, DriveFault.ENCODER_LOSS})
DELAY = 0.5  # [s] default: longer than the SDO time-out of a patient master


@dataclass(frozen=True, slots=True)
class FaultInjection:
    """One fault, with all that says how it shows.

    Attributes:
        fault: What goes wrong.
        duration: How long in [s]; 0 until it is ended. Of a reboot: how long the power is off.
            Of faults of a drive 0 is a moment, so that a fault reset ends them, except for STO,
            a blocked motor and a lost encoder.
        delay: How late frames are in [s].
        probability: Part of the frames in question that are hit, 0 to 1.
        count: How many frames are hit, then the fault is over; 0 for no such limit.
        seed: Beginning of the random numbers; the same seed hits the same frames.
        pdo: Number of the PDO, from 1; 0 for all.
        axis: Number of the drive's axis, from 1; 0 for all.
        object: Index and sub-index; None for all.
        abort: SDO abort code.
        position_kept: The encoder knows its position after power-on (absolute), or counts from
            0 (incremental).
        device_type: What 0x1000 shows; None for the true value, as in those that follow.
        vendor: What 0x1018:01 shows.
        product: What 0x1018:02 shows.
        revision: What 0x1018:03 shows.
        serial: What 0x1018:04 shows.
    """

    fault: Fault
    duration: float = 0.0
    delay: float = DELAY
    probability: float = 1.0
    count: int = 0
    seed: int = 0
    pdo: int = 0
    axis: int = 0
    object: tuple[int, int] | None = None
    abort: int = AbortCode.GENERAL
    position_kept: bool = True
    device_type: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial: int | None = None

    def __post_init__(self) -> None:
        """Refuse what has no meaning.

        Raises:
            ValueError: A number is out of range, or a setting is not one of this fault.
        """
        for name in ('duration', 'delay'):
            value = getattr(self, name)
            if not 0.0 <= value < float('inf'):
                raise ValueError(f'{name} {value} is not a time of 0 s or more')
        if not 0.0 <= self.probability <= 1.0:
            raise ValueError(f'probability {self.probability} is not 0 to 1')
        if min(self.count, self.pdo, self.axis) < 0:
            raise ValueError('count, pdo and axis are 0 or more')
        allowed = ('fault', 'duration', *SETTINGS[self.fault])
        for field in fields(self):
            if field.name not in allowed and getattr(self, field.name) != field.default:
                raise ValueError(f'{self.fault.value} has no setting {field.name!r}')

    @property
    def key(self) -> tuple[Fault, int, int, tuple[int, int] | None]:
        """What it replaces when it is injected: the same fault of the same part."""
        return self.fault, self.pdo, self.axis, self.object

    @property
    def lasting(self) -> bool:
        """It goes on until it is ended; otherwise it is over in a moment."""
        return isinstance(self.fault, BusFault) or bool(self.duration) or self.fault in LASTING

    def __str__(self) -> str:
        """Say it in words."""
        parts = [f'{self.fault.value}: {FAULT_TEXTS[self.fault]}']
        if self.object is not None:
            parts.append('0x{:04X}:{:02X}'.format(*self.object))
        if self.pdo:
            parts.append(f'PDO {self.pdo}')
        if self.axis:
            parts.append(f'axis {self.axis}')
        if 'delay' in SETTINGS[self.fault]:
            parts.append(f'by {self.delay:g} s')
        if self.probability < 1.0:
            parts.append(f'with probability {self.probability:g}')
        if self.count:
            parts.append(f'{self.count} times')
        if self.duration:
            parts.append(f'for {self.duration:g} s')
        return ', '.join(parts)
