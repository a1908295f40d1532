# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CANopen master of one bus, from boot to safe shutdown, without ROS."""

from __future__ import annotations

import atexit
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from contextlib import ExitStack
import logging
from pathlib import Path
import struct
import threading
import time
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING

from black_box import BlackBox, BlackBoxSettings
from canopen_core import BootError, BusError, CanopenError, DriveError, OtherMasterError
from canopen_core.can import Bus, BusLoad, Frame, open_bus
from canopen_core.standard import CobId, Index, sdo
from realtime_loop import raise_priority

from .cia402.axis import Axis
from .cia402.commands import AxisCommands
from .cia402.motion import MotionSource
from .cia402.motion_group import MotionGroup
from .cia402.state_machine import Command
from .cia402.stop import SHUTDOWN_MAX
from .config import load_bus
from .config.model import BusConfig
from .config.model.checks import check_bus
from .device import CanopenDevice, CanopenDrive, DeviceSdo
from .master.events import Event, EventKind, Report, Severity
from .master.network import Network
from .master.other_master import describe, listen, refuse_other_master
from .master.remote_node import RemoteNode
from .master.runner import Clock, NetworkThread, OWNER
from .master.scheduler import Scheduler
from .recording import BusRecording

if TYPE_CHECKING:
    from typing_extensions import Self

THREAD_PRIORITY = 50  # SCHED_FIFO, as ros2_control has it
QUICK_STOP = struct.pack('<H', Command.QUICK_STOP)
STOP_TIMEOUT = SHUTDOWN_MAX + 2.0  # [s] for all drives to stop; each has its own shorter limits
INSISTED, INSIST_PAUSE = 10, 0.01  # times and [s] in which a full queue has to take a last frame
QUEUED_CYCLES = 2  # whose frames may wait for the bus; older ones are worth nothing
NO_FAULTS = (EventKind.BOOT, EventKind.BOOT_FAILED, EventKind.SDO)
"""Events of absent devices, which are no faults of devices in operation."""
BOOT_ATTEMPTS = 10  # boot time-outs of a device for which a boot waits
LEVELS = {
    Severity.INFO: logging.INFO,
    Severity.WARNING: logging.WARNING,
    Severity.ERROR: logging.ERROR,
}

logger = logging.getLogger('arm_canopen')


def log_event(event: Event) -> None:
    """Write an event of the bus to the logger ``arm_canopen``."""
    routine = event.severity is Severity.INFO and event.kind is EventKind.NMT_STATE
    logger.log(logging.DEBUG if routine else LEVELS[event.severity], '%s', event)


async def leave_device(
    device: RemoteNode, axes: Sequence[AxisCommands], scheduler: Scheduler
) -> None:
    """Stop the axes of a device, so that it does not react to the end of the master.

    From the first step on, the axes get no other commands.

    Raises:
        DriveError: An axis did not confirm standstill without power; the device keeps monitoring
            the master, and stops the axis when the master ends.
    """
    ends = [axis.leave() for axis in axes]
    if not device.was_booted:
        return  # nothing was commanded to it
    await scheduler.gather(ends)
    for axis in (each.axis for each in axes):
        if not await axis.stop.confirmed():  # by itself, or by another master
            raise DriveError(f'{axis.name} moves or is enabled again; cut its power')
    await device.unwatch()


def frames_per_cycle(config: BusConfig) -> int:
    """Return how many frames the master sends in a cycle: SYNC, heartbeat, RPDOs, and SDOs."""
    rpdos = sum(pdo.enabled for node in config.nodes for pdo in node.rpdos)
    return 2 + rpdos + len(config.nodes)


class CanopenMaster:
    """Master of one bus: boots its devices, runs the SYNC cycle, and stops the drives at the end.

    The object runs the same cycle as the ROS node, in its own thread. Call its methods from any
    other thread: each waits for its result, and raises a BusError before :meth:`boot` and after
    :meth:`close`. :meth:`close`, or leaving the ``with`` statement, brings every drive to quick
    stop and disables it. So does the end of a program that did neither; if the program is killed,
    the drives stop because the heartbeat of the master is missing (0x1016).

    Attributes:
        bus: The configuration of the bus.
        drives: The axes of its drives, by the names of bus.yml.
        devices: Its devices, by the names of bus.yml.

    The other attributes and methods are for programs with their own interface to the bus, such as
    the ROS nodes, which hand work to its thread without waiting.
    """

    def __init__(
        self,
        config: BusConfig,
        can: Bus,
        *,
        on_event: Report = log_event,
        thread_priority: int = THREAD_PRIORITY,
        beside_master: bool = False,
        black_box: BlackBoxSettings | None = None,
        clock: Clock | None = None,
    ) -> None:
        """Create the master; it sends nothing before :meth:`boot`.

        Args:
            config: The bus.
            can: The open CAN interface; the caller closes it.
            on_event: Called with each event of the bus, in the cycle thread; it must not block.
            thread_priority: SCHED_FIFO priority of the cycle, where it is allowed; 0 for none.
            beside_master: Start even if another master is found, and command none of its devices.
            black_box: Settings for recording the last frames at a fault; None for no recording.
            clock: Replaced in tests; None for the steady clock.
        """
        self.bus = config
        self.can = can
        can.limit_queue(QUEUED_CYCLES * frames_per_cycle(config))
        self._clock = clock or Clock()
        self.load = BusLoad(config.master.bitrate, self._clock.now())  # how busy the bus is
        self.black_box: BlackBox | None = None  # writes the last frames when a fault happens
        self.started = False  # the cycle was started, so that the devices are ours to stop
        # called in the thread of the cycle when the last device has booted
        self.on_operational: Callable[[], None] = lambda: None
        self._on_event = on_event
        self._thread_priority = thread_priority
        self._beside_master = beside_master
        self._operational: set[str] = set()
        self._booted = threading.Event()
        self._leaving = self._closed = False
        self._exit = ExitStack()
        self._transmit: Callable[[Frame], None] = self._send
        receive: Callable[[Frame], None] = self.load.count
        if black_box is not None:
            recording = BusRecording(config, can.name, black_box.window)
            self.black_box = BlackBox(f'can_{can.name}', recording, black_box)
            self._transmit = recording.sending(self._send)
            receive = recording.receiving(self.load.count)
        self.network = Network(config, self._transmit, self._report, beside_master=beside_master)
        self.network.on_frame = receive
        # of the cycle; it owns all of this once it was started
        self.thread = NetworkThread(can, self.network, self._clock)
        self.thread.refuse_before_start(f'{OWNER} does not run; call boot() first')
        self.thread.on_defect = self._stop_without_cycle
        self.thread.on_failure = self._booted.set  # who waits there sees the failure
        nodes, scheduler = self.network.nodes, self.network.scheduler
        drives = [
            Axis(device, scheduler, axis)
            for device in nodes.values()
            if device.config.is_drive
            for axis in device.config.axes
        ]
        self.commands = {drive.name: AxisCommands(drive, scheduler) for drive in drives}
        self._group = MotionGroup(drives, self._report)
        self.network.on_cycle = self._group.cycle
        self.drives: Mapping[str, CanopenDrive] = MappingProxyType(
            {name: CanopenDrive(each, self.thread) for name, each in self.commands.items()}
        )
        self.devices: Mapping[str, CanopenDevice] = MappingProxyType(
            {name: CanopenDevice(each, self.thread) for name, each in nodes.items()}
        )

    @classmethod
    def from_bus_yml(
        cls,
        path: str | Path,
        bus: str = 'auto',
        *,
        on_event: Report = log_event,
        thread_priority: int = THREAD_PRIORITY,
        beside_master: bool = False,
    ) -> Self:
        """Create a master from a bus.yml, and open its bus; :meth:`close` closes the bus.

        Args:
            path: The bus.yml.
            bus: Name of the bus: ``can0``, ``vcan0``, ``udp_multicast:239.x.y.z[:port]``,
                ``INTERFACE:CHANNEL[@BITRATE]`` of python-can, or ``auto``.
            on_event: This and the arguments below are those of the constructor.

        Raises:
            ConfigError: The bus.yml or an EDS is wrong; every problem is listed.
            BusError: The bus cannot be opened.
        """
        config = load_bus(path)
        for warning in (*config.warnings, *check_bus(config).warnings):
            logger.warning('%s', warning)
        with ExitStack() as stack:
            can = stack.enter_context(open_bus(bus))
            master = cls(
                config,
                can,
                on_event=on_event,
                thread_priority=thread_priority,
                beside_master=beside_master,
            )
            master._exit = stack.pop_all()
        return master

    def boot(self, timeout: float | None = None) -> None:
        """Listen for another master, start the cycle, and wait until all devices are operational.

        Call it again to wait for devices that were missing or lost; the master boots them whenever
        they appear. The ``timeout`` is in [s], by default ten boot time-outs of the slowest
        device.

        Raises:
            OtherMasterError: Another master was found or cannot be ruled out.
            BootError: Devices are missing; the message has the phase of each.
            BusError: The master has ended, or a defect ends it meanwhile.
        """
        if self._closed:
            raise BusError(f'{OWNER} has ended')
        if not self.started:
            if other := self.listen():
                logger.warning('beside_master is set; starting anyway: %s', other)
            atexit.register(self.close)
            self.start(self._raise_priority)
        if timeout is None:
            longest = max((each.boot_timeout for each in self.bus.nodes), default=0.0)
            timeout = BOOT_ATTEMPTS * longest
        booted = not self.bus.nodes or self._booted.wait(timeout)
        if self.thread.failure is not None:
            raise self.thread.failure
        if not booted:
            statuses = [each.status() for each in self.devices.values()]
            missing = '; '.join(
                f'{each.name} (node {each.node_id}) {each.phase.value}'
                + (f': {each.phase_detail}' if each.phase_detail else '')
                for each in statuses
                if not each.online
            )
            raise BootError(
                f'not operational after {timeout:g} s: {missing}. '
                'Check power, cable, bit rate and node ids of those that do not answer'
            )

    def drive(self, name: str) -> CanopenDrive:
        """Return a drive by its name in bus.yml.

        Raises:
            KeyError: There is no drive of that name.
        """
        if name not in self.drives:
            raise KeyError(
                f'no drive {name!r} on this bus; choose one of {", ".join(self.drives)}'
            )
        return self.drives[name]

    def device(self, name: str | int) -> CanopenDevice:
        """Return a device by its name in bus.yml, or by its node id.

        Raises:
            KeyError: bus.yml has no such device.
        """
        for each in self.devices.values():
            if name in (each.name, each.config.node_id):
                return each
        known = ', '.join(f'{each.name} ({each.config.node_id})' for each in self.devices.values())
        raise KeyError(f'no device {name!r} on this bus; choose one of {known}')

    def sdo(self, name: str | int) -> DeviceSdo:
        """Return the SDO access to a device, by its name in bus.yml or its node id.

        Raises:
            KeyError: bus.yml has no such device.
        """
        return self.device(name).sdo

    def attach(self, source: MotionSource) -> None:
        """Attach a motion source, which commands its axes in each cycle from now on.

        Raises:
            KeyError: An axis is no drive of this bus.
            BusError: The master has ended.
        """
        self.begin_attach(source).result()

    def detach(self, source: MotionSource) -> None:
        """Detach a motion source, and brake the drives that it moved.

        Raises:
            BusError: The master has ended.
        """
        self.begin_detach(source).result()

    def close(self) -> None:
        """Stop and disable all drives, end the cycle, close the bus; repeated calls are allowed.

        Raises:
            DriveError: A drive did not stop, or its state is unknown; everything else is done.
        """
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        with self._exit:
            try:
                if self.started:
                    self.stop_drives()
            finally:
                self.end()

    def __enter__(self) -> Self:
        """Return the master itself."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the master; a drive that does not stop never hides an earlier error."""
        try:
            self.close()
        except DriveError as error:
            if exc is None:
                raise
            logger.error('%s', error)  # its traceback says nothing

    def axes(self, device: RemoteNode) -> list[AxisCommands]:
        """Return the commands of the axes of a device."""
        return [entry for entry in self.commands.values() if entry.axis.node is device]

    def listen(self) -> str:
        """Listen for another master before the first frame; call it right before :meth:`start`.

        Returns:
            The other master, or why none could be found, if the bus runs beside it; else empty.

        Raises:
            OtherMasterError: Another master was found or cannot be ruled out, and beside_master is
                not set.
        """
        if not self._beside_master:
            refuse_other_master(self.can, self.bus, self._clock.now)
            return ''
        try:
            found = listen(self.can, self.bus, self._clock.now)
        except OtherMasterError as error:
            return str(error)
        return describe(found) if found else ''

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Boot the devices and start the cycle; its thread calls ``begin`` first."""
        self.started = True
        if self.black_box is not None:
            self.black_box.start()
        self.thread.start(begin)

    def end(self) -> None:
        """End the cycle, and write pending recordings of the black box."""
        self.thread.stop()
        if self.black_box is not None:
            self.black_box.close()

    def stop_drives(self) -> None:
        """Bring every drive to quick stop and disable it; the cycle goes on.

        Raises:
            DriveError: A drive did not stop, or its state is unknown.
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

    def begin_attach(self, source: MotionSource) -> Future[None]:
        """Attach a motion source from any thread, without waiting.

        Returns:
            A future, done before the next cycle. Its errors: KeyError, an axis is no drive of this
            bus; BusError, the cycle ends or has ended.
        """

        def attach() -> None:
            if self._leaving:
                raise BusError(f'{OWNER} is ending')
            self._group.attach(source)

        return self.thread.call(attach)

    def begin_detach(self, source: MotionSource) -> Future[None]:
        """Detach a motion source from any thread, and brake the drives that it moved.

        Returns:
            Done before the next cycle.
        """
        return self.thread.call(lambda: self._group.detach(source))

    def _stop_without_cycle(self) -> str:
        """Send a quick stop to each drive that may have power, without waiting for answers.

        Return a text: what was sent, which drives nothing else stops, and which did not get it.
        """
        if self.black_box is not None:
            self.black_box.fault('', f'{OWNER} has ended by a defect')
        drives = [each.axis for each in self.commands.values()]
        powered = [each for each in drives if each.node.was_booted and not each.stop.disabled]
        refused: dict[str, BusError] = {}
        for drive in powered:
            index = drive.view.at(Index.CONTROLWORD)
            request = sdo.DownloadRequest(index, 0, QUICK_STOP)
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
        """Send a frame, and retry while the bus refuses it; return the error if it fails."""
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
        if event.kind is EventKind.HEARTBEAT_LOST:
            self._booted.clear()
        try:
            self._on_event(event)
        except Exception:
            logger.exception('on_event failed, at: %s', event)
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
            if len(self._operational) == len(self.bus.nodes):
                self._booted.set()
                self.on_operational()

    def _raise_priority(self) -> None:
        outcome = raise_priority(self._thread_priority, 'the CANopen cycle')
        if outcome.text:
            logger.info('%s', outcome.text)
