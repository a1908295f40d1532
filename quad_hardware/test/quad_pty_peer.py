# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot without physics on a pseudo-terminal: servos are at their targets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
import os
from pathlib import Path
import pty
import random
import select
import threading
import time
import tty
from types import SimpleNamespace
from typing import TYPE_CHECKING

from quad_hardware.calibration.wizard import CancelledError, Console
from quad_hardware.protocol import (
    ANGLE_SPANS,
    BULK_READ_ORDER,
    Code,
    Frame,
    HOST_KINDS,
    Kind,
    Model,
    model_of_firmware,
    MOTOR_OF_REGISTER,
    MOTOR_ORDER,
    Protocol,
    Register,
    scatter,
    STATE,
    StreamParser,
    Torque,
    V1,
    V2,
)

if TYPE_CHECKING:
    from typing_extensions import Self


REST = {'battery': 100, 'acceleration': (0.0, 0.0, 9.8)}


def state_frame(**values: float | tuple[float, ...]) -> Frame:
    """Return a state frame; what is not given is zero, or that of a robot at rest."""
    runs = {part.name: (0,) * part.count for part in STATE.fields}
    for name, value in {**REST, **values}.items():
        runs[name] = value if isinstance(value, tuple) else (value,)
    return Frame(Kind.PUSH, STATE.address, STATE.pack(**runs))


def read_state(frame: Frame) -> SimpleNamespace:
    """Return the values of a state frame by name; ``euler2`` is the valid attitude."""
    runs = STATE.unpack(frame.payload)
    return SimpleNamespace(**{n: run if len(run) > 1 else run[0] for n, run in runs.items()})


class Script(Console):
    """Someone who answers in order, moves the robot before, and remembers what was said."""

    def __init__(self, *answers: str | tuple[Callable[[], None], str]) -> None:
        self._answers = list(answers)
        self.said: list[str] = []

    def write(self, text: str) -> None:
        """Listen."""
        self.said.append(text)

    def prompt(self, question: str) -> str:
        """Answer; leave when there is no answer left."""
        self.said.append(question)
        if not self._answers:
            raise CancelledError('cancelled; nothing was written')
        answer = self._answers.pop(0)
        if isinstance(answer, tuple):
            move, answer = answer
            move()
        return answer


def wait_for(condition: Callable[[], bool], what: str) -> None:
    """Wait for something."""
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline, f'no {what}'
        time.sleep(0.002)


TIMEOUT = 30.0  # [s] for anything to happen, on a busy machine
PUSH_PERIOD = 0.02  # [s]
TURN_REPORTS = 25  # of the IMU, in which a hand turns the body, however late they are
MAX_GAP = 0.1  # [s] between two of them, of a turn that was seen
MIN_ELAPSED = 0.005  # [s] between two reports; a gyro has a range
PACKET = 62  # [B] that an FTDI adapter sends at once; fewer wait for its latency timer


@dataclass
class Behaviour:
    """What the robot does; a test changes it while it runs.

    Attributes:
        silent: It receives, and sends nothing.
        corrupt: Share of the bytes sent that are damaged.
        attitude: Roll, pitch, yaw [deg].
        acceleration: Specific force [m/s²].
        gyro: Signs of the gyro of protocol v1.
        latency: Latency timer of the adapter between robot and host [s]; 0 for none.
        load: Of each servo, share of its stall torque [%].
        limp_load: The same after torque off.
    """

    silent: bool = False
    corrupt: float = 0.0
    attitude: tuple[float, float, float] = (0.0, 0.0, 0.0)
    acceleration: tuple[float, float, float] = (0.0, 0.0, 9.8)
    gyro: tuple[float, float, float] = (1.0, 1.0, 1.0)
    latency: float = 0.0
    load: float = 0.0
    limp_load: float = 0.0


@dataclass
class PtyPeer:
    """One robot.

    Attributes:
        link: Where its port is found, also after :meth:`unplug` and :meth:`plug`.
        protocol: What it speaks.
        firmware: What it answers when it is asked.
        behaviour: How it behaves.
        angles: Servo angles by motor id [deg].
        commands: Angles of each servo command, in order of arrival.
        torque: Servos hold.
    """

    link: Path
    protocol: Protocol = V2
    firmware: str = 'L-2.0.0'
    behaviour: Behaviour = field(default_factory=Behaviour)
    angles: dict[int, float] = field(default_factory=lambda: dict.fromkeys(MOTOR_ORDER, 0.0))
    commands: list[dict[int, float]] = field(default_factory=list)
    torque: bool = True
    _pushing: bool = False
    _sequence: int = 0
    _adapter: bytearray = field(default_factory=bytearray)
    _sent_at: float = 0.0

    def __post_init__(self) -> None:
        self._stop = threading.Event()
        self._random = random.Random(1)
        self._turning = threading.Event()
        self._turned_from = self.behaviour.attitude  # [deg]
        self._hand: Iterator[float] = iter(())
        self._share = 1.0  # of the turn
        self._elapsed = self._reported_at = 0.0  # [s]
        self._thread: threading.Thread | None = None

    def plug(self) -> None:
        """Appear at the link, on a new terminal."""
        self._master, slave = pty.openpty()
        os.set_blocking(self._master, False)
        tty.setraw(self._master)
        tty.setraw(slave)
        self._slave = slave
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(slave))
        self._pushing = False
        self._stop.clear()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def unplug(self) -> None:
        """Vanish: the port hangs up and the link is gone."""
        if self._thread is None:
            return
        self._stop.set()
        self._thread.join()
        self._thread = None
        os.close(self._master)
        os.close(self._slave)
        self.link.unlink(missing_ok=True)

    def turn_to(
        self, attitude: tuple[float, float, float], acceleration: tuple[float, float, float]
    ) -> None:
        """Turn the body by hand, and wait until a turn was reported without a gap."""
        self._turned_from, self._share = self.behaviour.attitude, 0.0
        self._hand = self._swings()
        self._turning.clear()
        self.behaviour.attitude, self.behaviour.acceleration = attitude, acceleration
        assert self._turning.wait(30.0)

    def _moved(self) -> tuple[list[float], list[float]]:
        """Return attitude [deg] and rates of the gyro [deg/s] of now."""
        now = time.monotonic()
        self._elapsed, self._reported_at = max(now - self._reported_at, MIN_ELAPSED), now
        share = next(self._hand, None)
        if share is None:
            self._turning.set()
            return list(self.behaviour.attitude), [0.0] * 3
        step, self._share = (share - self._share) / self._elapsed, share
        pairs = list(zip(self._turned_from, self.behaviour.attitude, strict=True))
        rates = [
            sign * (end - begin) * step
            for sign, (begin, end) in zip(self.behaviour.gyro, pairs, strict=True)
        ]
        return [begin + share * (end - begin) for begin, end in pairs], rates

    def _swings(self) -> Iterator[float]:
        """Go there, and back and there again until a swing has no gap; yield where it is."""
        at, is_seen = 0, False
        while at == 0 or not is_seen:
            step, gap = 1 if at == 0 else -1, 0.0
            for _ in range(TURN_REPORTS):
                at += step
                gap = max(gap, self._elapsed)
                yield at / TURN_REPORTS
            is_seen |= gap < MAX_GAP

    def _run(self) -> None:
        parser = StreamParser(self.protocol, HOST_KINDS)
        next_push = time.monotonic()
        while not self._stop.is_set():
            ready, _, _ = select.select([self._master], [], [], 0.001 if self._adapter else 0.005)
            self._deliver()
            if ready:
                for frame in parser.feed(os.read(self._master, 4096)):
                    self._take(frame)
            if self._pushing and time.monotonic() >= next_push:
                next_push = time.monotonic() + PUSH_PERIOD
                self._sequence += 1
                self._send(self._state())

    def _take(self, frame: Frame) -> None:
        (self._new if self.protocol is V2 else self._old)(frame)

    def _state(self) -> Frame:
        load = self.behaviour.load if self.torque else self.behaviour.limp_load
        return state_frame(
            euler2=self.behaviour.attitude,
            acceleration=self.behaviour.acceleration,
            battery=80,
            battery_voltage=7.4,
            position=tuple(self.angles[motor] for motor in MOTOR_ORDER),
            load=(load,) * len(MOTOR_ORDER),
            sequence=self._sequence % 65536,
            device_time=round(time.monotonic() * 1e3) % 2**32,
        )

    def _send(self, frame: Frame) -> None:
        if self.behaviour.silent:
            return
        wire = bytearray(frame.encode(self.protocol))
        for index in range(len(wire)):
            if self._random.random() < self.behaviour.corrupt:
                wire[index] ^= self._random.randrange(1, 256)
        self._adapter += wire
        self._deliver()

    def _deliver(self) -> None:
        """Send full packets, and the rest when it has waited long enough."""
        now, latency = time.monotonic(), self.behaviour.latency
        full = len(self._adapter) - len(self._adapter) % PACKET
        size = len(self._adapter) if now - self._sent_at >= latency else full
        if size:
            with suppress(BlockingIOError):  # a serial line does not wait for whoever reads
                os.write(self._master, bytes(self._adapter[:size]))
            del self._adapter[:size]
            self._sent_at = now

    def _set(self, angles: dict[int, float]) -> None:
        self.angles.update(angles)
        self.commands.append(angles)

    def _new(self, frame: Frame) -> None:
        if frame.kind is Kind.READ and frame.address == Code.VERSION:
            self._send(Frame(Kind.REPLY, Code.VERSION, self.firmware.encode().ljust(10, b'\0')))
        elif frame.kind is Kind.READ and frame.address == Code.BATTERY:
            self._send(Frame(Kind.REPLY, Code.BATTERY, bytes((80,))))
        elif frame.address == Code.FEEDBACK:
            self._pushing = bool(frame.payload[0])
        elif frame.address == Code.TORQUE:
            self.torque = bool(frame.payload[1])
        elif frame.address == Code.SERVOS:
            values = V2.functions[Code.SERVOS].unpack(frame.payload)
            self._set({int(m): a for m, a in zip(values['motor'], values['angle'], strict=True)})

    def _old(self, frame: Frame) -> None:
        spans = ANGLE_SPANS[model_of_firmware(self.firmware) or Model.LITE]
        if frame.kind is Kind.WRITE and frame.address == Register.TORQUE:
            self.torque = frame.payload[0] == Torque.LOAD_ALL
        elif frame.kind is Kind.WRITE and frame.address in MOTOR_OF_REGISTER:
            self._set(
                {
                    MOTOR_OF_REGISTER[r]: spans[MOTOR_OF_REGISTER[r]].decode(data[0])
                    for r, data in scatter(frame.address, frame.payload)
                }
            )
        elif frame.address == Register.FIRMWARE:
            self._send(Frame(Kind.REPLY, frame.address, self.firmware.encode().ljust(10, b'\0')))
        elif frame.address == Register.BATTERY:
            self._send(Frame(Kind.REPLY, frame.address, bytes((80,))))
        elif frame.address == Register.MOTORS:
            motors = BULK_READ_ORDER[: frame.payload[0]]
            data = bytes(spans[motor].encode(self.angles[motor]) for motor in motors)
            self._send(Frame(Kind.REPLY, frame.address, data))
        elif frame.address == Register.IMU:
            attitude, rates = self._moved()
            values = V1.functions[Register.IMU].pack(
                acceleration=self.behaviour.acceleration, rate=rates, attitude=attitude
            )
            self._send(Frame(Kind.REPLY, frame.address, values))

    def __enter__(self) -> Self:
        """Plug it in."""
        self.plug()
        return self

    def __exit__(self, *_error: object) -> None:
        """Unplug it."""
        self.unplug()
