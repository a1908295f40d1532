# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot at the end of its serial line: bytes in, bytes out, in a time that is handed in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

from quad_hardware.protocol import Code, Frame, HOST_KINDS, Protocol, StreamParser, V1, V2

from ..board.board import Board
from ..board.functions import Functions
from ..board.registers import Registers
from .command_times import CommandTimes
from .faults import Fault, FaultKind, FaultPlan
from .wire import Arrival, Wire

LATE = 0.05  # [s] after which a state that was due is one of now
JOINT_COMMANDS = {Code.SERVO, Code.SERVOS}
QUIET = 0.05  # [s] of silence in a frame after which its rest is not waited for


@dataclass(slots=True)
class LineStatistics:
    """What the robot has received."""

    frames: int = 0  # valid frames
    hurried: int = 0  # frames that followed the one before too closely, and were not carried out
    garbled: int = 0  # bytes at a baud rate at which the robot does not listen


class RobotLine:
    """A board, its serial line in both directions, and the faults of both."""

    def __init__(
        self,
        board: Board,
        speeds: Mapping[int, Protocol] | None = None,
        *,
        faults: FaultPlan | None = None,
        command_gap: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Connect a board.

        Args:
            speeds: What it speaks, by baud rate [bit/s]; both protocols at their own for None.
            command_gap: Least time between two frames of the host in protocol v1 [s]; a frame that
                comes sooner is lost, as the vendor warns.
        """
        self.faults = faults or FaultPlan()  # what goes wrong; may be added to
        self.statistics = LineStatistics()  # what the robot has received
        self.command_times = CommandTimes()  # when joint commands of protocol v2 came
        # the wire from the host
        self.to_robot = Wire(self.faults, FaultKind.DEAF, seed, slow=False)
        # the wire to the host
        self.to_host = Wire(self.faults, FaultKind.SILENCE, seed + 1, slow=True)
        self._board = board
        self._functions, self._registers = Functions(board), Registers(board)
        self._by_baud = dict(speeds or {V2.baud: V2, V1.baud: V1})
        self._command_gap = command_gap
        self._baud = next(iter(self._by_baud))
        self._forget_partial_frames()
        self._received_at = self._frame_end = -math.inf
        self._battery_fault: Fault | None = None
        self._powered = self._plugged = True
        self._now = 0.0

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""
        return self._baud

    @property
    def plugged(self) -> bool:
        """Whether the port is there, faults considered."""
        return self._plugged

    def set_baud(self, baud: int) -> None:
        """Follow the speed that the host has set [bit/s]."""
        if baud != self._baud:
            self._baud = baud
            self._forget_partial_frames()

    def receive(self, data: bytes, now: float) -> None:
        """Receive bytes that the host has begun to send."""
        if self._baud not in self._by_baud:
            self.statistics.garbled += len(data)
            return
        self.to_robot.put(data, now, self._baud)

    def advance(self, now: float) -> bytes:
        """Advance the time; return what has arrived at the host by then."""
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
        """When :meth:`advance` has something to do next, without new bytes [s]."""
        return min(
            self.to_robot.next_arrival,
            self.to_host.next_arrival,
            self._push_time,
            self.faults.next_change(self._now),
        )

    @property
    def _push_time(self) -> float:
        return self._functions.next_push

    def _push(self, now: float) -> None:
        self._board.advance(now)
        frame = self._functions.push(now)
        if self._board.is_booted:
            self._send(frame, V2, now)

    def _receive(self, arrived: Arrival) -> None:
        protocol, parser = self._by_baud.get(self._baud), self._parser
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
        if protocol is V1 and gap < self._command_gap:
            self.statistics.hurried += 1
            return
        self.statistics.frames += 1
        if protocol is V2 and frame.address in JOINT_COMMANDS:
            self.command_times.commanded(begin)
        handler = self._functions if protocol is V2 else self._registers
        for answer in handler.handle(frame, now):
            self._send(answer, protocol, now)

    def _forget_partial_frames(self) -> None:
        protocol = self._by_baud.get(self._baud)
        self._parser = None if protocol is None else StreamParser(protocol, HOST_KINDS)

    def _give_up_waiting(self, now: float) -> None:
        if self._parser is not None and self._parser.pending:
            protocol = self._by_baud[self._baud]
            for frame in self._parser.expire():
                self._handle(frame, protocol, now, now, now)

    def _send(self, frame: Frame, protocol: Protocol, now: float) -> None:
        if self._by_baud.get(self._baud) is protocol:  # the host may have gone on to another speed
            self.to_host.put(frame.encode(protocol), now, self._baud)

    def _change_faults(self, now: float) -> None:
        self._now = now
        active = self.faults.active
        brown_out = active(FaultKind.BROWN_OUT, now) is not None
        if brown_out == self._powered:
            self._powered = not brown_out
            self._board.advance(now)
            self._board.switch_power(self._powered)
            self._functions.restart()
            self._registers.restart()
        battery = active(FaultKind.BATTERY, now)
        if battery is not None and battery is not self._battery_fault:
            self._board.battery.charge = battery['level']
        self._battery_fault = battery
        limp = active(FaultKind.LIMP, now)
        if self._powered:
            self._board.servos.fail(None if limp is None else int(limp['motor']))
        self._board.imu_failed = active(FaultKind.IMU, now) is not None
        self._plugged = active(FaultKind.UNPLUG, now) is None
