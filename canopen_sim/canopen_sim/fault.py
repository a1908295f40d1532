# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults of simulated devices: the one table that services, scenario files and drives read."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum

from arm_canopen.standard import AbortCode, object_address

DELAY = 0.5  # [s] default: longer than the SDO time-out of most masters


class Service(Enum):
    """What a frame is for."""

    SDO = 'SDO'
    PDO = 'PDO'
    HEARTBEAT = 'heartbeat'
    BOOT_UP = 'boot-up'
    OTHER = 'other'


_SENT, _RECEIVED = True, False
_EVERY_FRAME = frozenset((service, sent) for service in Service for sent in (True, False))
_RANDOM = ('probability', 'count', 'seed')


@dataclass(frozen=True, slots=True)
class FaultKind:
    """What a fault is.

    Attributes:
        text: What the device does, in words.
        settings: Which fields of :class:`FaultInjection` it uses, beside its duration.
        frames: Which frames it hits: their service, and whether the device sends them.
        of_drive: It belongs to an axis of a drive.
        code: Error code for 0x603F and EMCY (CiA 402-2); 0 for none.
        at_once: The torque is gone at once, whatever fault reaction 0x605E selects.
        lasting: Without a duration it goes on until it is ended; otherwise it is a moment, and a
            fault reset ends it.
    """

    text: str
    settings: tuple[str, ...] = ()
    frames: frozenset[tuple[Service, bool]] = frozenset()
    of_drive: bool = False
    code: int = 0
    at_once: bool = False
    lasting: bool = True


def _of_drive(text: str, code: int, *, at_once: bool = False, lasting: bool = False) -> FaultKind:
    return FaultKind(text, ('axis',), of_drive=True, code=code, at_once=at_once, lasting=lasting)


def _of_frames(text: str, service: Service, sent: bool, *settings: str) -> FaultKind:
    return FaultKind(text, settings, frozenset({(service, sent)}))


class Fault(Enum):
    """Every fault; :attr:`label` is its name in services and scenario files."""

    SDO_DELAY = _of_frames('answers SDOs late', Service.SDO, _SENT, 'object', 'delay')
    SDO_SILENCE = _of_frames('does not answer SDOs', Service.SDO, _RECEIVED, 'object', *_RANDOM)
    SDO_ABORT = _of_frames('aborts SDOs', Service.SDO, _RECEIVED, 'object', 'abort', *_RANDOM)
    SDO_FOUR_BYTES = _of_frames(
        'answers SDO reads of shorter objects with four bytes', Service.SDO, _SENT
    )
    SDO_NO_SIZE = _of_frames('leaves the size out of its SDO answers', Service.SDO, _SENT)
    SDO_SHORT = _of_frames('leaves out the unused bytes of its SDO answers', Service.SDO, _SENT)
    BLOCK_ABORT = _of_frames('aborts SDO block transfers', Service.SDO, _RECEIVED, 'abort')
    BLOCK_SILENCE = _of_frames('does not answer SDO block transfers', Service.SDO, _RECEIVED)
    BLOCK_CRC = FaultKind(
        'computes another CRC in SDO block transfers',
        (),
        frozenset({(Service.SDO, _SENT), (Service.SDO, _RECEIVED)}),
    )
    NODE_ID_CONFLICT = FaultKind(
        'shares its node id with another device, which answers, too',
        (),
        frozenset(
            (service, _SENT) for service in (Service.SDO, Service.HEARTBEAT, Service.BOOT_UP)
        ),
    )
    TPDO_LOSS = _of_frames('loses PDOs that it sends', Service.PDO, _SENT, 'pdo', *_RANDOM)
    TPDO_DELAY = _of_frames('sends PDOs late', Service.PDO, _SENT, 'pdo', 'delay', *_RANDOM)
    RPDO_LOSS = _of_frames('misses PDOs', Service.PDO, _RECEIVED, 'pdo', *_RANDOM)
    RPDO_DELAY = _of_frames('receives PDOs late', Service.PDO, _RECEIVED, 'pdo', 'delay', *_RANDOM)
    FRAME_LOSS = FaultKind('loses frames of both directions', _RANDOM, _EVERY_FRAME)
    HEARTBEAT_STOP = _of_frames(
        'sends no heartbeat and answers no node guarding', Service.HEARTBEAT, _SENT
    )
    WRONG_IDENTITY = FaultKind(
        'shows the identity of another device',
        ('device_type', 'vendor', 'product', 'revision', 'serial'),
    )
    EMCY_FLOOD = FaultKind('sends the EMCY of its last error again and again', ('delay',))
    DISCONNECT = FaultKind('is cut off from the bus and goes on by itself', (), _EVERY_FRAME)
    POWER_OFF = FaultKind('has no power', ('position_kept',))
    REBOOT = FaultKind('restarts', ('position_kept',))
    OVER_CURRENT = _of_drive('too much current at the output', 0x2310, at_once=True)
    OVER_TEMPERATURE = _of_drive('the drive is too hot', 0x4310)
    OVER_VOLTAGE = _of_drive('the DC link has too much voltage', 0x3210)
    UNDER_VOLTAGE = _of_drive('the DC link has too little voltage', 0x3220, at_once=True)
    FOLLOWING_ERROR = _of_drive('the motor is too far from its demand', 0x8611)
    ENCODER_LOSS = _of_drive('the encoder gives no signal', 0x7305, at_once=True, lasting=True)
    BLOCKED_MOTOR = _of_drive('the motor is stuck', 0x7121, lasting=True)
    HALT_IGNORED = _of_drive('has no halt: bit 8 does nothing', 0, lasting=True)
    QUICK_STOP_IGNORED = _of_drive('has no quick stop: bit 2 does nothing', 0, lasting=True)
    STO = _of_drive('safe torque off: no torque, and no fault', 0, at_once=True, lasting=True)
    MODE_REQUIRED = _of_drive('refuses Operation enabled without a mode', 0, lasting=True)
    MODE_ZERO_REFUSED = _of_drive('refuses mode 0 in 0x6060', 0, lasting=True)
    ARRIVED_WHEN_DISABLED = _of_drive(
        'shows bits 10 and 12 in 0x6041 where it is not enabled', 0, lasting=True
    )
    MODE_HELD_UNDER_HALT = _of_drive('ignores 0x6060 while it is halted', 0, lasting=True)

    RATE_UNITS = FaultKind(
        'counts velocities and accelerations in other units than its EDS says',
        ('axis', 'velocity', 'acceleration'),
        of_drive=True,
    )
    ENCODER_SHIFTED = FaultKind(
        'reads another position from its encoder where it stands',
        ('axis', 'position'),
        of_drive=True,
        lasting=False,
    )
    OBJECT_KEPT = FaultKind(
        'holds another value in an object than its EDS says, after each reset',
        ('object', 'value'),
    )

    @property
    def label(self) -> str:
        """Its name in services and scenario files."""
        return self.name.lower()


FAULTS: dict[str, Fault] = {fault.label: fault for fault in Fault}
"""Faults by name."""


@dataclass(frozen=True, slots=True)
class FaultInjection:
    """One fault with its settings.

    Attributes:
        fault: What goes wrong.
        duration: How long in [s]; 0 until it is ended. Of a reboot: how long the power is off.
            Of most faults of a drive 0 is a moment, so that a fault reset ends them.
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
        velocity: What 1 of the velocities of the drive is in [inc/s]; None for its own unit.
        acceleration: What 1 of its accelerations is in [inc/s^2]; None for its own unit.
        position: What the encoder reads in [inc].
        value: What the object holds.
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
    velocity: float | None = None
    acceleration: float | None = None
    position: int = 0
    value: int = 0

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
        for name in ('velocity', 'acceleration'):
            unit = getattr(self, name)
            if unit is not None and not 0.0 < unit < float('inf'):
                raise ValueError(f'{name} {unit} is not a unit above 0')
        if min(self.count, self.pdo, self.axis) < 0:
            raise ValueError('count, pdo and axis are 0 or more')
        allowed = ('fault', 'duration', *self.fault.value.settings)
        for field in fields(self):
            if field.name not in allowed and getattr(self, field.name) != field.default:
                raise ValueError(f'{self.fault.label} has no setting {field.name!r}')

    @property
    def key(self) -> tuple[Fault, int, int, tuple[int, int] | None]:
        """What it replaces when it is injected: the same fault of the same part."""
        return self.fault, self.pdo, self.axis, self.object

    @property
    def lasting(self) -> bool:
        """It goes on until it is ended; otherwise it is over in a moment."""
        return self.fault.value.lasting or bool(self.duration)

    def __str__(self) -> str:
        """Return it in words."""
        parts = [f'{self.fault.label}: {self.fault.value.text}']
        if self.object is not None:
            parts.append(object_address(*self.object))
        if self.pdo:
            parts.append(f'PDO {self.pdo}')
        if self.axis:
            parts.append(f'axis {self.axis}')
        if 'delay' in self.fault.value.settings:
            parts.append(f'by {self.delay:g} s')
        if self.probability < 1.0:
            parts.append(f'with probability {self.probability:g}')
        if self.count:
            parts.append(f'{self.count} times')
        if self.duration:
            parts.append(f'for {self.duration:g} s')
        return ', '.join(parts)
