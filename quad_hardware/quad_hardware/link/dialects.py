# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Conversations in protocols v2 and v1, and with the developer firmware.

In v2 the robot pushes its state, and commands go out at once. In v1 it is polled: two bulk reads
at 50 Hz, with a bulk write in between. A bulk write of 12 servos, a read of 15 and a read of the
IMU take 8.1 ms of a 20 ms period at 115200 baud; one frame per servo, as the vendor's library
sends them, would not fit. The developer firmware pushes states and accepts the writes of v1.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
import math
from statistics import median_high

from ..exceptions import CodecError
from ..protocol import (
    ALL_MOTORS,
    ANGLE_SPANS,
    BULK_READ_ORDER,
    Code,
    DEVELOPER,
    Frame,
    Kind,
    LEG_MOTORS,
    Model,
    MOTOR_OF_REGISTER,
    MOTOR_ORDER,
    Register,
    REGISTER_OF_MOTOR,
    scatter,
    Span,
    STATE,
    swap_floats,
    Torque,
    V1,
    V2,
)
from ..protocol.tables import PUSHED
from ..report import Report
from .dialect import Dialect, Step, vector

HOST_GAP = 0.001  # [s] the board drops some commands that follow each other faster
MAX_LATENCY = 0.050  # [s] what an answer may take beyond its time on the line
MIN_LATENCY = 0.006  # [s] what is waited for the answer of a quick board
LATENCY_DECAY = 0.98  # by which a slow answer is forgotten with each quick one
BATTERY_PERIOD = 2.0  # [s]
ARM_REPEAT_PERIOD = 0.5  # [s] after which an arm joint is sent again, for a frame may be lost
_IMU = V1.functions[Register.IMU]


FULL_SPEED, MIN_SPEED = 255, 1
"""Ends of the register that says how fast a single servo turns (quad.md 1.2)."""

MIN_RATE = 527.0 / FULL_SPEED
"""What the lowest speed is worth [deg/s] where the highest is that of a servo without load.

No page of the vendor says the unit; 9.2 rad/s is what the servo's data sheet allows.
"""


class UnseenServo:
    """Tracks the possible range of an unreported servo while it moves to its target.

    Protocol v1 reads 15 of 16 servos, all but the yaw of the arm, 54. Its first motion may span
    the whole range, so it runs at the lowest speed until it must have arrived.
    """

    def __init__(self, span: Span, now: float) -> None:
        """Start with a servo anywhere in its range [deg]."""
        self._low, self._high = span.low, span.high
        self._target = math.nan
        self._at = now

    def send(self, angle: float, now: float) -> None:
        """Set its target [deg]."""
        self._advance(now)
        self._target = angle

    def arrived(self, now: float) -> bool:
        """Return whether the servo must have reached its target."""
        self._advance(now)
        return self._low == self._target == self._high

    def _advance(self, now: float) -> None:
        way, self._at = MIN_RATE * (now - self._at), now
        if not math.isnan(self._target):
            self._low = _toward(self._target, self._low, way)
            self._high = _toward(self._target, self._high, way)


def _toward(target: float, place: float, way: float) -> float:
    return min(max(target, place - way), place + way)


@dataclass(frozen=True, slots=True)
class _Request:
    register: Register
    size: int  # [B] of the answer

    def encode(self) -> bytes:
        """Return the bytes of the request."""
        return Frame(Kind.READ, self.register, bytes((self.size,))).encode(V1)

    @property
    def wire_time(self) -> float:
        """Time on the line for request and answer [s]."""
        return V1.wire_time(len(self.encode()) + V1.overhead + self.size)


_READ_MOTORS = _Request(Register.MOTORS, len(BULK_READ_ORDER))
_READ_IMU = _Request(Register.IMU, _IMU.length)
_READ_BATTERY = _Request(Register.BATTERY, 1)


class V1Dialect(Dialect):
    """Polls a robot; sends a command as soon as the line is free.

    A board slower than the period reduces the report rate. The answer time-out adapts to measured
    answer times, so that a lost answer costs little on a quick board.
    """

    def __init__(self, now: float, model: Model = Model.LITE, rate: float = 50.0) -> None:
        """Start a conversation with a report rate [Hz]."""
        super().__init__(V1)
        self.spans = ANGLE_SPANS[model]
        self._period = 1.0 / rate
        self._cycle_at = now
        self._battery_at = now
        self._queue: deque[_Request] = deque()
        self._waiting: _Request | None = None
        self._requested_at = now
        self._latency_limit = MAX_LATENCY
        self._free_at = now
        self._legs = b''
        self._arm: dict[int, bytes] = {}
        self._arm_sent: dict[int, tuple[bytes, float]] = {}  # and until when that counts [s]
        self._unseen: dict[int, UnseenServo] = {}
        self._speed = 0  # of servos, 0 for unknown; no page says if it counts for bulk writes
        self._angles: bytes | None = None
        self._angles_at = now  # [s] when they were measured
        self._charges: deque[int] = deque(maxlen=3)

    @property
    def pending(self) -> bool:
        """Whether a command or a change of torque has not been sent yet."""
        return bool(self._legs or self._arm or self._torque)

    def command(self, angles: Mapping[int, float]) -> None:
        """Set the angles to send when the line is free.

        One frame carries all legs, so angles of all legs are required. The arm follows if it
        changed or was last sent a while ago; an unreported servo moves slowly at first.
        """
        self._legs = bytes(self.spans[motor].encode(angles[motor]) for motor in LEG_MOTORS)
        for motor in angles.keys() - set(LEG_MOTORS):
            self._arm[motor] = bytes((self.spans[motor].encode(angles[motor]),))

    def torque(self, *, on: bool) -> None:
        """Switch the torque of all servos, after a pending command."""
        self._forget_arm()
        self._torque = bytes((Torque.LOAD_ALL if on else Torque.UNLOAD_ALL,))

    def cancel_pending(self) -> None:
        """Discard orders that have not been sent yet."""
        self._legs = self._torque = b''
        self._arm.clear()
        self._forget_arm()

    def step(self, now: float) -> Step:
        """Return the next frame if one is due and the line is free."""
        if self._waiting is not None and now >= self._deadline(self._waiting):
            self._give_up()
        if self._waiting is None and not self._queue and now >= self._cycle_at:
            self._begin_cycle(now)
        send = self._next(now) if now >= self._free_at else b''
        if send:
            self._free_at = now + self.protocol.wire_time(len(send)) + HOST_GAP
        return Step(send, self._wake())

    def handle_frame(self, frame: Frame, now: float) -> Report | None:
        """Process an answer; that of the IMU completes a report."""
        waiting = self._waiting
        if (
            waiting is None
            or frame.address != waiting.register
            or len(frame.payload) != waiting.size
        ):
            self.counters.unusable += 1
            return None
        self._waiting = None
        took = now - self._requested_at - waiting.wire_time
        wanted = max(2 * took, LATENCY_DECAY * self._latency_limit, MIN_LATENCY)
        self._latency_limit = min(wanted, MAX_LATENCY)
        if waiting is _READ_BATTERY:
            self._charges.append(frame.payload[0])
        elif waiting is _READ_MOTORS:
            self._angles = frame.payload
            self._angles_at = now - _on_the_line(frame.payload) / 2
        elif self._angles is not None:
            return self._report(frame.payload, now)
        return None

    def handle_sent(self, frame: Frame, now: float) -> Mapping[int, float]:
        """Expect the answer to a frame that was sent; return the angles in the frame."""
        if frame.kind is Kind.READ:
            self._expect(frame, now)
        if frame.kind is not Kind.WRITE or frame.address not in MOTOR_OF_REGISTER:
            return {}
        sent = [(r, data) for r, data in scatter(frame.address, frame.payload) if data]
        motors = [(MOTOR_OF_REGISTER[r], data[0]) for r, data in sent if r in MOTOR_OF_REGISTER]
        return {motor: self.spans[motor].decode(byte) for motor, byte in motors}

    def _expect(self, request: Frame, now: float) -> None:
        size = request.payload[:1]
        for known in (_READ_MOTORS, _READ_IMU, _READ_BATTERY):
            if known.register == request.address and size == bytes((known.size,)):
                self.counters.unanswered += self._waiting is not None
                self._waiting, self._requested_at = known, now
                if known is _READ_MOTORS:
                    self._angles = None

    def _wake(self) -> float:
        commands = self._free_at if self.pending else math.inf
        if self._waiting is not None:
            return min(commands, self._deadline(self._waiting))
        return min(commands, self._free_at if self._queue else self._cycle_at)

    def _deadline(self, request: _Request) -> float:
        return self._requested_at + request.wire_time + self._latency_limit

    def _give_up(self) -> None:
        """Abandon the answer and the rest of this period."""
        self.counters.unanswered += 1
        self._latency_limit = min(1.5 * self._latency_limit, MAX_LATENCY)
        self._waiting = None
        self._queue.clear()

    def _begin_cycle(self, now: float) -> None:
        self._cycle_at += self._period
        if self._cycle_at <= now:  # held up for longer than a period: no hurry to catch up
            self._cycle_at = now + self._period
        self._angles = None
        self._queue = deque((_READ_MOTORS, _READ_IMU))
        if now >= self._battery_at:
            self._battery_at = now + BATTERY_PERIOD
            self._speed = 0  # its frame may be lost, and another program or a restart undo it
            self._queue.append(_READ_BATTERY)

    def _next(self, now: float) -> bytes:
        if self._legs and self._speed == FULL_SPEED:
            payload, self._legs = self._legs, b''
            return Frame(Kind.WRITE, Register.MOTORS, payload).encode(V1)
        if arm := self._next_of_arm(now):
            return arm
        if self._speed != FULL_SPEED:
            return self._set_speed(FULL_SPEED)
        if self._torque:
            payload, self._torque = self._torque, b''
            return Frame(Kind.WRITE, Register.TORQUE, payload).encode(V1)
        if self._waiting is None and self._queue:
            self._waiting = self._queue.popleft()
            self._requested_at = now
            return self._waiting.encode()
        return b''

    def _next_of_arm(self, now: float) -> bytes:
        while self._arm:
            motor, payload = self._arm.popitem()
            sent, until = self._arm_sent.get(motor, (b'', now))
            if sent == payload and now < until:
                continue
            speed = self._speed_of(motor, now)
            if speed != self._speed:  # it counts for every servo that follows
                self._arm[motor] = payload
                return self._set_speed(speed)
            self._arm_sent[motor] = payload, now + ARM_REPEAT_PERIOD
            if motor in self._unseen:
                self._unseen[motor].send(self.spans[motor].decode(payload[0]), now)
            return Frame(Kind.WRITE, REGISTER_OF_MOTOR[motor], payload).encode(V1)
        return b''

    def _set_speed(self, speed: int) -> bytes:
        self._speed = speed
        return Frame(Kind.WRITE, Register.MOTOR_SPEED, bytes((speed,))).encode(V1)

    def _speed_of(self, motor: int, now: float) -> int:
        if motor not in BULK_READ_ORDER:
            if motor not in self._unseen:
                self._unseen[motor] = UnseenServo(self.spans[motor], now)
            if not self._unseen[motor].arrived(now):
                return MIN_SPEED
        return FULL_SPEED

    def _forget_arm(self) -> None:
        """Send the arm again, because something may have moved it."""
        self._arm_sent.clear()
        self._unseen.clear()

    def _report(self, imu: bytes, now: float) -> Report:
        angles, self._angles = self._angles or b'', None
        values = _IMU.unpack(imu)
        self.counters.states += 1
        pairs = zip(BULK_READ_ORDER, angles, strict=True)
        wire_time = _on_the_line(imu)
        return Report(
            arrival=now,
            wire_time=wire_time,
            attitude=vector(values['attitude']),
            acceleration=vector(values['acceleration']),
            positions={motor: self.spans[motor].decode(byte) for motor, byte in pairs},
            velocities={},
            rates=vector(values['rate']),
            # each answer stands for many reports: one damaged answer must not
            battery=float(median_high(self._charges)) if self._charges else None,
            joints_age=now - wire_time / 2 - self._angles_at,
        )


def _on_the_line(payload: bytes) -> float:
    """Return the time on the line of an answer with this payload [s]."""
    return V1.wire_time(V1.overhead + len(payload))


SERVO_PERIOD = 1 / 26  # [s] in which the developer firmware measures the servos anew


class DeveloperDialect(V1Dialect):
    """Receives from the developer firmware, which cannot be polled; writes as in v1."""

    def __init__(self, now: float, model: Model = Model.MINI) -> None:
        """Start a conversation."""
        super().__init__(now, model)
        self.protocol = DEVELOPER
        self._cycle_at, self._speed = math.inf, FULL_SPEED  # it is not polled, nor set a speed
        self._swapped = False  # the byte order of its floats
        self._motors: tuple[float, ...] = ()  # bytes that were measured last

    def handle_frame(self, frame: Frame, now: float) -> Report | None:
        """Process a frame of the robot; each pushed frame is a report."""
        if frame.address != PUSHED.address or not PUSHED.accepts(len(frame.payload)):
            self.counters.unusable += 1
            return None
        self.counters.states += 1
        readings = [PUSHED.unpack(each) for each in (frame.payload, swap_floats(frame.payload))]
        # floats in the wrong order are no angles [deg]: too small or too large
        fits = [all(a == 0.0 or 1e-12 < abs(a) <= 360.0 for a in r['attitude']) for r in readings]
        if fits[0] != fits[1]:
            self._swapped = fits[1]
        values = readings[self._swapped]
        # half of the pushes repeat servos that were measured before
        if values['motor'] != self._motors or now - self._angles_at > SERVO_PERIOD:
            self._motors, self._angles_at = values['motor'], now
        pairs = zip(LEG_MOTORS, self._motors, strict=True)
        return Report(
            arrival=now,
            wire_time=DEVELOPER.wire_time(DEVELOPER.overhead + PUSHED.length),
            attitude=vector(values['attitude']),
            acceleration=None,
            positions={motor: self.spans[motor].decode(int(byte)) for motor, byte in pairs},
            velocities={},
            battery=values['battery'][0],
            joints_age=now - self._angles_at,
        )


REQUEST_PERIOD = 0.3  # [s] of silence after which the robot is asked to push its state
_SERVOS = V2.functions[Code.SERVOS]
STATE_WIRE_TIME = V2.wire_time(V2.overhead + STATE.length)  # [s]
_SEQUENCE = 1 << 16


class V2Dialect(Dialect):
    """Requests 50 states a second, and repeats the request if they stop."""

    def __init__(self, now: float, rate: int = 50) -> None:
        """Start a conversation with a report rate [Hz]."""
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
        """Whether a command or a change of torque has not been sent yet."""
        return bool(self._pending or self._torque)

    def command(self, angles: Mapping[int, float]) -> None:
        """Set the angles to send at the next step, in one frame."""
        payload = _SERVOS.pack(motor=angles, angle=angles.values())
        self._pending = Frame(Kind.WRITE, Code.SERVOS, payload).encode(V2)

    def torque(self, *, on: bool) -> None:
        """Switch the torque of all servos, after a pending command."""
        payload = V2.functions[Code.TORQUE].pack(motor=(ALL_MOTORS,), on=(on,))
        self._torque = Frame(Kind.WRITE, Code.TORQUE, payload).encode(V2)

    def cancel_pending(self) -> None:
        """Discard orders that have not been sent yet."""
        self._pending = self._torque = b''

    def step(self, now: float) -> Step:
        """Return a pending command, and a request for states if they are missing."""
        send, self._pending, self._torque = self._pending + self._torque, b'', b''
        if now >= self._request_at:
            self._request_at = now + REQUEST_PERIOD
            send = self._requests + send
        return Step(send, self._request_at)

    def handle_frame(self, frame: Frame, now: float) -> Report | None:
        """Process a frame of the robot; each state frame is a report."""
        if frame.kind is Kind.NACK:
            self.counters.refused += 1
        if frame.kind is not Kind.PUSH or frame.address != STATE.address:
            return None
        try:
            values = STATE.unpack(frame.payload)
        except CodecError:
            self.counters.unusable += 1
            return None
        self._count(int(values['sequence'][0]))
        self._request_at = now + REQUEST_PERIOD
        return _report(values, now)

    def handle_sent(self, frame: Frame, now: float) -> Mapping[int, float]:
        """Return the angles in a servo frame that was sent."""
        if frame.kind is not Kind.WRITE or frame.address != Code.SERVOS:
            return {}
        try:
            values = _SERVOS.unpack(frame.payload)
        except CodecError:
            return {}
        return {int(m): a for m, a in zip(values['motor'], values['angle'], strict=True)}

    def _count(self, sequence: int) -> None:
        self.counters.states += 1
        if self._sequence is not None:
            missing = (sequence - self._sequence - 1) % _SEQUENCE
            # a robot that restarted counts anew, which is no loss
            self.counters.lost += missing if missing < _SEQUENCE // 2 else 0
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
