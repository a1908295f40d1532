# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Servo ids and protocol tables.

The id of a servo is ``10 * leg + joint``: legs count 1 left front, 2 right front, 3 right rear,
4 left rear; joints 1 calf, 2 thigh, 3 hip, which is the reverse of the order in a URDF. 51 is the
gripper, 52 to 54 are the arm from the elbow to its yaw. Sources: the vendor's Luwu-OS
(robot_tools), its Python library and the limits in its micro:bit library.

v1, one-byte registers at 115200 baud, is public: the vendor's serial protocol page and its Python
libraries (XGO-PythonLib 1.0.0, xgolib 1.1.5). A register is a function code, not a memory cell:
0x62 answers four bytes, 0x63 four others. Multi-byte writes do run through consecutive codes.
Numbers of several bytes are little-endian in 0x62 to 0x65 and big-endian elsewhere.

v2, main and sub codes and states pushed at 50 Hz, at 2 Mbaud, is OUR ASSUMPTION. The vendor has
not published this layout. What is stated about it: header and tail, a checksum, main and sub
codes, a state frame of 254 bytes about 50 times a second, the valid attitude ``euler2`` at offsets
20 to 31, 16 joint angles [deg] and 16 joint velocities [deg/s], battery, acceleration of about 9.8
at rest, no raw gyro and no gravity. Everything else here is chosen to agree with that; once the
vendor's table is known, only this file changes. Numbers are little-endian.

``developer`` is the firmware for developers of the XGO-Mini, by the vendor's page "Develop mode"
(https://www.xgorobot.com/XgoWiki-en/wiki/1%20XGO-Mini/For%20XGO%20developer/Develop%20mode/): 1
Mbaud, nothing can be read, and a frame of 33 bytes comes at 50 Hz: ``55 00 21 00 00``, roll, pitch
and yaw as float32, the servos of the legs (measured at about 26 Hz) and the charge in a byte each,
checksum, ``00 AA``: a frame of v1 whose TYPE and address are zero. OUR ASSUMPTIONS, where the page
is silent: degrees; ranges of the mini, checksum, and writes of angles and torque as in v1 (torque
is not in the page's list of what is left). The byte order of the floats is recognised. How the PID
of the servos is set is not documented, so it is not offered.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from enum import IntEnum, IntFlag
from types import MappingProxyType
from typing import Any

from .frame import Access, Field, Function, Kind, Model, Protocol, Scalar, Span, table

LEG_MOTORS = (11, 12, 13, 21, 22, 23, 31, 32, 33, 41, 42, 43)
ARM_MOTORS = (51, 52, 53, 54)
MOTOR_ORDER = LEG_MOTORS + ARM_MOTORS  # slots of the feedback frame
BULK_READ_ORDER = MOTOR_ORDER[:15]  # what reading 15 bytes at 0x50 answers (v1)

_SLOT = {motor: slot for slot, motor in enumerate(MOTOR_ORDER)}

MOTOR_OF_JOINT: Mapping[str, int] = MappingProxyType(
    {
        f'{leg}_{joint}_joint': 10 * number + digit
        for leg, number in (('fl', 1), ('fr', 2), ('bl', 4), ('br', 3))
        for joint, digit in (('hip', 3), ('thigh', 2), ('calf', 1))
    }
    | {'arm_yaw_joint': 54, 'arm_thigh_joint': 53, 'arm_calf_joint': 52, 'hand_right_joint': 51}
)


Ends = tuple[float, float]


def _angles(calf: Ends, thigh: Ends, hip: Ends, elbow: Ends, shoulder: Ends) -> dict[int, Span]:
    ends = {motor: (calf, thigh, hip)[motor % 10 - 1] for motor in LEG_MOTORS}
    ends |= {51: (-65, 65), 52: elbow, 53: shoulder, 54: (-175, 175)}
    return {motor: Span(*each) for motor, each in ends.items()}


# What the byte of a servo angle spreads over [deg] (quad.md 1.3); 54 moves on mini2SW and mini3W.
ANGLE_SPANS: Mapping[Model, Mapping[int, Span]] = MappingProxyType(
    {
        Model.MINI: _angles((-73, 57), (-66, 93), (-31, 31), (-85, 50), (-75, 90)),
        Model.LITE: _angles((-70, 50), (-70, 90), (-30, 30), (-115, 70), (-85, 100)),
        Model.WHEELED: _angles((-70, 50), (-70, 90), (-30, 30), (-50, 83), (-90, 90)),
    }
)


def slot_of(motor: int) -> int:
    """Return the index of a motor in :data:`MOTOR_ORDER`.

    Raises:
        ValueError: The motor is unknown; the message lists the known ones.
    """
    try:
        return _SLOT[motor]
    except KeyError:
        known = ', '.join(map(str, MOTOR_ORDER))
        raise ValueError(f'no motor has id {motor}; there are {known}') from None


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
    """Reason codes in the payload of a NACK."""

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


R, W, RW = Access.READ, Access.WRITE, Access.READ | Access.WRITE

Spans = Mapping[Model, Span]


def _byte(
    code: int,
    name: str,
    meaning: str,
    spans: Spans | None = None,
    unit: str = '',
    *,
    access: Access = W,
) -> Function:
    field = Field('value', Scalar.U8)
    return Function(code, name, access, (field,), meaning, spans=spans or {}, unit=unit)


def _row(
    code: int,
    name: str,
    access: Access,
    meaning: str,
    *fields: Field,
    **more: Any,  # noqa: ANN401
) -> Function:
    return Function(code, name, access, fields, meaning, **more)


_TEXT, _MOTOR = Field('text', Scalar.U8, count=10), Field('motor', Scalar.U8)
_MOTORS = Field('motor', Scalar.U8, meaning='FF all')
STATE = _row(
    Code.STATE,
    'state',
    Access.PUSH,
    'the state of the robot',
    Field('battery', Scalar.U8, 0, unit='%'),
    Field('mode', Scalar.U8, 1),
    Field('faults', Scalar.U16, 2, meaning='1 low battery, 2 overload, 4 hot, 8 servo, 16 IMU'),
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
    size=245,
)


def _v2_rows() -> Iterator[Function]:
    yield _row(Code.VERSION, 'version', R, 'firmware, ASCII padded with NUL', _TEXT)
    charge = Field('value', Scalar.U8, unit='%')
    yield _row(Code.BATTERY, 'battery', R, '0 to 100', charge)
    on, rate = Field('on', Scalar.U8), Field('rate', Scalar.U8, unit='Hz')
    yield _row(Code.FEEDBACK, 'feedback', W, '1 pushes states', on)
    yield _row(Code.FEEDBACK_RATE, 'feedback_rate', W, 'rate of the states', rate)
    yield STATE
    angle = Field('angle', Scalar.F32, 1, unit='deg')
    yield _row(Code.SERVO, 'servo', W, 'angle of one servo', _MOTOR, angle)
    angle = Field('angle', Scalar.I16, 1, scale=0.01, unit='deg')
    meaning = 'angles of several servos, three bytes each'
    yield _row(Code.SERVOS, 'servos', W, meaning, _MOTOR, angle, repeated=True)
    on, speed = Field('on', Scalar.U8, 1), Field('speed', Scalar.U8, 1)
    yield _row(Code.TORQUE, 'torque', W, '1 holds, 0 lets go', _MOTORS, on)
    yield _row(Code.SPEED, 'speed', W, '1 to 255', _MOTORS, speed)


V2 = Protocol(
    name='v2',
    origin='our assumption; the vendor’s layout is not public',
    baud=2_000_000,
    address_size=2,
    kinds=frozenset(Kind),
    max_length=254,
    functions=table(*_v2_rows()),
)


GRAVITY = 9.8  # [m/s²] what the vendor's library multiplies the accelerometer's g with
ACCELERATION_STEP = GRAVITY / 16384  # [m/s²]
RATE_STEP = 1 / 16.4  # [deg/s]


class Register(IntEnum):
    """Register codes that the driver uses by name."""

    BATTERY = 0x01
    FIRMWARE = 0x07
    TORQUE = 0x20
    VX = 0x30
    VY = 0x31
    VYAW = 0x32
    ACTION = 0x3E
    MOTORS = 0x50
    MOTOR_SPEED = 0x5C
    BALANCE = 0x61
    IMU = 0x65


class Torque(IntEnum):
    """Values of register 0x20; the last two are added to a leg number (1 to 4, 5 the arm)."""

    UNLOAD_ALL = 0x01
    LOAD_ALL = 0x00
    UNLOAD_LEG = 0x10
    LOAD_LEG = 0x20


ACTION_RESET = 255  # of register 0x3E: stop and stand in the default pose

ARM_REGISTERS: Mapping[int, int] = {51: 0x71, 52: 0x5D, 53: 0x5E, 54: 0x70}
MOTOR_OF_REGISTER: Mapping[int, int] = {
    **{Register.MOTORS + index: motor for index, motor in enumerate(LEG_MOTORS)},
    **{register: motor for motor, register in ARM_REGISTERS.items()},
}
REGISTER_OF_MOTOR: Mapping[int, int] = {m: r for r, m in MOTOR_OF_REGISTER.items()}


def _spans(mini: tuple[float, float], lite: tuple[float, float] | None = None) -> Spans:
    """Return ranges by model; mini2SW and mini3W are assumed to equal the mini."""
    low, high = Span(*mini), Span(*(lite or mini))
    return {Model.MINI: low, Model.LITE: high, Model.WHEELED: low}


def _float(code: int, name: str) -> Function:
    return _row(code, name, R, 'attitude', Field('value', Scalar.F32, unit='deg'))


def _system_rows() -> Iterator[Function]:
    yield _byte(0x01, 'battery', '0 to 100', unit='%', access=R)
    yield _byte(0x03, 'perform', '1 loops the demo actions, 0 stops')
    yield _byte(0x04, 'calibration', '1 starts, 0 ends and stores the servo zeros: dangerous')
    yield _byte(0x05, 'upgrade', '1: the board answers 0x55, then takes firmware at 350000 baud')
    yield _byte(0x06, 'set_origin', '1 makes the present attitude the origin')
    yield _row(
        0x07,
        'firmware',
        R,
        'ASCII, padded with NUL; M mini, L lite, R rider, W or MW wheeled',
        _TEXT,
    )
    yield _byte(0x09, 'gait', '0 trot, 1 walk, 2 high walk, 3 slow trot')
    yield _row(0x13, 'bluetooth_name', W, 'ASCII, up to 10 characters', _TEXT, variable=True)
    yield _byte(0x20, 'torque', '01 unload all, 00 load all, 10+leg unload, 20+leg load')
    yield _byte(0x21, 'teach_record', 'pose id')
    yield _byte(0x22, 'teach_play', 'pose id')
    yield _byte(0x23, 'teach_arm_record', 'pose id')
    yield _byte(0x24, 'teach_arm_play', 'pose id')


def _motion_rows() -> Iterator[Function]:
    yield _byte(0x30, 'vx', 'step length forward, 0x80 stops', _spans((-25, 25)), 'mm')
    yield _byte(0x31, 'vy', 'step length left, 0x80 stops', _spans((-18, 18)), 'mm')
    yield _byte(0x32, 'vyaw', 'turning rate, 0x80 stops', _spans((-100, 100)), 'deg/s')
    yield _byte(0x33, 'body_x', 'body translation', _spans((-35, 35), (-25, 25)), 'mm')
    yield _byte(0x34, 'body_y', 'body translation', _spans((-19.5, 19.5), (-18, 18)), 'mm')
    yield _byte(0x35, 'body_z', 'body height', _spans((75, 120), (60, 110)), 'mm')
    yield _byte(0x36, 'body_roll', 'body attitude', _spans((-20, 20)), 'deg')
    yield _byte(0x37, 'body_pitch', 'body attitude', _spans((-22, 22), (-10, 10)), 'deg')
    yield _byte(0x38, 'body_yaw', 'body attitude', _spans((-16, 16), (-12, 12)), 'deg')
    for code, axis in enumerate(('roll', 'pitch', 'yaw'), 0x39):
        yield _byte(code, f'swing_{axis}', '0 off, 1 to 255: period 8 to 1.5 s')
    for code, axis in enumerate('xyz', 0x80):
        yield _byte(code, f'sway_{axis}', '0 off, 1 to 255: period 8 to 1.5 s')
    yield _byte(0x3C, 'mark_time', 'lift height, 0 off', _spans((10, 35), (10, 25)), 'mm')
    yield _byte(0x3D, 'pace', '0 normal, 1 slow, 2 high')
    yield _byte(0x3E, 'action', '1 to 24, 128 to 130, 144; 255 stands in the default pose')
    turn = Field('value', Scalar.I16_BE, unit='deg')
    meaning = 'turns by an angle; reading one byte answers 1 when done'
    yield _row(0x3F, 'turn_by', RW, meaning, turn, variable=True)
    axes = (
        ('x', _spans((-35, 35), (-25, 25))),
        ('y', _spans((-18, 18))),
        ('z', _spans((75, 115), (60, 110))),
    )
    legs = ((leg, axis) for leg in range(1, 5) for axis in axes)
    for code, (leg, (axis, spans)) in enumerate(legs, 0x40):
        yield _byte(code, f'foot_{leg}_{axis}', 'foot position', spans, 'mm')


def _servo_rows() -> Iterator[Function]:
    for code, motor in sorted(MOTOR_OF_REGISTER.items()):
        spans = {model: angles[motor] for model, angles in ANGLE_SPANS.items()}
        access = RW if motor in LEG_MOTORS else W
        meaning = 'servo angle; a write of 12 bytes at 50 sets all legs'
        if motor not in LEG_MOTORS:
            meaning = 'servo angle; 51 to 53 are read as bytes 13 to 15 of 50'
        yield _byte(code, f'motor_{motor}', meaning, spans, 'deg', access=access)
    yield _byte(0x5C, 'motor_speed', '1 to 255; only for commands to a single servo')
    yield _byte(0x5F, 'middle', '1 moves all servos to the middle of their range')
    for code, bus_servo in enumerate(range(91, 100), 0xA1):
        angle = Field('value', Scalar.U16_BE, scale=360 / 4096, unit='deg')
        yield _row(code, f'bus_servo_{bus_servo}', W, '12 bits, 0 is -180 degrees', angle)
    yield _byte(0xB0, 'wheels_enable', '1 enables the wheels (mini3W)')
    wheels = Field('values', Scalar.U8, count=4)
    yield _row(0xB1, 'wheels', W, 'four wheels, 0x80 stops (mini3W)', wheels)


def _sensor_rows() -> Iterator[Function]:
    yield _byte(0x61, 'balance', '1: the board levels the body')
    for code, axis in enumerate(('roll', 'pitch', 'yaw'), 0x62):
        yield _float(code, axis)
    yield _row(
        0x65,
        'imu',
        R,
        'all of the IMU',
        Field('acceleration', Scalar.I16, 0, 3, ACCELERATION_STEP, 'm/s²'),
        Field('rate', Scalar.I16, 6, 3, RATE_STEP, 'deg/s'),
        Field('attitude', Scalar.F32, 12, 3, unit='deg', meaning='roll, pitch, yaw'),
    )
    for code, axis in enumerate(('roll', 'pitch', 'yaw'), 0x66):
        angle = Field('value', Scalar.I16_BE, unit='deg')
        yield _row(code, f'{axis}_int', R, 'attitude, whole degrees', angle)
    yield _row(0x69, 'led', W, 'red, green, blue', Field('values', Scalar.U8, count=3))
    for code, name in enumerate(('analog_out', 'digital_out'), 0x90):
        yield _byte(code, name, 'value')
    for code, name in enumerate(('analog_in', 'digital_in'), 0x92):
        yield _byte(code, name, 'value', access=R)


def _arm_rows() -> Iterator[Function]:
    yield _byte(0x72, 'arm_mode', '1 keeps the gripper where it is while the body moves')
    yield _byte(0x73, 'arm_x', 'gripper position', _spans((-80, 155)), 'mm')
    yield _byte(0x74, 'arm_z', 'gripper position', _spans((-95, 155)), 'mm')
    yield _byte(0x75, 'arm_speed', '1 to 255')
    yield _byte(0x76, 'arm_theta', 'polar position', _spans((70, 270)), 'deg')
    yield _byte(0x77, 'arm_r', 'polar position', _spans((80, 140)), 'mm')


V1 = Protocol(
    name='v1',
    origin='public: the vendor’s protocol page and Python libraries',
    baud=115200,
    address_size=1,
    kinds=frozenset({Kind.WRITE, Kind.READ, Kind.REPLY}),
    other_write=0x01,  # XGO-PythonLib 1.1.8
    functions=table(
        *sorted(
            (*_system_rows(), *_motion_rows(), *_servo_rows(), *_sensor_rows(), *_arm_rows()),
            key=lambda row: row.address,
        )
    ),
)


PUSHED = _row(
    0x00,
    'state',
    Access.PUSH,
    'what is pushed; servos as in v1',
    Field('attitude', Scalar.F32, 0, 3, unit='deg', meaning='roll, pitch, yaw; in either order'),
    Field('motor', Scalar.U8, 12, len(LEG_MOTORS), meaning='in the order of motors'),
    Field('battery', Scalar.U8, 24, unit='%'),
)
DEVELOPER = Protocol(
    name='developer',
    origin='public: the vendor’s page “Develop mode”; what it leaves open is assumed',
    baud=1_000_000,
    address_size=1,
    kinds=frozenset({Kind.WRITE}),
    functions=table(
        PUSHED,
        V1.functions[Register.TORQUE],
        *(replace(V1.functions[REGISTER_OF_MOTOR[motor]], access=W) for motor in LEG_MOTORS),
    ),
)
DEVELOPER_FIRMWARE = 'M developer'  # as we call it: it names no version, and is of a mini


def swap_floats(pushed: bytes) -> bytes:
    """Swap the byte order of the floats in a developer firmware frame."""
    return b''.join(pushed[at : at + 4][::-1] for at in (0, 4, 8)) + pushed[12:]


def scatter(address: int, payload: bytes) -> Iterator[tuple[int, bytes]]:
    """Split a multi-byte write into single registers.

    Yields:
        Register and its bytes; a register that the table lacks takes one byte.
    """
    start = 0
    while start < len(payload):
        function = V1.functions.get(address)
        size = function.length if function else 1
        yield address, payload[start : start + size]
        start += size
        address += 1


def model_of_firmware(firmware: str) -> Model | None:
    """Return the model from the prefix of a firmware version; None if unknown."""
    if firmware.startswith(('MW', 'W')):
        return Model.WHEELED
    return {'M': Model.MINI, 'L': Model.LITE}.get(firmware[:1])
