# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Devices and axes of the bus, for callers outside of the cycle; each call blocks until done."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import logging

from canopen_core import DriveError, ObjectError
from canopen_core.standard import (
    decode,
    DriveState,
    encode,
    find_object,
    NmtCommand,
    Number,
    object_address,
    ObjectEntry,
    OperationMode,
    POSITION_MODES,
    Value,
)

from .cia402.commands import AxisCommands, Sequence
from .cia402.modes import Move
from .cia402.state import DriveStatus
from .config.model import NodeConfig
from .master.process_image import ReceivedTpdo
from .master.remote_node import node_status, NodeStatus, RemoteNode
from .master.runner import NetworkThread

logger = logging.getLogger('arm_canopen')

MOVE_TIMEOUT = 60.0  # [s]


class DeviceSdo:
    """Objects of a device by SDO, typed by its EDS.

    An object is an index such as ``0x6041``, or a text: ``'Statusword'``, ``'0x607D:02'``,
    ``'Software position limit/Max'``. The ``timeout`` in [s] applies to each answer; default: the
    SDO time-out of bus.yml.

    Raises:
        ObjectError: The EDS has no such object, or several; the message names them.
        SdoError: The device refused, or did not answer in time.
        BusError: The master has ended.
    """

    def __init__(self, device: RemoteNode, thread: NetworkThread) -> None:
        self._device = device
        self._thread = thread

    def read(self, target: int | str, subindex: int = 0, *, timeout: float | None = None) -> Value:
        """Read an object."""
        upload = partial(self._device.objects.upload, _path(target, subindex), timeout)
        entry, data = self._thread.run_coroutine(upload).result()
        return decode(entry.data_type, data)

    def write(
        self,
        target: int | str,
        value: Value,
        subindex: int = 0,
        *,
        timeout: float | None = None,
    ) -> None:
        """Write an object; return when the device has confirmed it.

        Raises:
            CodecError: The value does not fit the type.
            DriveError: The master writes the object itself in each cycle.
        """

        def to_bytes(entry: ObjectEntry) -> bytes:
            return encode(entry.data_type, value)

        path = _path(target, subindex)
        download = partial(self._device.objects.download, path, to_bytes, timeout)
        self._thread.run_coroutine(download).result()


class CanopenDevice:
    """A device of bus.yml, such as an I/O module or an encoder.

    Attributes:
        name: Its name in bus.yml.
        sdo: Its objects, always by SDO.
    """

    def __init__(self, device: RemoteNode, thread: NetworkThread) -> None:
        self.name = device.name
        self.sdo = DeviceSdo(device, thread)
        self._device = device
        self._thread = thread

    @property
    def config(self) -> NodeConfig:
        """Its configuration, from bus.yml and its EDS."""
        return self._device.config

    def status(self) -> NodeStatus:
        """Return a snapshot of the device: online, NMT state, boot phase, EMCYs, SDO counters.

        Raises:
            BusError: The master has ended.
        """
        return self._thread.call(lambda: node_status(self._device, self._thread.now())).result()

    def read(self, target: int | str, subindex: int = 0, *, timeout: float | None = None) -> Value:
        """Read an object: from its TPDO while that is received, else by SDO.

        Arguments and errors are those of :class:`DeviceSdo`.
        """
        path = _path(target, subindex)
        entry = find_object(self.config.dictionary, path)

        def received() -> Value | None:
            reader = self._device.image.reader(*entry.address)
            stale = reader is None or reader.source.stale(self._thread.now())
            return None if stale or reader is None else reader.value

        value = self._thread.call(received).result()
        return self.sdo.read(path, timeout=timeout) if value is None else value

    def write(
        self,
        target: int | str,
        value: Value,
        subindex: int = 0,
        *,
        timeout: float | None = None,
    ) -> None:
        """Write an object: by the RPDOs that carry it, without confirmation, else by SDO.

        The other objects of such an RPDO keep their values. Arguments and errors are those of
        :meth:`DeviceSdo.write`; an RPDO needs an operational device.

        Raises:
            CanopenError: The device is not operational, or the bus refuses the RPDO.
        """
        path = _path(target, subindex)
        objects, address = self._device.objects, find_object(self.config.dictionary, path).address
        if objects.image.mapped_output(*address) is None:
            self.sdo.write(path, value, timeout=timeout)
            return
        objects.check_owner(address[0])
        values = {address: objects.check_output(*address, value)}
        publish = partial(self._thread.network.publish_objects, self._device, values)
        self._thread.call(publish).result()

    def subscribe(
        self, target: int | str, callback: Callable[[Number], None], subindex: int = 0
    ) -> Callable[[], None]:
        """Call ``callback`` with each value of an object that a TPDO delivers.

        The callback runs in the cycle thread: it must not block or call this master. Its
        exceptions are logged.

        Returns:
            A function that ends the subscription.

        Raises:
            ObjectError: The EDS has no such object, or several; or no TPDO carries it.
        """
        entry = find_object(self.config.dictionary, _path(target, subindex))
        reader = self._device.image.reader(*entry.address)
        if reader is None:
            raise ObjectError(
                f'no TPDO of {self.name} carries {entry}; map it in bus.yml, or read it'
            )

        def received(_: ReceivedTpdo) -> None:
            try:
                if (value := reader.value) is not None:
                    callback(value)
            except Exception:
                logger.exception('%s: the callback for %s failed', self.name, entry)

        reader.source.listen(received)
        return partial(reader.source.ignore, received)

    def send_nmt(self, command: NmtCommand) -> None:
        """Send an NMT command to the device; return when the bus has taken it.

        Moving axes are brought to rest first, unless the command is START.

        Raises:
            BusError: The bus has not taken it, or the master has ended.
        """
        network, node_id = self._thread.network, self._device.config.node_id
        self._thread.run_coroutine(lambda: network.command_nmt(command, node_id)).result()


class CanopenDrive:
    """A drive: its state as of the last cycle, and its commands.

    Positions and velocities are in the user units of bus.yml (rad and rad/s for a revolute joint).
    A command returns a text that says what was reached. It raises a DriveError if the drive
    refuses or is too late, or another command runs, and a BusError if the master has ended.
    Commands that stop the drive cancel a running command.

    Attributes:
        name: Its name in bus.yml, or its channel name on a device with several axes.
        sdo: Objects of its device.
    """

    def __init__(self, commands: AxisCommands, thread: NetworkThread) -> None:
        axis = commands.axis
        self.name = axis.name
        self.sdo = DeviceSdo(axis.node, thread)
        self._commands = commands
        self._axis = axis
        self._thread = thread

    def status(self) -> DriveStatus:
        """Return a snapshot of the drive: state, mode, position, age, error text.

        Raises:
            BusError: The master has ended.
        """
        return self._thread.call(self._axis.status).result()

    @property
    def state(self) -> DriveState:
        """State of the power drive system."""
        return self.status().state

    @property
    def position(self) -> float:
        """Actual position; the last known one of a lost drive, NaN before the first."""
        return self.status().position

    @property
    def velocity(self) -> float:
        """Actual velocity."""
        return self.status().velocity

    @property
    def mode(self) -> OperationMode:
        """Commanded mode of operation."""
        return self._thread.call(lambda: self._axis.mode.number).result()

    def init(self) -> str:
        """Reset a fault, enable, and home if bus.yml names a method; select no mode."""
        return self._request('init')

    def enable(self) -> str:
        """Enable the drive (Operation Enabled); does not reset a fault."""
        return self._request('enable')

    def recover(self) -> str:
        """Reset a fault and enable the drive (Operation Enabled)."""
        return self._request('recover')

    def home(self, method: int | None = None) -> str:
        """Home by a method of 0x6098 (default: the drive's own); restore the previous mode."""
        return self._run('home', partial(self._commands.home, method))

    def select_mode(self, mode: OperationMode | int) -> str:
        """Switch the mode of operation, by its number in 0x6060; return when the drive reports it.

        Raises:
            DriveError: It is no mode of CiA 402, or the drive refuses it.
        """
        return self._run('mode', partial(self._commands.select_mode, _operation_mode(mode)))

    def disable(self) -> str:
        """Disable the torque (Switched On); return when the axis has stopped."""
        return self._request('disable')

    def halt(self) -> str:
        """Brake and stay enabled; return at standstill. The next target resumes motion."""
        return self._request('halt')

    def quick_stop(self) -> str:
        """Quick stop; return at standstill, in the state that option code 0x605A sets."""
        return self._request('quick_stop')

    def shutdown(self) -> str:
        """Bring the drive to rest, and switch off its power."""
        return self._request('shutdown')

    def set_target(self, target: float) -> str:
        """Command a position, velocity or effort in user units; return when the drive has it."""
        return self._deliver(lambda: self._commands.set_target(target))

    def move_to(
        self, position: float, *, relative: bool = False, timeout: float = MOVE_TIMEOUT
    ) -> str:
        """Move to a position, and wait until the drive stands still there.

        Unless the drive is in mode 1, 7 or 8, mode 1 (profile position) is selected first. A late
        drive is halted, unless another client has begun a motion, which raises an error.

        Args:
            position: In user units.
            relative: Count from the last set-point.
            timeout: How long the motion may take in [s].
        """
        if self.mode not in POSITION_MODES:
            self.select_mode(OperationMode.PROFILE_POSITION)
        axis, commands = self._axis, self._commands

        def give() -> str:
            if axis.mode.number is OperationMode.PROFILE_POSITION:
                return commands.move(Move(position, relative=relative))
            return commands.set_target(axis.setpoint + position if relative else position)

        return self._thread.run_coroutine(partial(commands.arrive, give, timeout)).result()

    def _request(self, name: str) -> str:
        return self._thread.run(partial(self._commands.request, name)).result()

    def _run(self, name: str, sequence: Sequence) -> str:
        return self._thread.run(lambda: self._commands.run(name, sequence())).result()

    def _deliver(self, command: Callable[[], str]) -> str:
        return self._thread.run(lambda: self._commands.deliver(command)).result()


def _operation_mode(mode: OperationMode | int) -> OperationMode:
    try:
        return OperationMode(mode)
    except ValueError:
        modes = ', '.join(f'{each.name} ({each.value})' for each in OperationMode if each)
        raise DriveError(f'unknown mode of operation {mode!r}; choose one of {modes}') from None


def _path(target: int | str, subindex: int) -> str:
    return target if isinstance(target, str) else object_address(target, subindex)
