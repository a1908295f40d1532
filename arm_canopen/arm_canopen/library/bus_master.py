# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One bus with its network, drives and cycle, from the first frame to the safe end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
import struct
import time

from black_box import BlackBox, BlackBoxSettings

from ..can.bus import Bus
from ..can.frame import Frame
from ..can.load import BusLoad
from ..cia402.drive import Drive
from ..cia402.drive_commands import DriveCommands
from ..cia402.motion import MotionSource
from ..cia402.motion_group import MotionGroup
from ..cia402.state_machine import Command
from ..cia402.stop_sequence import SHUTDOWN_MAX
from ..config.model import BusConfig
from ..exceptions import BusError, CanopenError, DriveError
from ..master.events import Event, EventKind, Report, Severity
from ..master.network import Network
from ..master.other_master import describe, listen, refuse_other_master
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread, OWNER
from ..master.scheduler import Scheduler
from ..standard.cob_id import CobId
from ..standard.objects import Index
from ..standard.sdo import DownloadRequest
from .bus_recording import BusRecording

THREAD_PRIORITY = 50  # SCHED_FIFO, as ros2_control has it
QUICK_STOP = struct.pack('<H', Command.QUICK_STOP)
STOP_TIMEOUT = SHUTDOWN_MAX + 2.0  # [s] for all drives to stop; each has its own shorter limits
INSISTED, INSIST_PAUSE = 10, 0.01  # times and [s] in which a full queue has to take a last frame
QUEUED_CYCLES = 2  # whose frames may wait for the bus; older ones are worth nothing
NO_FAULTS = (EventKind.BOOT, EventKind.BOOT_FAILED, EventKind.SDO)
"""A device that is absent is no fault of one in operation."""


async def leave_device(
    device: RemoteNode, axes: Sequence[DriveCommands], scheduler: Scheduler
) -> None:
    """Stop the axes of a device, then let the master end without a reaction of the device.

    From the first step on, nothing but that is commanded to them.

    Raises:
        DriveError: An axis was not seen to rest without power; the device goes on to watch the
            master, and stops it.
    """
    ends = [axis.leave() for axis in axes]
    if not device.was_booted:
        return  # nothing was commanded to it
    await scheduler.gather(ends)
    for axis in axes:
        if not await axis.drive.stop.confirmed():  # by itself, or by another master
            raise DriveError(f'{axis.drive.name} moves or is enabled again; cut its power')
    await device.unwatch()


def frames_per_cycle(config: BusConfig) -> int:
    """Return how many frames the master sends in a cycle: SYNC, heartbeat, RPDOs, and SDOs."""
    rpdos = sum(pdo.enabled for node in config.nodes for pdo in node.rpdos)
    return 2 + rpdos + len(config.nodes)


class BusMaster:
    """The master of one bus, without anything that shows it to others."""

    def __init__(
        self,
        config: BusConfig,
        can: Bus,
        report: Report,
        *,
        beside_master: bool = False,
        black_box: BlackBoxSettings | None = None,
    ) -> None:
        """Build it; nothing is sent before :meth:`start`.

        Args:
            config: The bus.
            can: The open CAN interface; it stays the caller's to close.
            report: Takes events, in the thread of the cycle.
            beside_master: Start although another master is found, and command no device of its.
            black_box: How the last frames are written when a fault happens; None for not at all.
        """
        self.config = config  # the bus
        self.can = can  # its CAN interface
        can.limit_queue(QUEUED_CYCLES * frames_per_cycle(config))
        self._report_event = report
        self._beside_master = beside_master
        self.load = BusLoad(config.master.bitrate, time.monotonic())  # how busy the bus is
        # writes the last frames when a fault happens; None without
        self.black_box: BlackBox | None = None
        self._transmit: Callable[[Frame], None] = self._send
        receive: Callable[[Frame], None] = self.load.count
        if black_box is not None:
            recording = BusRecording(config, can.name, black_box.window)
            self.black_box = BlackBox(f'can_{can.name}', recording, black_box)
            self._transmit = recording.sending(self._send)
            receive = recording.receiving(self.load.count)
        # its devices
        self.network = Network(config, self._transmit, self._report, beside_master=beside_master)
        self.network.on_frame = receive
        # the thread of the cycle, which owns all of this once it was started
        self.thread = NetworkThread(can, self.network)
        scheduler = self.network.scheduler
        drives = [
            Drive(device, scheduler, axis)
            for device in self.network.nodes.values()
            if device.config.is_drive
            for axis in device.config.axes
        ]
        # commands of the drives, by name
        self.commands = {drive.name: DriveCommands(drive, scheduler) for drive in drives}
        self._group = MotionGroup(drives, self._report)
        self.network.on_cycle = self._group.cycle
        self.thread.on_defect = self._stop_without_cycle
        self.started = False  # the cycle was started, so that the devices are ours to stop
        self._leaving = False
        # called in the thread of the cycle when the last device has booted
        self.on_operational: Callable[[], None] = lambda: None
        self._operational: set[str] = set()

    def axes(self, device: RemoteNode) -> list[DriveCommands]:
        """Return the commands of the axes of a device."""
        return [entry for entry in self.commands.values() if entry.drive.node is device]

    def listen(self) -> str:
        """Listen for another master before the first frame; call it right before :meth:`start`.

        Returns:
            The other master, where the bus is led beside it; else empty.

        Raises:
            OtherMasterError: There is one, and beside_master is not set.
        """
        if not self._beside_master:
            refuse_other_master(self.can, self.config)
            return ''
        found = listen(self.can, self.config)
        return describe(found) if found else ''

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Boot the devices and start the cycle, after ``begin`` in its thread."""
        self.started = True
        if self.black_box is not None:
            self.black_box.start()
        self.thread.start(begin)

    def close(self) -> None:
        """End the cycle, and write what the black box still has to write."""
        self.thread.stop()
        if self.black_box is not None:
            self.black_box.close()

    def stop_drives(self) -> None:
        """Bring every drive to quick stop and disable it; the cycle goes on.

        Raises:
            DriveError: They did not all stop, or nobody can know.
        """
        scheduler = self.network.scheduler

        async def leave() -> None:
            self._leaving = True
            devices = self.network.nodes.values()
            await scheduler.gather(
                [
                    scheduler.spawn(leave_device(each, self.axes(each), scheduler))
                    for each in devices
                ]
            )

        try:
            self.thread.run_coroutine(leave).result(STOP_TIMEOUT)
        except CanopenError as error:
            raise DriveError(
                f'the drives could not be stopped: {error}; those that watch the heartbeat of the '
                'master stop by themselves'
            ) from error
        except FutureTimeoutError:
            raise DriveError('the drives did not all stop in time') from None

    def attach(self, source: MotionSource) -> Future[None]:
        """Let a motion source command its axes, from any thread; nothing waits.

        Returns:
            Done before the next cycle; or KeyError: an axis is no drive of this bus, BusError: the
            cycle ends or has ended.
        """

        def attach() -> None:
            if self._leaving:
                raise BusError(f'{OWNER} is ending')
            self._group.attach(source)

        return self.thread.call(attach)

    def detach(self, source: MotionSource) -> Future[None]:
        """End a motion source, from any thread; drives that it moved are braked.

        Returns:
            Done before the next cycle.
        """
        return self.thread.call(lambda: self._group.detach(source))

    def _stop_without_cycle(self) -> str:
        """Send a quick stop to each drive that may have power; nobody waits for an answer.

        Return what was sent, to which drives it is all that stops them, and which did not get it.
        """
        if self.black_box is not None:
            self.black_box.fault('', f'{OWNER} has ended by a defect')
        drives = [axis.drive for axis in self.commands.values()]
        powered = [each for each in drives if each.node.was_booted and not each.stop.disabled]
        refused: dict[str, BusError] = {}
        for drive in powered:
            index = drive.objects.at(Index.CONTROLWORD)
            request = DownloadRequest(index, 0, QUICK_STOP)
            cob_id = CobId.SDO_REQUEST + drive.node.config.node_id
            if (refusal := self._insist(Frame(cob_id, request.encode()))) is not None:
                refused[drive.name] = refusal
        if not powered:
            return ''
        sent = ', '.join(drive.name for drive in powered if drive.name not in refused)
        text = f'; quick stop sent to {sent}' if sent else ''
        if refused:
            reason = next(iter(refused.values()))
            text += f'; no quick stop could be sent to {", ".join(refused)} ({reason})'
        unwatching = [drive.name for drive in powered if not drive.node.watch_slot]
        if unwatching:
            text += (
                f'; nothing else stops {", ".join(unwatching)}, without a watch of the heartbeat '
                'of the master (0x1016): cut the power of what goes on'
            )
        return text

    def _insist(self, frame: Frame) -> BusError | None:
        """Send a frame, again and again while the bus refuses it; return why it has not left."""
        refusal: BusError | None = None
        for _ in range(INSISTED):
            try:
                self._transmit(frame)
            except BusError as error:  # noqa: PERF203
                refusal = error
                time.sleep(INSIST_PAUSE)
            else:
                return None
        return refusal

    def _send(self, frame: Frame) -> None:
        self.can.send(frame)
        self.load.count(frame)

    def _report(self, event: Event) -> None:
        self._report_event(event)
        if self.black_box is not None:
            is_fault = event.severity is Severity.ERROR and event.kind not in NO_FAULTS
            keep = self.black_box.fault if is_fault else self.black_box.note
            keep(event.node, event.text)
        if event.kind is EventKind.HEARTBEAT_LOST:
            self._operational.discard(event.node)
        elif event.kind is EventKind.BOOT and event.node not in self._operational:
            if not self.network.nodes[event.node].online:
                return  # a warning on the way
            self._operational.add(event.node)
            if len(self._operational) == len(self.config.nodes):
                self.on_operational()
