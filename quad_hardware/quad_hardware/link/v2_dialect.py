# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Conversation in protocol v2: the robot pushes its state, commands go out at once."""

from __future__ import annotations

from collections.abc import Mapping

from ..exceptions import CodecError
from ..protocol import (
    ALL_MOTORS,
    Code,
    Frame,
    Kind,
    MOTOR_ORDER,
    STATE,
    V2,
)
from ..report import Report
from .dialect import Dialect, Step, vector

REQUEST_PERIOD = 0.3  # [s] of silence after which the robot is asked to push its state
_SERVOS = V2.functions[Code.SERVOS]
STATE_WIRE_TIME = V2.wire_time(V2.overhead + STATE.length)  # [s]
_SEQUENCE = 1 << 16


class V2Dialect(Dialect):
    """Requests 50 states a second, and again whenever they stop coming."""

    def __init__(self, now: float, rate: int = 50) -> None:
        """Begin a conversation.

        Args:
            rate: Reports a second [Hz].
        """
        super().__init__(V2)
        requests = (
            Frame(Kind.WRITE, Code.FEEDBACK_RATE, bytes((rate,))),
            Frame(Kind.WRITE, Code.FEEDBACK, b'\x01'),
        )
        self._requests = b''.join(frame.encode(V2) for frame in requests)
        self._request_at = now
        self._pending = b''
        self._sequence: int | None = None

    @property
    def pending(self) -> bool:
        """Whether a command or a change of torque has not been given to the line yet."""
        return bool(self._pending or self._torque)

    def command(self, angles: Mapping[int, float]) -> None:
        """Set the angles that are sent at the next step, in one frame."""
        payload = _SERVOS.pack(motor=angles, angle=angles.values())
        self._pending = Frame(Kind.WRITE, Code.SERVOS, payload).encode(V2)

    def torque(self, *, on: bool) -> None:
        """Switch the torque of all servos, behind a pending command."""
        payload = V2.functions[Code.TORQUE].pack(motor=(ALL_MOTORS,), on=(on,))
        self._torque = Frame(Kind.WRITE, Code.TORQUE, payload).encode(V2)

    def cancel_pending(self) -> None:
        """Forget what has not been sent yet."""
        self._pending = self._torque = b''

    def step(self, now: float) -> Step:
        """Return a pending command, and the request for states where they are missing."""
        send, self._pending, self._torque = self._pending + self._torque, b'', b''
        if now >= self._request_at:
            self._request_at = now + REQUEST_PERIOD
            send = self._requests + send
        return Step(send, self._request_at)

    def handle_frame(self, frame: Frame, now: float) -> Report | None:
        """Process a frame of the robot; every state frame is a report."""
        if frame.kind is Kind.NACK:
            self._counters.refused += 1
        if frame.kind is not Kind.PUSH or frame.address != STATE.address:
            return None
        try:
            values = STATE.unpack(frame.payload)
        except CodecError:
            self._counters.unusable += 1
            return None
        self._count(int(values['sequence'][0]))
        self._request_at = now + REQUEST_PERIOD
        return _report(values, now)

    def handle_sent(self, frame: Frame, now: float) -> Mapping[int, float]:
        """Return the angles of a servo frame that was sent."""
        if frame.kind is not Kind.WRITE or frame.address != Code.SERVOS:
            return {}
        try:
            values = _SERVOS.unpack(frame.payload)
        except CodecError:
            return {}
        return {int(m): a for m, a in zip(values['motor'], values['angle'], strict=True)}

    def _count(self, sequence: int) -> None:
        self._counters.states += 1
        if self._sequence is not None:
            missing = (sequence - self._sequence - 1) % _SEQUENCE
            # a robot that restarted counts anew, which is no loss
            self._counters.lost += missing if missing < _SEQUENCE // 2 else 0
        self._sequence = sequence


def _report(values: Mapping[str, tuple[float, ...]], now: float) -> Report:
    (voltage,), (device_time,) = values['battery_voltage'], values['device_time']
    by_motor = {
        name: dict(zip(MOTOR_ORDER, values[name], strict=True))
        for name in ('position', 'velocity', 'temperature', 'load')
    }
    return Report(
        arrival=now,
        wire_time=STATE_WIRE_TIME,
        attitude=vector(values['euler2']),
        acceleration=vector(values['acceleration']),
        positions=by_motor['position'],
        velocities=by_motor['velocity'],
        battery=values['battery'][0],
        voltage=voltage or None,
        device_time=device_time / 1000.0,
        faults=int(values['faults'][0]),
        temperatures=by_motor['temperature'],
        loads=by_motor['load'],
    )
