# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Synchronous client for a robot on a serial port."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
import math
import select
import time
from typing import TYPE_CHECKING

from quad_hardware import CodecError, HardwareError, NoAnswerError
from quad_hardware.link import BATTERY, connect, FIRMWARE, read_value, Value
from quad_hardware.protocol import (
    ANGLE_SPANS,
    Code,
    Frame,
    Kind,
    Model,
    model_of_firmware,
    Register,
    REGISTER_OF_MOTOR,
    slot_of,
    V1,
    V2,
)

from .errors import XgoError, XgoNotSupportedError, XgoTimeoutError
from .feedback import DeviceState, SendStateParser

if TYPE_CHECKING:
    from typing_extensions import Self

TIMEOUT = 0.5  # [s] for an answer
HOST_GAP = 0.001  # [s] between commands of protocol v1
_IMU = V1.functions[Register.IMU]


@dataclass(frozen=True, slots=True)
class Imu:
    """Measurements of the IMU."""

    roll: float  # attitude about x [deg]
    pitch: float  # attitude about y [deg]
    yaw: float  # attitude about z [deg]
    acceleration: tuple[float, float, float]  # specific force x, y, z [m/s²]


class XgoDog:
    """Client for a robot in either protocol; close it, or use it in a with statement."""

    def __init__(self, port: str = '/dev/ttyAMA0', baud: int = 0) -> None:
        """Open a port and detect the robot.

        Args:
            baud: Speed [bit/s]; 0 tries 2 000 000, then 115 200.

        Raises:
            XgoTimeoutError: The robot does not answer.
            XgoError: The port cannot be opened.
        """
        with _as_xgo_errors():
            self._connection = connect(port, (V2, V1), baud)
        self._parser = SendStateParser()
        self._states: list[DeviceState] = []

    @property
    def protocol(self) -> str:
        """Name of the protocol that the robot speaks: ``v2`` or ``v1``."""
        return self._connection.protocol.name

    def read_version(self) -> str:
        """Return the firmware version.

        Raises:
            XgoError: The robot does not answer, or the port was lost.
        """
        return self._read(FIRMWARE).rstrip(b'\0').decode('ascii', 'replace')

    def system_read_battery(self) -> int:
        """Return the charge of the battery [%].

        Raises:
            XgoError: The robot does not answer, or the port was lost.
        """
        return self._read(BATTERY)[0]

    def system_set_feedback(self, on: int) -> None:
        """Enable (1) or disable (0) states pushed at about 50 Hz.

        Raises:
            XgoNotSupportedError: The robot uses protocol v1, which is polled.
            XgoError: The port was lost.
        """
        if not self._is_v2:
            raise XgoNotSupportedError('protocol v1 pushes nothing; poll with read_imu')
        self._send(Frame(Kind.WRITE, Code.FEEDBACK, bytes((bool(on),))))

    def read_state(self, timeout: float = TIMEOUT) -> DeviceState:
        """Wait for the next pushed state and return it.

        Raises:
            XgoTimeoutError: No state arrives; was ``system_set_feedback(1)`` called?
        """
        port = self._connection.port
        deadline = time.monotonic() + timeout
        while not self._states:
            left = deadline - time.monotonic()
            if left <= 0:
                raise XgoTimeoutError(
                    f'no state within {timeout} s; was system_set_feedback(1) called?'
                )
            readable, _, _ = select.select([port], [], [], left)
            if readable:
                with _as_xgo_errors():
                    self._states += self._parser.feed_bytes(port.read())
        return self._states.pop(0)

    def read_imu(self) -> Imu:
        """Return attitude and acceleration.

        Raises:
            XgoError: The robot does not answer or, in protocol v2, pushes no states.
        """
        if self._is_v2:
            self._states.clear()
            state = self.read_state()
            return Imu(state.roll, state.pitch, state.yaw, state.acceleration)
        values = _IMU.unpack(self._read(Value(Code.STATE, Register.IMU, _IMU.length)))
        roll, pitch, yaw = values['attitude']
        x, y, z = values['acceleration']
        return Imu(roll, pitch, yaw, (x, y, z))

    def write_servo_angle(self, motor_id: int, angle: float) -> None:
        """Move one servo.

        Args:
            motor_id: See :func:`xgo_lib2.registry.feedback_slot_of`.
            angle: Target [deg].

        Raises:
            ValueError: The motor is unknown, or the angle is not finite.
            XgoError: The port was lost.
        """
        self.write_servo_angles({motor_id: angle})

    def write_servo_angles(self, angles: Mapping[int, float]) -> None:
        """Move several servos at once.

        Args:
            angles: Targets by motor id [deg].

        Raises:
            ValueError: A motor is unknown, or an angle is not finite; nothing is sent.
            XgoError: The port was lost.
        """
        for motor, angle in angles.items():
            slot_of(motor)
            if not math.isfinite(angle):
                raise ValueError(f'motor {motor}: {angle} is not an angle')
        if self._is_v2:
            servos = V2.functions[Code.SERVOS]
            payload = servos.pack(motor=angles, angle=angles.values()) if angles else b''
            self._send(Frame(Kind.WRITE, Code.SERVOS, payload))
            return
        spans = ANGLE_SPANS[self._model]
        for motor, angle in angles.items():
            payload = bytes((spans[motor].encode(angle),))
            self._send(Frame(Kind.WRITE, REGISTER_OF_MOTOR[motor], payload))
            time.sleep(HOST_GAP)

    def close(self) -> None:
        """Close the port."""
        self._connection.port.close()

    def __enter__(self) -> Self:
        """Return the client."""
        return self

    def __exit__(self, *_error: object) -> None:
        """Close the port."""
        self.close()

    @property
    def _is_v2(self) -> bool:
        return self._connection.protocol is V2

    @property
    def _model(self) -> Model:
        model = model_of_firmware(self._connection.firmware)
        if model is None:
            raise XgoNotSupportedError(
                f'firmware {self._connection.firmware!r} is of no robot with legs'
            )
        return model

    def _send(self, frame: Frame) -> None:
        with _as_xgo_errors():
            self._connection.port.write(frame.encode(self._connection.protocol))

    def _read(self, value: Value) -> bytes:
        port = self._connection.port
        with _as_xgo_errors():
            answer = read_value(port, self._connection.protocol, value, TIMEOUT, attempts=1)
        if answer is None:
            raise XgoTimeoutError(f'no answer from {port.path} within {TIMEOUT} s')
        return answer


@contextmanager
def _as_xgo_errors() -> Iterator[None]:
    try:
        yield
    except NoAnswerError as error:
        raise XgoTimeoutError(str(error)) from error
    except CodecError:
        raise  # a ValueError: what the caller gave does not fit
    except HardwareError as error:
        raise XgoError(str(error)) from error
