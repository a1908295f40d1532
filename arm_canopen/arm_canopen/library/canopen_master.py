# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The CANopen master in a program of one's own, without ROS."""

from __future__ import annotations

import atexit
from collections.abc import Mapping
from contextlib import ExitStack
import logging
from pathlib import Path
import threading
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING

from realtime_loop import raise_priority

from ..can import open_bus
from ..can.bus import Bus
from ..cia402.motion import MotionSource
from ..config import load_bus
from ..config.model import BusConfig
from ..config.model.checks import check_bus
from ..exceptions import BootError, BusError, DriveError
from ..master.events import Event, EventKind, Report, Severity
from ..master.runner import OWNER
from .bus_master import BusMaster, THREAD_PRIORITY
from .canopen_drive import CanopenDrive
from .device import CanopenDevice, DeviceSdo

if TYPE_CHECKING:
    from typing_extensions import Self

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


class CanopenMaster:
    """Master of one bus: boots its devices, runs the SYNC cycle, and stops the drives at the end.

    The cycle is that of the ROS node. It runs in a thread that belongs to this object; the calls
    come from any other thread, and each waits for its result; before :meth:`boot` and after
    :meth:`close` they raise a BusError. Leaving the ``with`` statement, or
    :meth:`close`, brings every drive to quick stop and disables it. So does the end of a program
    that forgot it; drives of one that was killed stop by the heartbeat of the master (0x1016).

    Attributes:
        bus: The configuration of the bus.
        drives: The axes of its drives, by the names of bus.yml.
        devices: Its devices, by the names of bus.yml.
    """

    def __init__(
        self,
        config: BusConfig,
        can: Bus,
        *,
        on_event: Report = log_event,
        thread_priority: int = THREAD_PRIORITY,
        beside_master: bool = False,
    ) -> None:
        """Build it; nothing is sent before :meth:`boot`.

        Args:
            config: The bus.
            can: The open CAN interface; it stays the caller's to close.
            on_event: Takes what happens on the bus, in the thread of the cycle: it must not wait.
            thread_priority: SCHED_FIFO priority of the cycle, where it is allowed; 0 for none.
            beside_master: Start although another master is found, and command no device of its.
        """
        self.bus = config
        self._thread_priority = thread_priority
        self._on_event = on_event
        self._booted = threading.Event()
        self._master = BusMaster(config, can, self._report, beside_master=beside_master)
        self._master.on_operational = self._booted.set
        self._closed = False
        self._exit = ExitStack()
        thread = self._master.thread
        thread.on_failure = self._booted.set  # who waits there sees the failure
        thread.refuse_before_start(f'{OWNER} does not run; call boot() first')
        self.drives: Mapping[str, CanopenDrive] = MappingProxyType(
            {name: CanopenDrive(each, thread) for name, each in self._master.commands.items()}
        )
        self.devices: Mapping[str, CanopenDevice] = MappingProxyType(
            {
                name: CanopenDevice(each, thread)
                for name, each in self._master.network.nodes.items()
            }
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
        """Read a bus.yml and open a bus, which :meth:`close` closes.

        Args:
            path: The bus.yml.
            bus: Name of the bus: ``can0``, ``vcan0``, ``udp_multicast:239.x.y.z[:port]``,
                ``INTERFACE:CHANNEL[@BITRATE]`` of python-can, or ``auto``.
            on_event: Takes what happens on the bus, in the thread of the cycle: it must not wait.
            thread_priority: SCHED_FIFO priority of the cycle, where it is allowed; 0 for none.
            beside_master: Start although another master is found, and command no device of its.

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

        Called again, it waits for devices that were missing or got lost; they are booted whenever
        they come. The ``timeout`` is in [s], by default ten boot time-outs of the slowest device.

        Raises:
            OtherMasterError: Another master leads this bus.
            BootError: Devices are missing; the message has the phase of each.
            BusError: The master has ended, or ends by a defect meanwhile.
        """
        if self._closed:
            raise BusError(f'{OWNER} has ended')
        if not self._master.started:
            if other := self._master.listen():
                logger.warning('going on beside another master: %s', other)
            atexit.register(self.close)
            self._master.start(self._raise_priority)
        if timeout is None:
            longest = max((each.boot_timeout for each in self.bus.nodes), default=0.0)
            timeout = BOOT_ATTEMPTS * longest
        booted = not self.bus.nodes or self._booted.wait(timeout)
        if self._master.thread.failure is not None:
            raise self._master.thread.failure
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
            KeyError: There is none of that name.
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
        """Return the objects of a device, by its name in bus.yml or its node id.

        Raises:
            KeyError: bus.yml has no such device.
        """
        return self.device(name).sdo

    def attach(self, source: MotionSource) -> None:
        """Let a motion source command its axes in each cycle from now on.

        Raises:
            KeyError: An axis is no drive of this bus.
            BusError: The master has ended.
        """
        self._master.attach(source).result()

    def detach(self, source: MotionSource) -> None:
        """End a motion source; drives that it moved are braked.

        Raises:
            BusError: The master has ended.
        """
        self._master.detach(source).result()

    def close(self) -> None:
        """Stop and disable all drives, end the cycle, close the bus; again is no error.

        Raises:
            DriveError: A drive did not stop, or nobody can know; all else is done.
        """
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        with self._exit:
            try:
                if self._master.started:
                    self._master.stop_drives()
            finally:
                self._master.close()

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it; a drive that does not stop hides no error of before."""
        try:
            self.close()
        except DriveError as error:
            if exc is None:
                raise
            logger.error('%s', error)  # its traceback says nothing

    def _report(self, event: Event) -> None:
        if event.kind is EventKind.HEARTBEAT_LOST:
            self._booted.clear()
        try:
            self._on_event(event)
        except Exception:
            logger.exception('on_event failed, at: %s', event)

    def _raise_priority(self) -> None:
        outcome = raise_priority(self._thread_priority, 'the CANopen cycle')
        if outcome.text:
            logger.info('%s', outcome.text)
