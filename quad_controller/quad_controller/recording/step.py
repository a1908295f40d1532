# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One recorded step as a message: quad_msgs/msg/ControllerStep, without ROS.

:data:`FIELDS` says what the message has and in which order; its definition, its bytes (CDR, little
endian) and what is read back all follow from it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
import math
import struct
from typing import Any

import numpy as np

from quad_description import ImuSample, JointSample

from ..gait.velocity import Velocity
from ..policy.interface import PolicyInputs
from ..policy.network import Floats
from ..states.status import Output

TYPE = 'quad_msgs/msg/ControllerStep'
ENCAPSULATION = b'\0\1\0\0'  # CDR, little endian
NS = 1_000_000_000
TIME_DEFINITION = f'{"=" * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n'


class Kind(Enum):
    """Kinds of fields; the value is the name in a definition."""

    TEXT = 'string'
    COUNT = 'uint32'
    NUMBER = 'float64'
    NUMBERS = 'float32[]'


FIELDS: Mapping[str, tuple[Kind, str]] = {
    'state': (Kind.TEXT, 'mode, with the way to it'),
    'policy': (Kind.TEXT, 'that was asked; empty for none'),
    'policy_digest': (Kind.TEXT, 'SHA-256 of its file'),
    'policy_step': (Kind.COUNT, 'how often it was stepped since its reset; 1 for the first'),
    'dt': (Kind.NUMBER, '[s] since the step before'),
    'computing': (Kind.NUMBER, '[s] from the begin of the step to the command'),
    'latency': (Kind.NUMBER, '[s] from joint states to the command; NaN without'),
    'position': (Kind.NUMBERS, '[rad] measured; empty when older than hold_age'),
    'velocity': (Kind.NUMBERS, '[rad/s] measured; empty when not'),
    'target': (Kind.NUMBERS, '[rad] commanded; empty for none'),
    'orientation': (Kind.NUMBERS, 'of the body, x y z w; empty when not known'),
    'angular_velocity': (Kind.NUMBERS, '[rad/s] of the body; empty when not measured'),
    'acceleration': (Kind.NUMBERS, '[m/s2] specific force; empty when not measured'),
    'linear_velocity': (Kind.NUMBERS, '[m/s] of the body, estimated; empty when not'),
    'command': (Kind.NUMBERS, 'x, y [m/s] and yaw [rad/s] that count'),
    'observation': (Kind.NUMBERS, 'what the network was given; empty when not asked'),
    'action': (Kind.NUMBERS, 'what it answered; empty when not asked'),
    'foot_contacts': (Kind.NUMBERS, '1 for a foot on the ground, else 0; empty when not known'),
}
"""Kind and meaning of each field after the stamp, in the order of the message."""

ADDED = frozenset({'foot_contacts'})
"""Fields that recordings of before do not have; they stand at the end."""


def definition() -> str:
    """Return the definition of the message with that of its stamp, as recordings have it."""
    lines = [f'{kind.value} {name}' for name, (kind, _) in FIELDS.items()]
    return '\n'.join(['builtin_interfaces/Time stamp', *lines, TIME_DEFINITION])


@dataclass(frozen=True, slots=True)
class StepTiming:
    """Times of a step."""

    stamp: int  # when it was sent in [ns since 1970]
    dt: float  # since the step before in [s]
    computing: float  # from its begin to the command in [s]
    latency: float | None  # from the joint states to the command in [s]; None without


@dataclass(frozen=True, slots=True)
class StepRecord:
    """A step; the values are those of :data:`FIELDS`."""

    stamp: int
    values: Mapping[str, Any]

    @property
    def inputs(self) -> PolicyInputs | None:
        """What a policy may see of it; None when joints or attitude were not known."""
        get = self.values.__getitem__
        if not (len(get('position')) and len(get('orientation'))):
            return None
        return PolicyInputs(
            JointSample(tuple(get('position').tolist()), _vector(get('velocity'))),
            ImuSample(
                tuple(get('orientation').tolist()),
                _vector(get('angular_velocity')),
                _vector(get('acceleration')),
            ),
            Velocity(*get('command').tolist()),
            _vector(get('linear_velocity')),
            tuple(map(bool, get('foot_contacts'))) or None,
        )


def record_of(output: Output, timing: StepTiming) -> StepRecord:
    """Return a step as it is recorded."""
    situation, asked = output.situation, output.asked
    joints = situation.joints if situation is not None else None
    imu = situation.imu if situation is not None else None
    velocity = situation.velocity if situation is not None else Velocity()
    answer = asked.answer if asked is not None else None
    values = {
        'state': output.title,
        'policy': asked.policy.name if asked is not None else '',
        'policy_digest': asked.policy.digest if asked is not None else '',
        'policy_step': asked.step if asked is not None else 0,
        'dt': timing.dt,
        'computing': timing.computing,
        'latency': math.nan if timing.latency is None else timing.latency,
        'position': joints.positions if joints is not None else (),
        'velocity': (joints.velocities if joints is not None else None) or (),
        'target': output.targets or (),
        'orientation': imu.orientation if imu is not None else (),
        'angular_velocity': (imu.angular_velocity if imu is not None else None) or (),
        'acceleration': (imu.acceleration if imu is not None else None) or (),
        'linear_velocity': (situation.linear_velocity if situation is not None else None) or (),
        'command': (velocity.x, velocity.y, velocity.yaw),
        'observation': answer.observation if answer is not None else None,
        'action': answer.action if answer is not None else None,
        'foot_contacts': (situation.foot_contacts if situation is not None else None) or (),
    }
    return StepRecord(timing.stamp, values)


def pack(step: StepRecord) -> bytes:
    """Return a step as bytes."""
    data = bytearray(struct.pack('<iI', *divmod(step.stamp, NS)))
    for name, (kind, _) in FIELDS.items():
        PACK[kind](data, step.values[name])
    return ENCAPSULATION + bytes(data)


def unpack(data: bytes) -> StepRecord:
    """Return the step of some bytes.

    Raises:
        ValueError: They are none.
    """
    if data[:4] != ENCAPSULATION:
        raise ValueError('no message in little endian CDR')
    view = memoryview(data)[4:]
    try:
        seconds, rest = struct.unpack_from('<iI', view)
        place, values = 8, {}
        for name, (kind, _) in FIELDS.items():
            if name in ADDED and place == len(view):
                values[name] = np.empty(0, '<f4')
                continue
            values[name], place = UNPACK[kind](view, place)
    except (struct.error, UnicodeDecodeError) as error:
        raise ValueError(f'no {TYPE}: {error}') from error
    return StepRecord(seconds * NS + rest, values)


def _vector(numbers: Floats) -> Any:  # noqa: ANN401  # as long as the field is
    return tuple(numbers.tolist()) if len(numbers) else None


def _align(data: bytearray, size: int) -> None:
    data += b'\0' * (-len(data) % size)


def _pack_text(data: bytearray, text: str) -> None:
    encoded = text.encode() + b'\0'
    _align(data, 4)
    data += struct.pack('<I', len(encoded)) + encoded


def _pack_count(data: bytearray, value: int) -> None:
    _align(data, 4)
    data += struct.pack('<I', value)


def _pack_number(data: bytearray, value: float) -> None:
    _align(data, 8)
    data += struct.pack('<d', value)


def _pack_numbers(data: bytearray, values: Any) -> None:  # noqa: ANN401  # a sequence or array
    array = np.asarray(() if values is None else values, '<f4').ravel()
    _align(data, 4)
    data += struct.pack('<I', len(array)) + array.tobytes()


def _unpack_text(view: memoryview, place: int) -> tuple[str, int]:
    size, place = _unpack_count(view, place)
    return bytes(view[place : place + size - 1]).decode(), place + size


def _unpack_count(view: memoryview, place: int) -> tuple[int, int]:
    place += -place % 4
    return struct.unpack_from('<I', view, place)[0], place + 4


def _unpack_number(view: memoryview, place: int) -> tuple[float, int]:
    place += -place % 8
    return struct.unpack_from('<d', view, place)[0], place + 8


def _unpack_numbers(view: memoryview, place: int) -> tuple[Floats, int]:
    size, place = _unpack_count(view, place)
    return np.frombuffer(view, '<f4', size, place), place + 4 * size


PACK: Mapping[Kind, Callable[[bytearray, Any], None]] = {
    Kind.TEXT: _pack_text,
    Kind.COUNT: _pack_count,
    Kind.NUMBER: _pack_number,
    Kind.NUMBERS: _pack_numbers,
}
UNPACK: Mapping[Kind, Callable[[memoryview, int], tuple[Any, int]]] = {
    Kind.TEXT: _unpack_text,
    Kind.COUNT: _unpack_count,
    Kind.NUMBER: _unpack_number,
    Kind.NUMBERS: _unpack_numbers,
}
