# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults and quirks of simulated devices, all in one table.

A row has a name, a description, its settings, and its target: frames of a service, an axis of a
drive, or the device. Services, the line and drives read this table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
import difflib
from enum import auto, Enum
from functools import partial
import re
from typing import Any, NamedTuple

from canopen_core.standard import AbortCode, object_address

DELAY = 0.5  # [s] default: longer than the SDO time-out of most masters
FRAME_BYTES = 8  # [byte] of an SDO
MULTIPLEXER_BYTES = 4  # [byte] command and object, of an SDO that carries nothing else
GARBAGE = b'\xa5'  # unused bytes of a deviating server

Rewrite = Callable[[bytes], bytes]


class Service(Enum):
    """CANopen service to which a frame belongs."""

    SDO = 'SDO'
    PDO = 'PDO'
    HEARTBEAT = 'heartbeat'
    BOOT_UP = 'boot-up'
    OTHER = 'other'


class Effect(Enum):
    """Effect of a fault on a frame."""

    LOSE = auto()
    DELAY = auto()
    ABORT = auto()  # an SDO abort answers it
    REPEAT = auto()  # another device sends it as well


def _with_command(command: int, data: bytes) -> bytes:
    """Return an expedited upload response with another command byte and trailing garbage."""
    if not data or data[0] & 0xE2 != 0x42:
        return data
    size = FRAME_BYTES - (data[0] >> 2 & 0x03)
    return bytes((command,)) + data[1:size] + GARBAGE * (FRAME_BYTES - size)


def _shortened(data: bytes) -> bytes:
    """Return a response without its unused bytes."""
    match data[0] >> 5 if data else None:
        case 0:
            return data[: FRAME_BYTES - (data[0] >> 1 & 0x07)]
        case 1:
            return data[:1]
        case 2 if data[0] & 0x02:
            return data[: FRAME_BYTES - (data[0] >> 2 & 0x03)]
        case 3:
            return data[:MULTIPLEXER_BYTES]
    return data


def _with_other_crc(data: bytes) -> bytes:
    """Return the end frame of a block transfer with a wrong CRC; it has 5 reserved bytes."""
    ends = bool(data) and data[0] & 0xE3 == 0xC1 and not any(data[3:])
    return data[:1] + bytes(byte ^ 0xFF for byte in data[1:3]) + data[3:] if ends else data


SENT, RECEIVED = True, False
ALL_SERVICES = tuple(Service)
RANDOM = ('probability', 'count', 'seed')


@dataclass(frozen=True, slots=True)
class FaultKind:
    """A row of the table."""

    text: str  # what the device does, in words
    # which fields of :class:`FaultInjection` it uses, beside its duration
    settings: tuple[str, ...] = ()
    services: tuple[Service, ...] = ()  # whose frames it hits
    directions: tuple[bool, ...] = (SENT, RECEIVED)  # those that the device sends, or receives
    effect: Effect | Rewrite = Effect.LOSE  # what becomes of such a frame
    of_blocks: bool = False  # it hits SDO block transfers only
    of_drive: bool = False  # it belongs to an axis of a drive
    code: int = 0  # error code for 0x603F and EMCY (CiA 402-2); 0 for none
    at_once: bool = False  # the torque is gone at once, whatever fault reaction 0x605E selects
    # without a duration it goes on until it is ended; otherwise it is a moment, and a fault reset
    # ends it
    lasting: bool = True


def _frames(
    service: Service,
    sent: bool,
    text: str,
    *settings: str,
    effect: Effect | Rewrite = Effect.LOSE,
    of_blocks: bool = False,
) -> FaultKind:
    return FaultKind(text, settings, (service,), (sent,), effect, of_blocks)


_sdo_answers = partial(_frames, Service.SDO, SENT)
_sdo_requests = partial(_frames, Service.SDO, RECEIVED)
_sent_pdos = partial(_frames, Service.PDO, SENT)
_received_pdos = partial(_frames, Service.PDO, RECEIVED)


def _of_drive(text: str, code: int, *, at_once: bool = False, lasting: bool = False) -> FaultKind:
    return FaultKind(text, ('axis',), of_drive=True, code=code, at_once=at_once, lasting=lasting)


def _odd_drive(text: str, *settings: str) -> FaultKind:
    return FaultKind(text, ('axis', *settings), of_drive=True)


class Fault(Enum):
    """All faults; :attr:`label` is the name of a fault in services."""

    SDO_DELAY = _sdo_answers('answers SDOs late', 'object', 'delay', effect=Effect.DELAY)
    SDO_SILENCE = _sdo_requests('does not answer SDOs', 'object', *RANDOM)
    SDO_ABORT = _sdo_requests('aborts SDOs', 'object', 'abort', *RANDOM, effect=Effect.ABORT)
    SDO_FOUR_BYTES = _sdo_answers(
        'answers SDO reads of shorter objects with four bytes', effect=partial(_with_command, 0x43)
    )
    SDO_NO_SIZE = _sdo_answers(
        'leaves the size out of its SDO answers', effect=partial(_with_command, 0x42)
    )
    SDO_SHORT = _sdo_answers('leaves out the unused bytes of its SDO answers', effect=_shortened)
    BLOCK_ABORT = _sdo_requests(
        'aborts SDO block transfers', 'abort', effect=Effect.ABORT, of_blocks=True
    )
    BLOCK_SILENCE = _sdo_requests('does not answer SDO block transfers', of_blocks=True)
    BLOCK_CRC = FaultKind(
        'computes another CRC in SDO block transfers',
        services=(Service.SDO,),
        effect=_with_other_crc,
    )
    NODE_ID_CONFLICT = FaultKind(
        'shares its node id with another device, which answers, too',
        services=(Service.SDO, Service.HEARTBEAT, Service.BOOT_UP),
        directions=(SENT,),
        effect=Effect.REPEAT,
    )
    TPDO_LOSS = _sent_pdos('loses PDOs that it sends', 'pdo', *RANDOM)
    TPDO_DELAY = _sent_pdos('sends PDOs late', 'pdo', 'delay', *RANDOM, effect=Effect.DELAY)
    RPDO_LOSS = _received_pdos('misses PDOs', 'pdo', *RANDOM)
    RPDO_DELAY = _received_pdos('receives PDOs late', 'pdo', 'delay', *RANDOM, effect=Effect.DELAY)
    FRAME_LOSS = FaultKind('loses frames of both directions', RANDOM, ALL_SERVICES)
    HEARTBEAT_STOP = _frames(
        Service.HEARTBEAT, SENT, 'sends no heartbeat and answers no node guarding'
    )
    DISCONNECT = FaultKind('is cut off from the bus and goes on by itself', (), ALL_SERVICES)

    WRONG_IDENTITY = FaultKind(
        'shows the identity of another device',
        ('device_type', 'vendor', 'product', 'revision', 'serial'),
    )
    EMCY_FLOOD = FaultKind('sends the EMCY of its last error again and again', ('delay',))
    OBJECT_KEPT = FaultKind(
        'holds another value in an object than its EDS says, after each reset',
        ('object', 'value'),
    )
    POWER_OFF = FaultKind('has no power', ('position_kept',))
    REBOOT = FaultKind('restarts', ('position_kept',))

    OVER_CURRENT = _of_drive('too much current at the output', 0x2310, at_once=True)
    OVER_TEMPERATURE = _of_drive('the drive is too hot', 0x4310)
    OVER_VOLTAGE = _of_drive('the DC link has too much voltage', 0x3210)
    UNDER_VOLTAGE = _of_drive('the DC link has too little voltage', 0x3220, at_once=True)
    FOLLOWING_ERROR = _of_drive('the motor is too far from its demand', 0x8611)
    ENCODER_LOSS = _of_drive('the encoder gives no signal', 0x7305, at_once=True, lasting=True)
    BLOCKED_MOTOR = _of_drive('the motor is stuck', 0x7121, lasting=True)
    STO = _of_drive('safe torque off: no torque, and no fault', 0, at_once=True, lasting=True)

    HALT_IGNORED = _odd_drive('has no halt: bit 8 does nothing')
    QUICK_STOP_IGNORED = _odd_drive('has no quick stop: bit 2 does nothing')
    QUICK_STOP_FINAL = _odd_drive('is not enabled from Quick stop active (no transition 16)')
    MODE_REQUIRED = _odd_drive('refuses Operation enabled without a mode')
    MODE_ZERO_REFUSED = _odd_drive('refuses mode 0 in 0x6060')
    MODE_HELD_UNDER_HALT = _odd_drive('ignores 0x6060 while it is halted')
    ARRIVED_WHEN_DISABLED = _odd_drive('shows bits 10 and 12 in 0x6041 where it is not enabled')
    RATE_UNITS = _odd_drive(
        'counts velocities and accelerations in other units than its EDS says',
        'velocity',
        'acceleration',
    )
    ENCODER_SHIFTED = FaultKind(
        'reads another position from its encoder where it stands',
        ('axis', 'position'),
        of_drive=True,
        lasting=False,
    )

    @property
    def label(self) -> str:
        """Its name in services."""
        return self.name.lower()


FAULTS: dict[str, Fault] = {fault.label: fault for fault in Fault}  # faults by name


def _whole(text: str) -> int:
    value = int(text, 0)
    if not 0 <= value < 1 << 32:
        raise ValueError(text)
    return value


def _object(text: str) -> tuple[int, int]:
    match = re.fullmatch(r'(?:0x)?([0-9a-f]{4})(?:[:/]([0-9a-f]{1,2}))?', text, re.IGNORECASE)
    if match is None:
        raise ValueError(text)
    return int(match[1], 16), int(match[2] or '0', 16)


def _abort(text: str) -> int:
    name = text.upper()
    return AbortCode[name] if name in AbortCode.__members__ else _whole(text)


def _kept(text: str) -> bool:
    words = {'true': True, 'yes': True, 'kept': True, 'false': False, 'no': False, 'lost': False}
    word = words.get(text.lower())
    if word is None:
        raise ValueError(text)
    return word


class Setting(NamedTuple):
    """Parser and valid range of a setting."""

    read: Callable[[str], object]
    wanted: str
    allows: Callable[[Any], bool] = lambda value: True


_signed = partial(int, base=0)
WHOLE_NUMBER = Setting(_whole, 'a whole number, such as 10 or 0x0A')
COUNT = Setting(_whole, 'a whole number of 0 or more', lambda value: value >= 0)
TIME = Setting(float, 'a time of 0 s or more', lambda value: 0.0 <= value < float('inf'))
UNIT = Setting(
    float,
    'a unit above 0 in [inc/s] or [inc/s^2]',
    lambda value: value is None or 0.0 < value < float('inf'),
)
SETTINGS: dict[str, Setting] = {
    'duration': TIME,
    'delay': TIME,
    'probability': Setting(float, 'a number of 0 to 1', lambda value: 0.0 <= value <= 1.0),
    'count': COUNT,
    'pdo': COUNT,
    'axis': COUNT,
    'velocity': UNIT,
    'acceleration': UNIT,
    'position': Setting(_signed, 'a whole number of [inc]'),
    'value': Setting(_signed, 'a whole number, such as -1000 or 0x0A'),
    'object': Setting(_object, "an object, such as 0x6064 or '0x607D:02'"),
    'abort': Setting(_abort, 'an SDO abort code, such as 0x08000000 or general'),
    'position_kept': Setting(_kept, 'true or false'),
}
"""Settings that are not 32-bit integers, or have a smaller range."""


@dataclass(frozen=True, slots=True)
class FaultInjection:
    """One fault with its settings."""

    fault: Fault  # what goes wrong
    # how long in [s]; 0 until it is ended. Of a reboot: how long the power is off. Of most faults
    # of a drive 0 is a moment, so that a fault reset ends them.
    duration: float = 0.0
    delay: float = DELAY  # how late frames are in [s]
    probability: float = 1.0  # part of the frames in question that are hit, 0 to 1
    count: int = 0  # how many frames are hit, then the fault is over; 0 for no such limit
    seed: int = 0  # beginning of the random numbers; the same seed hits the same frames
    pdo: int = 0  # number of the PDO, from 1; 0 for all
    axis: int = 0  # number of the drive's axis, from 1; 0 for all
    object: tuple[int, int] | None = None  # index and sub-index; None for all
    abort: int = AbortCode.GENERAL  # SDO abort code
    # the encoder knows its position after power-on (absolute), or counts from 0 (incremental)
    position_kept: bool = True
    # what 0x1000 shows; None for the true value, as in those that follow
    device_type: int | None = None
    vendor: int | None = None  # what 0x1018:01 shows
    product: int | None = None  # what 0x1018:02 shows
    revision: int | None = None  # what 0x1018:03 shows
    serial: int | None = None  # what 0x1018:04 shows
    # what 1 of the velocities of the drive is in [inc/s]; None for its own unit
    velocity: float | None = None
    # what 1 of its accelerations is in [inc/s^2]; None for its own unit
    acceleration: float | None = None
    position: int = 0  # what the encoder reads in [inc]
    value: int = 0  # what the object holds

    def __post_init__(self) -> None:
        """Refuse invalid settings.

        Raises:
            ValueError: A number is out of range, or this fault has no such setting.
        """
        for name, setting in SETTINGS.items():
            if not setting.allows(value := getattr(self, name)):
                raise ValueError(f'{name} {value} is not {setting.wanted}')
        allowed = ('fault', 'duration', *self.fault.value.settings)
        for field in fields(self):
            if field.name not in allowed and getattr(self, field.name) != field.default:
                raise ValueError(f'{self.fault.label} has no setting {field.name!r}')

    @property
    def key(self) -> tuple[Fault, int, int, tuple[int, int] | None]:
        """Identifies fault and target; a new injection with the same key replaces this one."""
        return self.fault, self.pdo, self.axis, self.object

    @property
    def lasting(self) -> bool:
        """Whether the fault lasts until it is ended; otherwise it is momentary."""
        return self.fault.value.lasting or bool(self.duration)

    def __str__(self) -> str:
        """Describe the fault and its settings."""
        kind = self.fault.value
        parts = (
            f'{self.fault.label}: {kind.text}',
            '' if self.object is None else object_address(*self.object),
            self.pdo and f'PDO {self.pdo}',
            self.axis and f'axis {self.axis}',
            'delay' in kind.settings and f'by {self.delay:g} s',
            self.probability < 1.0 and f'with probability {self.probability:g}',
            self.count and f'{self.count} times',
            self.duration and f'for {self.duration:g} s',
        )
        return ', '.join(str(part) for part in parts if part)


def fault_list() -> str:
    """Return all faults with descriptions and settings, one per line."""
    return '\n'.join(
        f'  {name}: {fault.value.text} ({", ".join((*fault.value.settings, "duration"))})'
        for name, fault in FAULTS.items()
    )


def parse_fault(name: str, lines: Iterable[str], duration: float) -> FaultInjection:
    """Parse a fault from its name and lines ``name=value``, one for each setting.

    Raises:
        ValueError: A name is unknown, or a value is invalid; for an unknown fault the message
            lists all faults.
    """
    fault = FAULTS.get(name)
    if fault is None:
        raise ValueError(f'{unknown("fault", name, FAULTS)}\nnone: ends all\n{fault_list()}')
    known = ('duration', *fault.value.settings)
    values: dict[str, object] = {}
    for line in lines:
        setting, equals, text = line.partition('=')
        setting = setting.strip()
        if not equals or not setting:
            raise ValueError(f"{line!r} is not a setting; write 'name=value'")
        if setting in values:
            raise ValueError(f'{setting!r} stands twice')
        if setting not in known:
            raise ValueError(unknown(f'setting of {name}', setting, known))
        reader = SETTINGS.get(setting, WHOLE_NUMBER)
        try:
            values[setting] = reader.read(text.strip())
        except ValueError:
            raise ValueError(f'{setting} is {text.strip()!r}; expected {reader.wanted}') from None
    # the class checks its arguments
    return FaultInjection(fault, **{'duration': duration, **values})  # type: ignore[arg-type]


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Return a message that a name is unknown, with the most similar name, or all names."""
    names = list(known)
    close = difflib.get_close_matches(name, names, n=1)
    remedy = f'did you mean {close[0]!r}?' if close else f'choose one of {", ".join(names)}'
    return f'unknown {what} {name!r}; {remedy}'
