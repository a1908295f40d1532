# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The table of protocol v2: main and sub codes, states pushed at 50 Hz, 2 Mbaud.

OUR ASSUMPTION. The vendor has not published this layout. What is stated about it: header and
tail, a checksum, main and sub codes, a state frame of 254 bytes about 50 times a second, the valid
attitude ``euler2`` at offsets 20 to 31, 16 joint angles [deg] and 16 joint velocities [deg/s],
battery, acceleration of about 9.8 at rest, no raw gyro and no gravity. Everything else here is
chosen so that all of that holds; when the vendor's table is known, this file is what changes.
Numbers are little-endian.
"""

from __future__ import annotations

from enum import IntEnum, IntFlag

from .motors import MOTOR_ORDER
from .schema import Access, Field, Function, Kind, Protocol, Scalar, table

SLOTS = len(MOTOR_ORDER)
ALL_MOTORS = 0xFF


class Code(IntEnum):
    """Addresses, ``main << 8 | sub``."""

    VERSION = 0x0101
    BATTERY = 0x0102
    FEEDBACK = 0x0103
    FEEDBACK_RATE = 0x0104
    STATE = 0x0110
    SERVO = 0x0201
    SERVOS = 0x0202
    TORQUE = 0x0203
    SPEED = 0x0204


class Refusal(IntEnum):
    """Reasons in the payload of a NACK."""

    UNKNOWN_FUNCTION = 1
    WRONG_LENGTH = 2
    WRONG_VALUE = 3
    WRONG_ACCESS = 4


class Fault(IntFlag):
    """Fault bits of the state frame."""

    LOW_BATTERY = 1
    OVERLOAD = 2
    OVERHEATED = 4
    SERVO_SILENT = 8
    IMU = 16


STATE = Function(
    Code.STATE,
    'state',
    Access.PUSH,
    (
        Field('battery', Scalar.U8, 0, unit='%'),
        Field('mode', Scalar.U8, 1),
        Field(
            'faults', Scalar.U16, 2, meaning='1 low battery, 2 overload, 4 hot, 8 servo, 16 IMU'
        ),
        Field('device_time', Scalar.U32, 4, unit='ms'),
        Field('euler1', Scalar.F32, 8, 3, unit='deg', meaning='not fused: to be ignored'),
        Field('euler2', Scalar.F32, 20, 3, unit='deg', meaning='roll, pitch, yaw; the valid one'),
        Field('acceleration', Scalar.F32, 32, 3, unit='m/s²', meaning='specific force, +g up'),
        Field('position', Scalar.F32, 44, SLOTS, unit='deg', meaning='in the order of motors'),
        Field('velocity', Scalar.F32, 108, SLOTS, unit='deg/s', meaning='in the order of motors'),
        Field('load', Scalar.I16, 172, SLOTS, 0.1, '%', 'in the order of motors'),
        Field('temperature', Scalar.U8, 204, SLOTS, unit='°C', meaning='in the order of motors'),
        Field('battery_voltage', Scalar.U16, 220, scale=0.001, unit='V'),
        Field('sequence', Scalar.U16, 222, meaning='counts frames, to notice lost ones'),
    ),
    'the state of the robot',
    size=245,
)

V2 = Protocol(
    name='v2',
    origin='our assumption; the vendor’s layout is not public',
    baud=2_000_000,
    address_size=2,
    kinds=frozenset(Kind),
    max_length=254,
    functions=table(
        Function(
            Code.VERSION,
            'version',
            Access.READ,
            (Field('text', Scalar.U8, count=10),),
            'firmware, ASCII padded with NUL',
        ),
        Function(
            Code.BATTERY,
            'battery',
            Access.READ,
            (Field('value', Scalar.U8, unit='%'),),
            '0 to 100',
        ),
        Function(
            Code.FEEDBACK, 'feedback', Access.WRITE, (Field('on', Scalar.U8),), '1 pushes states'
        ),
        Function(
            Code.FEEDBACK_RATE,
            'feedback_rate',
            Access.WRITE,
            (Field('rate', Scalar.U8, unit='Hz'),),
            'rate of the states',
        ),
        STATE,
        Function(
            Code.SERVO,
            'servo',
            Access.WRITE,
            (Field('motor', Scalar.U8), Field('angle', Scalar.F32, 1, unit='deg')),
            'angle of one servo',
        ),
        Function(
            Code.SERVOS,
            'servos',
            Access.WRITE,
            (Field('motor', Scalar.U8), Field('angle', Scalar.I16, 1, scale=0.01, unit='deg')),
            'angles of several servos, three bytes each',
            repeated=True,
        ),
        Function(
            Code.TORQUE,
            'torque',
            Access.WRITE,
            (Field('motor', Scalar.U8, meaning='FF all'), Field('on', Scalar.U8, 1)),
            '1 holds, 0 lets go',
        ),
        Function(
            Code.SPEED,
            'speed',
            Access.WRITE,
            (Field('motor', Scalar.U8, meaning='FF all'), Field('speed', Scalar.U8, 1)),
            '1 to 255',
        ),
    ),
)
