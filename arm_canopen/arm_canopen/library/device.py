# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device of the bus and its objects, for callers outside of the cycle; each call waits."""

from __future__ import annotations

from functools import partial
import time

from ..config.model import NodeConfig
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from ..master.status import node_status, NodeStatus
from ..standard.datatypes import DataType, decode, encode, Value
from ..standard.dictionary import ObjectEntry
from ..standard.nmt import NmtCommand
from ..standard.object_path import find_object


class DeviceSdo:
    """Objects of a device by SDO, typed by its EDS.

    An object is an index such as ``0x6041``, or what a person writes: ``'Statusword'``,
    ``'0x607D:02'``, ``'Software position limit/Max'``.
    """

    def __init__(self, device: RemoteNode, thread: NetworkThread) -> None:
        """Take the device.

        Args:
            device: The device.
            thread: The thread of its network.
        """
        self._device = device
        self._thread = thread

    def read(self, target: int | str, subindex: int = 0) -> Value:
        """Read an object.

        Args:
            target: Its index or name.
            subindex: Sub-index, where an index is given.

        Raises:
            ObjectError: The EDS has no such object.
            SdoError: The device refused, or did not answer within the SDO time-out of bus.yml.
            BusError: The master has ended.
        """
        entry, device = self._entry(target, subindex), self._device
        block = entry.data_type is DataType.DOMAIN
        timeout = device.config.sdo_timeout
        read = partial(device.sdo.read, *entry.address, timeout, block=block)
        return decode(entry.data_type, self._thread.run(read).result())

    def write(self, target: int | str, value: Value, subindex: int = 0) -> None:
        """Write an object; return when the device has it.

        Args:
            target: Its index or name.
            value: The value, of the type of the object.
            subindex: Sub-index, where an index is given.

        Raises:
            ObjectError: The EDS has no such object.
            CodecError: The value does not fit the type.
            DriveError: The master writes the object itself in each cycle.
            SdoError: The device refused, or did not answer within the SDO time-out of bus.yml.
            BusError: The master has ended.
        """
        entry, device = self._entry(target, subindex), self._device
        device.objects.check_owner(entry.index)
        data = encode(entry.data_type, value)
        timeout = device.config.sdo_timeout
        self._thread.run(partial(device.sdo.write, *entry.address, data, timeout)).result()

    def _entry(self, target: int | str, subindex: int) -> ObjectEntry:
        path = target if isinstance(target, str) else f'0x{target:04X}:{subindex:02X}'
        return find_object(self._device.config.dictionary, path)


class CanopenDevice:
    """A device of bus.yml.

    Attributes:
        name: Its name in bus.yml.
        sdo: Its objects.
    """

    def __init__(self, device: RemoteNode, thread: NetworkThread) -> None:
        """Take the device.

        Args:
            device: The device.
            thread: The thread of its network.
        """
        self.name = device.name
        self.sdo = DeviceSdo(device, thread)
        self._device = device
        self._thread = thread

    @property
    def config(self) -> NodeConfig:
        """Its configuration, from bus.yml and its EDS."""
        return self._device.config

    def status(self) -> NodeStatus:
        """Return how the device is: online, NMT state, boot phase, EMCYs, SDO counters.

        Raises:
            BusError: The master has ended.
        """
        return self._thread.call(lambda: node_status(self._device, time.monotonic())).result()

    def send_nmt(self, command: NmtCommand) -> None:
        """Send an NMT command to the device; return when it is on the bus.

        Raises:
            BusError: The master has ended.
        """
        network, node_id = self._thread.network, self._device.config.node_id
        self._thread.run(lambda: network.send_nmt(command, node_id)).result()
