# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot's end of a simulated serial line: bytes in, bytes out, at given times.

A pseudo-terminal transfers bytes at once; here they take the time that the baud rate implies, and
may be damaged on the way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
import math
import random

from quad_hardware.protocol import Code, Frame, HOST_KINDS, Protocol, StreamParser, V1, V2

from .board import Board
from .board_protocols import DeveloperFirmware, Functions, Registers
from .faults import Fault, FaultKind, FaultPlan

BITS_PER_BYTE = 10  # 8N1: start, eight data bits, stop


@dataclass(frozen=True, slots=True)
class Arrival:
    """Bytes that reach the end of a line at a time."""

    end: float  # when the last of them is there [s]
    data: bytes  # what is left of them
    seconds_per_byte: float  # how long each took on the line [s]


class Wire:
    """One direction of a serial line."""

    def __init__(self, faults: FaultPlan, muted_by: FaultKind, seed: int, *, slow: bool) -> None:
        """Create a wire that a given kind of fault mutes."""
        self._faults = faults
        self._muted_by = muted_by
        self._random = random.Random(seed)  # noqa: S311  for tests, not for secrets
        self._slow = slow
        self._free_at = -math.inf
        self._queue: deque[Arrival] = deque()

    def put(self, data: bytes, now: float, baud: int) -> None:
        """Put bytes on the wire, behind those still on it."""
        seconds = BITS_PER_BYTE / baud
        end = max(now, self._free_at) + len(data) * seconds
        self._free_at = end
        if self._faults.active(self._muted_by, now) is not None:
            return
        slow = self._faults.active(FaultKind.SLOW, now) if self._slow else None
        self._queue.append(
            Arrival(end + (slow['delay'] if slow else 0.0), self._damage(data, now), seconds)
        )

    def take(self, now: float) -> list[Arrival]:
        """Return the bytes that have arrived, in order."""
        arrived = []
        while self._queue and self._queue[0].end <= now:
            arrived.append(self._queue.popleft())
        return arrived

    def clear(self) -> None:
        """Discard the bytes on the wire."""
        self._queue.clear()

    @property
    def next_arrival(self) -> float:
        """Time of the next arrival [s]; infinity if none."""
        return self._queue[0].end if self._queue else math.inf

    def _damage(self, data: bytes, now: float) -> bytes:
        flip = self._faults.active(FaultKind.FLIP, now)
        if flip is not None:
            data = bytes(map(self._flip, data, [flip['rate']] * len(data)))
        drop = self._faults.active(FaultKind.DROP, now)
        if drop is not None:
            data = bytes(byte for byte in data if self._random.random() >= drop['rate'])
        return data

    def _flip(self, byte: int, rate: float) -> int:
        if self._random.random() >= rate:
            return byte
        return byte ^ (1 << self._random.randrange(8))


WINDOW = 20_000  # commands that are looked back


@dataclass(frozen=True, slots=True)
class CommandTiming:
    """Timing of joint commands on the wire; percentiles without data are NaN."""

    # times from the last byte of a state to the first byte of the next command in [s]
    latencies: tuple[float, ...] = ()
    # of the times between two commands from their median in [s]
    deviations: tuple[float, ...] = ()

    def __add__(self, other: CommandTiming) -> CommandTiming:
        """Merge two sets of timings."""
        return CommandTiming(self.latencies + other.latencies, self.deviations + other.deviations)

    def latency(self, share: float) -> float:
        """Return a percentile of the latencies, 0.5 for the median, in [s]."""
        return _percentile(sorted(self.latencies), share)

    def jitter(self, share: float) -> float:
        """Return a percentile of the deviations in [s]."""
        return _percentile(sorted(self.deviations), share)


class CommandTimes:
    """Collects command timing; times are those of the robot [s]."""

    def __init__(self) -> None:
        """Start without data."""
        self.clear()

    def clear(self) -> None:
        """Discard all data."""
        self._state_at: float | None = None
        self._command_at: float | None = None
        self._latencies: deque[float] = deque(maxlen=WINDOW)
        self._intervals: deque[float] = deque(maxlen=WINDOW)

    def sent(self, now: float) -> None:
        """Record that bytes have arrived at the host."""
        self._state_at = now

    def commanded(self, begin: float) -> None:
        """Record the first byte of a command."""
        # a second command after a state is no answer to it, nor is one that was there before it
        if self._state_at is not None and begin > self._state_at:
            self._latencies.append(begin - self._state_at)
            self._state_at = None
        if self._command_at is not None:
            self._intervals.append(begin - self._command_at)
        self._command_at = begin

    def timing(self) -> CommandTiming:
        """Return the collected timing."""
        middle = _percentile(sorted(self._intervals), 0.5)
        return CommandTiming(
            tuple(self._latencies), tuple(abs(each - middle) for each in self._intervals)
        )


def _percentile(ordered: list[float], share: float) -> float:
    return ordered[int((len(ordered) - 1) * share)] if ordered else math.nan


LATE = 0.05  # [s] after which a state that was due is one of now
JOINT_COMMANDS = {Code.SERVO, Code.SERVOS}
QUIET = 0.05  # [s] of silence in a frame after which its rest is not waited for


@dataclass(slots=True)
class LineStatistics:
    """Counters of what the robot has received."""

    frames: int = 0  # valid frames
    hurried: int = 0  # frames that followed the one before too closely, and were not carried out
    garbled: int = 0  # bytes at a baud rate at which the robot does not listen


class RobotLine:
    """A board with its serial line in both directions, and the faults of both."""

    def __init__(
        self,
        board: Board,
        speeds: Mapping[int, Protocol] | None = None,
        *,
        faults: FaultPlan | None = None,
        command_gap: float = 0.0,
        big_endian: bool = False,
        seed: int = 0,
    ) -> None:
        """Connect a board.

        Args:
            speeds: Protocols by baud rate [bit/s]; None: v1 and v2 at their own rates.
            command_gap: Shortest time between two host frames [s], except in v2; an earlier frame
                is lost, as the vendor warns.
        """
        self.faults = faults or FaultPlan()  # what goes wrong; may be added to
        self.statistics = LineStatistics()  # what the robot has received
        self.command_times = CommandTimes()  # when joint commands of protocol v2 came
        # the wire from the host
        self.to_robot = Wire(self.faults, FaultKind.DEAF, seed, slow=False)
        # the wire to the host
        self.to_host = Wire(self.faults, FaultKind.SILENCE, seed + 1, slow=True)
        self._board = board
        self._by_baud = dict(speeds or {V2.baud: V2, V1.baud: V1})
        self._registers = Registers(board)
        self._pusher: Functions | DeveloperFirmware = Functions(board)
        if DeveloperFirmware.protocol in self._by_baud.values():
            self._pusher = DeveloperFirmware(board)
            self._pusher.big_endian = big_endian
        self._command_gap = command_gap
        self.baud = next(iter(self._by_baud))  # speed of the line [bit/s]
        self._forget_partial_frames()
        self._received_at = self._frame_end = -math.inf
        self._battery_fault: Fault | None = None
        self._powered = True
        self.plugged = True  # whether the port is there, faults considered
        self._now = 0.0

    def set_baud(self, baud: int) -> None:
        """Set the line speed that the host has chosen [bit/s]."""
        if baud != self.baud:
            self.baud = baud
            self._forget_partial_frames()

    def receive(self, data: bytes, now: float) -> None:
        """Receive bytes that the host has started to send."""
        if self.baud not in self._by_baud:
            self.statistics.garbled += len(data)
            return
        self.to_robot.put(data, now, self.baud)

    def advance(self, now: float) -> bytes:
        """Advance the time; return the bytes that have reached the host by then."""
        self._change_faults(now)
        while (arrival := min(self.to_robot.next_arrival, self._push_time)) <= now:
            if self._push_time <= self.to_robot.next_arrival:
                # a process that was held up does not send all that is due in a burst
                self._push(arrival if now - arrival < LATE else now)
            else:
                for arrived in self.to_robot.take(arrival):
                    self._receive(arrived)
        self._board.advance(now)
        if now - self._received_at > QUIET:
            self._give_up_waiting(now)
        out = b''.join(arrived.data for arrived in self.to_host.take(now))
        if out:
            self.command_times.sent(now)
        return out

    @property
    def next_event(self) -> float:
        """Time at which :meth:`advance` is needed next, without new bytes [s]."""
        return min(
            self.to_robot.next_arrival,
            self.to_host.next_arrival,
            self._push_time,
            self.faults.next_change(self._now),
        )

    @property
    def _push_time(self) -> float:
        return self._pusher.next_push

    def _push(self, now: float) -> None:
        self._board.advance(now)
        frame = self._pusher.push(now)
        if self._board.is_booted:
            self._send(frame, self._pusher.protocol, now)

    def _receive(self, arrived: Arrival) -> None:
        protocol, parser = self._by_baud.get(self.baud), self._parser
        if protocol is None or parser is None:
            return
        self._board.advance(arrived.end)
        self._received_at = arrived.end
        length = len(arrived.data)
        begin = arrived.end - length * arrived.seconds_per_byte
        for frame in parser.feed(arrived.data):
            size = protocol.overhead + len(frame.payload)
            # frames of one chunk follow each other without a pause
            end = min(begin + size * arrived.seconds_per_byte, arrived.end)
            self._handle(frame, protocol, max(begin, self._frame_end), end, arrived.end)
            begin = end

    def _handle(
        self, frame: Frame, protocol: Protocol, begin: float, end: float, now: float
    ) -> None:
        gap = begin - self._frame_end
        self._frame_end = end
        if not self._board.is_booted:
            return
        if protocol is not V2 and gap < self._command_gap:
            self.statistics.hurried += 1
            return
        self.statistics.frames += 1
        if protocol is V2 and frame.address in JOINT_COMMANDS:
            self.command_times.commanded(begin)
        handler = self._pusher if protocol is self._pusher.protocol else self._registers
        for answer in handler.handle(frame, now):
            self._send(answer, protocol, now)

    def _forget_partial_frames(self) -> None:
        protocol = self._by_baud.get(self.baud)
        self._parser = None if protocol is None else StreamParser(protocol, HOST_KINDS)

    def _give_up_waiting(self, now: float) -> None:
        if self._parser is not None and self._parser.pending:
            protocol = self._by_baud[self.baud]
            for frame in self._parser.expire():
                self._handle(frame, protocol, now, now, now)

    def _send(self, frame: Frame, protocol: Protocol, now: float) -> None:
        if self._by_baud.get(self.baud) is protocol:  # the host may have gone on to another speed
            self.to_host.put(frame.encode(protocol), now, self.baud)

    def _change_faults(self, now: float) -> None:
        self._now = now
        active = self.faults.active
        brown_out = active(FaultKind.BROWN_OUT, now) is not None
        if brown_out == self._powered:
            self._powered = not brown_out
            self._board.advance(now)
            self._board.switch_power(self._powered)
            self._pusher.restart()
            self._registers.restart()
        battery = active(FaultKind.BATTERY, now)
        if battery is not None and battery is not self._battery_fault:
            self._board.battery.charge = battery['level']
        self._battery_fault = battery
        limp = active(FaultKind.LIMP, now)
        if self._powered:
            self._board.servos.fail(None if limp is None else int(limp['motor']))
        self._board.imu_failed = active(FaultKind.IMU, now) is not None
        self.plugged = active(FaultKind.UNPLUG, now) is None
