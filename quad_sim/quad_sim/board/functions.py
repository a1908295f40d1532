# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The board's side of protocol v2: functions, and states pushed unasked."""

from __future__ import annotations

from collections.abc import Callable
import math

from quad_description.rotations import Vector
from quad_hardware import CodecError
from quad_hardware.protocol import Access, Code, Frame, Kind, Refusal, STATE, V2

from ..plant.state import Measurement
from .board import Board

ALL_MOTORS = 0xFF
DEFAULT_RATE, MAX_RATE = 50.0, 100.0  # [Hz]
_CLOCK, _COUNT = 1 << 32, 1 << 16  # where device time and sequence begin anew

Values = dict[str, tuple[float, ...]]


class RefusedError(Exception):
    """A frame requests what the board does not do; it becomes a NACK."""

    def __init__(self, reason: Refusal) -> None:
        super().__init__(reason.name)
        self.reason = reason


class Functions:
    """Answers frames of protocol v2 and pushes states."""

    def __init__(self, board: Board) -> None:
        """Begin without feedback."""
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
        """Forget what a host has set, as after switching on."""
        self._on = False
        self._period = 1.0 / DEFAULT_RATE
        self._next_push = math.inf
        self._sequence = 0

    def handle(self, frame: Frame, now: float) -> list[Frame]:
        """Carry a frame out; return what the board answers."""
        try:
            answer = self._carry_out(frame)
        except RefusedError as refused:
            return [Frame(Kind.NACK, frame.address, bytes((refused.reason,)))]
        if self._on and self._next_push == math.inf:
            self._next_push = now
        return [answer] if answer else []

    @property
    def next_push(self) -> float:
        """When a state is due [s]; infinity without feedback."""
        return self._next_push

    def push(self, now: float) -> Frame:
        """Return the state that is due, and plan the next one."""
        self._next_push += self._period
        if self._next_push < now:  # held up: go on from here, do not send a burst
            self._next_push = now + self._period
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
            self._next_push = math.inf

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
    """Attitude from the accelerometer alone [deg]: wrong as soon as the robot moves."""
    x, y, z = measured.imu.specific_force
    roll, pitch = math.atan2(y, z), math.atan2(-x, math.hypot(y, z))
    return math.degrees(roll), math.degrees(pitch), 0.0
