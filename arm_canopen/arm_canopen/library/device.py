# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device of the bus and its objects, for callers outside of the cycle; each call waits."""

from __future__ import annotations

from functools import partial

from canopen_core.standard import decode, encode, NmtCommand, object_address, ObjectEntry, Value

from ..config.model import NodeConfig
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from ..master.status import node_status, NodeStatus


class DeviceSdo:
    """Objects of a device by SDO, typed by its EDS.

    An object is an index such as ``0x6041``, or what a person writes: ``'Statusword'``,
    ``'0x607D:02'``, ``'Software position limit/Max'``.
    """

    def __init__(self, device: RemoteNode, thread: NetworkThread) -> None:
        self._device = device
        self._thread = thread

    def read(self, target: int | str, subindex: int = 0) -> Value:
        """Read an object by its name, or by its index and sub-index.

        Raises:
            ObjectError: The EDS has no such object.
            SdoError: The device refused, or did not answer within the SDO time-out of bus.yml.
            BusError: The master has ended.
        """
        upload = partial(self._device.objects.upload, _path(target, subindex))
        entry, data = self._thread.run_coroutine(upload).result()
        return decode(entry.data_type, data)

    def write(self, target: int | str, value: Value, subindex: int = 0) -> None:
        """Write an object by its name, or index and sub-index; return when the device has it.

        Raises:
            ObjectError: The EDS has no such object.
            CodecError: The value does not fit the type.
            DriveError: The master writes the object itself in each cycle.
            SdoError: The device refused, or did not answer within the SDO time-out of bus.yml.
            BusError: The master has ended.
        """

        def to_bytes(entry: ObjectEntry) -> bytes:
            return encode(entry.data_type, value)

        download = partial(self._device.objects.download, _path(target, subindex), to_bytes)
        self._thread.run_coroutine(download).result()


class CanopenDevice:
    """A device of bus.yml.

    Attributes:
        name: Its name in bus.yml.
        sdo: Its objects.
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
        """Return how the device is: online, NMT state, boot phase, EMCYs, SDO counters.

        Raises:
            BusError: The master has ended.
        """
        return self._thread.call(lambda: node_status(self._device, self._thread.now())).result()

    def send_nmt(self, command: NmtCommand) -> None:
        """Send an NMT command to the device; return when the bus has taken it.

        Axes that move are brought to rest before it leaves, except by START.

        Raises:
            BusError: The bus has not taken it, or the master has ended.
        """
        network, node_id = self._thread.network, self._device.config.node_id
        self._thread.run_coroutine(lambda: network.command_nmt(command, node_id)).result()


def _path(target: int | str, subindex: int) -> str:
    return target if isinstance(target, str) else object_address(target, subindex)
