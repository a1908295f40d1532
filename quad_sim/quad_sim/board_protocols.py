# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Board side of the protocols: registers of v1, functions and pushed states of v2.

All registers of v1 are writable; those without a function here (teaching, LED, body swing, actions
other than 1, 2 and 255) only store their bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
import math

from quad_description.rotations import Vector
from quad_hardware import CodecError
from quad_hardware.protocol import (
    Access,
    ACTION_RESET,
    ANGLE_SPANS,
    BULK_READ_ORDER,
    Code,
    DEVELOPER,
    Frame,
    Kind,
    MOTOR_OF_REGISTER,
    Refusal,
    Register,
    scatter,
    slot_of,
    STATE,
    swap_floats,
    Torque,
    V1,
    V2,
)

from .board import Board, DUTY, HEIGHT, LIFT, STRIDE_TIME
from .state import Measurement

ALL_MOTORS = 0xFF
DEFAULT_RATE, MAX_RATE = 50.0, 100.0  # [Hz]
_CLOCK, _COUNT = 1 << 32, 1 << 16  # where device time and sequence begin anew

Values = dict[str, tuple[float, ...]]


class RefusedError(Exception):
    """A frame requests something unsupported; the board answers with a NACK."""

    def __init__(self, reason: Refusal) -> None:
        super().__init__(reason.name)
        self.reason = reason


class Functions:
    """Handles frames of protocol v2 and pushes states."""

    protocol = V2

    def __init__(self, board: Board) -> None:
        """Start with feedback disabled."""
        self._board = board
        self._readers: dict[int, Callable[[], Values]] = {
            Code.VERSION: self._version,
            Code.BATTERY: lambda: {'value': (self._board.battery.percent,)},
        }
        self._writers: dict[int, Callable[[Values], None]] = {
            Code.FEEDBACK: self._set_feedback,
            Code.FEEDBACK_RATE: self._set_rate,
            Code.SERVO: self._move_one,
            Code.SERVOS: self._move_many,
            Code.TORQUE: self._set_torque,
            Code.SPEED: self._set_speed,
        }
        self.restart()

    def restart(self) -> None:
        """Reset the host's settings, as after power-up."""
        self._on = False
        self._period = 1.0 / DEFAULT_RATE
        self.next_push = math.inf  # when a state is due [s]; infinity without feedback
        self._sequence = 0

    def handle(self, frame: Frame, now: float) -> list[Frame]:
        """Execute a frame; return the board's answer."""
        try:
            answer = self._carry_out(frame)
        except RefusedError as refused:
            return [Frame(Kind.NACK, frame.address, bytes((refused.reason,)))]
        if self._on and self.next_push == math.inf:
            self.next_push = now
        return [answer] if answer else []

    def push(self, now: float) -> Frame:
        """Return the state that is due, and schedule the next one."""
        self.next_push += self._period
        if self.next_push < now:  # held up: go on from here, do not send a burst
            self.next_push = now + self._period
        state = STATE.pack(**self._state(self._board.measure()))
        self._sequence = (self._sequence + 1) % _COUNT
        return Frame(Kind.PUSH, STATE.address, state)

    def _carry_out(self, frame: Frame) -> Frame | None:
        function = V2.functions.get(frame.address)
        if function is None:
            raise RefusedError(Refusal.UNKNOWN_FUNCTION)
        if frame.kind is Kind.READ:
            reader = self._readers.get(frame.address)
            if reader is None:
                raise RefusedError(Refusal.WRONG_ACCESS)
            return Frame(Kind.REPLY, frame.address, function.pack(**reader()))
        writer = self._writers.get(frame.address)
        if writer is None or Access.WRITE not in function.access:
            raise RefusedError(Refusal.WRONG_ACCESS)
        try:
            values = function.unpack(frame.payload)
        except CodecError:
            raise RefusedError(Refusal.WRONG_LENGTH) from None
        writer(values)
        return None

    def _version(self) -> Values:
        return {'text': tuple(self._board.firmware.encode('ascii').ljust(10, b'\0')[:10])}

    def _set_feedback(self, values: Values) -> None:
        on = values['on'][0]
        if on not in {0, 1}:
            raise RefusedError(Refusal.WRONG_VALUE)
        self._on = bool(on)
        if not on:
            self.next_push = math.inf

    def _set_rate(self, values: Values) -> None:
        rate = values['rate'][0]
        if not 1.0 <= rate <= MAX_RATE:
            raise RefusedError(Refusal.WRONG_VALUE)
        self._period = 1.0 / rate

    def _move_one(self, values: Values) -> None:
        (motor,), (angle,) = values['motor'], values['angle']
        self._check_motor(int(motor))
        if not math.isfinite(angle):
            raise RefusedError(Refusal.WRONG_VALUE)
        self._board.take_servos()
        self._board.servos.command_one(int(motor), angle)

    def _move_many(self, values: Values) -> None:
        motors = [int(motor) for motor in values['motor']]
        for motor in motors:
            self._check_motor(motor)
        self._board.take_servos()
        self._board.servos.command(dict(zip(motors, values['angle'], strict=True)))

    def _set_torque(self, values: Values) -> None:
        servos, on = self._board.servos, bool(values['on'][0])
        servos.set_torque(self._motors(values), on, hold=False)

    def _set_speed(self, values: Values) -> None:
        self._board.servos.set_speed(self._motors(values), int(values['speed'][0]))

    def _motors(self, values: Values) -> tuple[int, ...]:
        motor = int(values['motor'][0])
        if motor == ALL_MOTORS:
            return self._board.servos.fitted
        self._check_motor(motor)
        return (motor,)

    def _check_motor(self, motor: int) -> None:
        if motor not in self._board.servos.fitted:
            raise RefusedError(Refusal.WRONG_VALUE)

    def _state(self, measured: Measurement) -> Values:
        board, servos = self._board, self._board.servos
        return {
            'battery': (board.battery.percent,),
            'mode': (board.mode,),
            'faults': (board.faults,),
            'device_time': (int(board.uptime * 1000.0) % _CLOCK,),
            'euler1': _unfused(measured),
            'euler2': board.attitude(measured),
            'acceleration': measured.imu.specific_force,
            'position': servos.angles(measured),
            'velocity': servos.speeds(measured),
            'load': board.loads(measured),
            'temperature': board.temperatures,
            'battery_voltage': (board.battery.voltage,),
            'sequence': (self._sequence,),
        }


def _unfused(measured: Measurement) -> Vector:
    """Return the attitude from the accelerometer alone [deg]: wrong in motion."""
    x, y, z = measured.imu.specific_force
    roll, pitch = math.atan2(y, z), math.atan2(-x, math.hypot(y, z))
    return math.degrees(roll), math.degrees(pitch), 0.0


NEUTRAL = (127, 128)  # the vendor's library encodes zero as 127, its documents as 128
LIE_DOWN, STAND_UP = 1, 2  # actions, of register 0x3E
LEG_NAMES = {1: 'fl', 2: 'fr', 3: 'br', 4: 'bl'}
INT16 = 32767
MAX_ANSWER = V1.max_length - V1.overhead  # [B]

_BODY = {0x33: 'x', 0x34: 'y', 0x35: 'z', 0x36: 'roll', 0x37: 'pitch', 0x38: 'yaw'}
_FEET = range(0x40, 0x4C)
_ATTITUDE = {0x62: 0, 0x63: 1, 0x64: 2}
_WHOLE_DEGREES = {0x66: 0, 0x67: 1, 0x68: 2}
_ORIGIN, _HEIGHT, _MARK_TIME, _TURN, _MIDDLE = 0x06, 0x35, 0x3C, 0x3F, 0x5F


class Registers:
    """Handles frames of protocol v1."""

    def __init__(self, board: Board) -> None:
        """Start with empty registers."""
        self._board = board
        self._spans = ANGLE_SPANS[board.model]
        self._writers: dict[int, Callable[[bytes], None]] = {
            Register.TORQUE: self._switch_torque,
            Register.VX: self._walk,
            Register.VY: self._walk,
            Register.VYAW: self._walk,
            Register.ACTION: self._act,
            Register.MOTOR_SPEED: self._set_speed,
            _ORIGIN: lambda data: board.set_origin() if data == b'\x01' else None,
            _MARK_TIME: self._mark_time,
            _TURN: self._turn,
            _MIDDLE: lambda data: board.go_to_middle() if data == b'\x01' else None,
            **dict.fromkeys(_BODY, self._pose_body),
            **dict.fromkeys(_FEET, self._pose_body),
        }
        self._readers: dict[int, Callable[[], bytes]] = {
            Register.BATTERY: lambda: bytes((board.battery.percent,)),
            Register.FIRMWARE: lambda: board.firmware.encode('ascii'),
            Register.IMU: self._imu,
            _TURN: lambda: b'\x00' if board.turning else b'\x01',  # 1: done
            **{code: partial(self._float, code, axis) for code, axis in _ATTITUDE.items()},
            **{code: partial(self._whole, code, axis) for code, axis in _WHOLE_DEGREES.items()},
        }
        self.restart()

    def restart(self) -> None:
        """Reset the host's settings, as after power-up."""
        self._memory: dict[int, bytes] = {}

    def handle(self, frame: Frame, now: float) -> list[Frame]:
        """Execute a frame; return the board's answer."""
        if frame.kind is Kind.WRITE:
            self._write(frame)
            return []
        if len(frame.payload) != 1 or not 0 < frame.payload[0] <= MAX_ANSWER:
            return []
        payload = self._read(frame.address, frame.payload[0])
        return [] if payload is None else [Frame(Kind.REPLY, frame.address, payload)]

    # -- reading

    def _read(self, address: int, count: int) -> bytes | None:
        """Return the requested bytes; None if a register is not readable."""
        function = V1.functions.get(address)
        if function is None or Access.READ not in function.access:
            return None
        if address in MOTOR_OF_REGISTER:
            data = self._angles()[address - Register.MOTORS :]
        else:
            data = self._readers.get(address, bytes)()
        return data[:count].ljust(count, b'\0')

    def _angles(self) -> bytes:
        angles = self._board.servos.angles(self._board.measure())
        return bytes(
            self._spans[motor].encode(angles[slot_of(motor)]) for motor in BULK_READ_ORDER
        )

    def _float(self, address: int, axis: int) -> bytes:
        degrees = self._board.attitude(self._board.measure())[axis]
        return V1.functions[address].pack(value=(degrees,))

    def _whole(self, address: int, axis: int) -> bytes:
        degrees = self._board.attitude(self._board.measure())[axis]
        whole = round(degrees) if math.isfinite(degrees) else 0
        return V1.functions[address].pack(value=(whole,))

    def _imu(self) -> bytes:
        measured = self._board.measure()
        function = V1.functions[Register.IMU]
        acceleration, rate, _ = function.fields
        return function.pack(
            acceleration=[
                _clipped(value, acceleration.scale) for value in measured.imu.specific_force
            ],
            rate=[
                _clipped(math.degrees(value), rate.scale)
                for value in measured.imu.angular_velocity
            ],
            attitude=self._board.attitude(measured),
        )

    # -- writing

    def _write(self, frame: Frame) -> None:
        motors: dict[int, float] = {}
        for address, data in scatter(frame.address, frame.payload):
            function = V1.functions.get(address)
            if function is None or not function.accepts(len(data)):
                continue
            self._memory[address] = data
            motor = MOTOR_OF_REGISTER.get(address)
            if motor is not None:
                motors[motor] = self._spans[motor].decode(data[0])
            elif address in self._writers:
                self._writers[address](data)
        if motors:
            self._move(motors)

    def _move(self, angles: dict[int, float]) -> None:
        self._board.take_servos()
        servos = self._board.servos
        if servos.at_full_speed:
            servos.command(angles)
            return
        for motor, angle in angles.items():
            servos.command_one(motor, angle)

    def _set_speed(self, data: bytes) -> None:
        servos = self._board.servos
        servos.set_speed(servos.fitted, data[0])

    def _switch_torque(self, data: bytes) -> None:
        servos, value = self._board.servos, data[0]
        if value in {Torque.UNLOAD_ALL, Torque.LOAD_ALL}:
            servos.set_torque(servos.fitted, value == Torque.LOAD_ALL, hold=False)
            return
        kind, leg = value & 0xF0, value & 0x0F
        if kind in {Torque.UNLOAD_LEG, Torque.LOAD_LEG}:
            motors = [motor for motor in servos.fitted if motor // 10 == leg]
            servos.set_torque(motors, kind == Torque.LOAD_LEG, hold=False)

    def _act(self, data: bytes) -> None:
        if data[0] in {ACTION_RESET, STAND_UP}:
            self._memory.clear()
            self._board.stand()
        elif data[0] == LIE_DOWN:
            self._board.lie_down()

    def _walk(self, _: bytes) -> None:
        # a step that is so long [mm] takes as long as a foot is on the ground
        step_time = 1000.0 * DUTY * STRIDE_TIME
        ahead, aside = self._signed(Register.VX), self._signed(Register.VY)
        turn = math.radians(self._signed(Register.VYAW))
        self._board.walk((ahead / step_time, aside / step_time, turn))

    def _turn(self, data: bytes) -> None:
        if len(data) == 2:
            self._board.turn_by(math.radians(int.from_bytes(data, 'big', signed=True)))

    def _mark_time(self, _: bytes) -> None:
        walker = self._board.walker
        walker.marking_time = self._memory[_MARK_TIME] != b'\0'
        walker.lift = self._decoded(_MARK_TIME) / 1000.0 if walker.marking_time else LIFT
        self._board.start_gait()

    def _pose_body(self, _: bytes) -> None:
        walker = self._board.walker
        body = {name: self._signed(address) for address, name in _BODY.items()}
        walker.stance = replace(
            walker.stance,
            shift=(body['x'] / 1000.0, body['y'] / 1000.0),
            height=self._height(_HEIGHT),
            attitude=(
                math.radians(body['roll']),
                math.radians(body['pitch']),
                math.radians(body['yaw']),
            ),
            feet={name: self._foot(leg) for leg, name in LEG_NAMES.items()},
        )
        self._board.start_gait()

    def _foot(self, leg: int) -> tuple[float, float, float]:
        """Return the foot offset set by the host [m]."""
        x, y, z = _FEET[3 * (leg - 1) : 3 * leg]
        return self._signed(x) / 1000.0, self._signed(y) / 1000.0, HEIGHT - self._height(z)

    def _height(self, address: int) -> float:
        """Return the written height, interpreted from hip to foot [m]."""
        return self._decoded(address) / 1000.0 if address in self._memory else HEIGHT

    def _signed(self, address: int) -> float:
        """Return the signed value of a register in its unit; 0 if not written."""
        data = self._memory.get(address)
        if data is None or data[0] in NEUTRAL:
            return 0.0
        return self._decoded(address)

    def _decoded(self, address: int) -> float:
        span = V1.functions[address].spans[self._board.model]
        return span.decode(self._memory[address][0])


PUSHED = DEVELOPER.functions[0x00]
SERVO_PERIOD = 1 / 26  # [s] in which the developer firmware measures the servos anew


class DeveloperFirmware(Registers):
    """Accepts leg angles and torque as in v1, and pushes states unsolicited."""

    protocol = DEVELOPER
    big_endian = False  # its floats, whose order the vendor's page does not say

    def restart(self) -> None:
        """Reset, as after power-up."""
        super().restart()
        self.next_push = self._measure_at = 0.0  # [s] when a state is due, and the servos are
        self._motors = b''

    def handle(self, frame: Frame, now: float) -> list[Frame]:
        """Execute a frame; never answers."""
        return super().handle(frame, now) if frame.address in DEVELOPER.functions else []

    def push(self, now: float) -> Frame:
        """Return the state that is due, and schedule the next one."""
        self.next_push = max(self.next_push, now) + 1.0 / DEFAULT_RATE
        if now >= self._measure_at:
            self._measure_at = max(self._measure_at + SERVO_PERIOD, now)
            self._motors = self._angles()[: PUSHED.fields[1].size]
        attitude = self._board.attitude(self._board.measure())
        battery = (self._board.battery.percent,)
        state = PUSHED.pack(attitude=attitude, motor=self._motors, battery=battery)
        return Frame(Kind.WRITE, PUSHED.address, swap_floats(state) if self.big_endian else state)


def _clipped(value: float, step: float) -> float:
    """Clamp a value to the range of a 16-bit number with this step size."""
    return min(max(value, -INT16 * step), INT16 * step)
