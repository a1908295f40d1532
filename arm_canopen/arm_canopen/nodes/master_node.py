# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS node of the master: SDO and NMT to any node id."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial

from canopen_interfaces.srv import CONmtID, COReadID, COWriteID
from rclpy.node import Node

from canopen_core import CanopenError
from canopen_core.standard import (
    ALL_NODES,
    byte_length,
    DataType,
    NmtCommand,
    NODE_ID_MAX,
    NODE_ID_MIN,
    object_address,
)
from node_runner import create_deferred_service

from ..master.object_access import bytes_from_raw, raw_from_bytes
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .device_node import answer_read, answer_write
from .output_thread import OutputThread

SERVICE_TYPES = (
    DataType.INTEGER8,
    DataType.INTEGER16,
    DataType.INTEGER32,
    DataType.UNSIGNED8,
    DataType.UNSIGNED16,
    DataType.UNSIGNED32,
)
"""Data types that COReadID and COWriteID name."""

SDO_TIMEOUT = 0.5  # [s] a stranger's bus.yml entry, which would say, does not exist


class MasterServices:
    """Services of the master node."""

    def __init__(self, node: Node, thread: NetworkThread, output: OutputThread) -> None:
        # called for every request; raises CanopenError when none is taken at the moment
        self.admit: Callable[[], None] = lambda: None
        self._thread = thread
        for kind, name, begin, respond in (
            (COReadID, '~/sdo_read', self._read, answer_read),
            (COWriteID, '~/sdo_write', self._write, answer_write),
            (CONmtID, '~/set_nmt', self._set_nmt, answer_write),
        ):
            fill = partial(respond, node)
            create_deferred_service(node, kind, name, begin, fill, post=output.post)

    def _read(self, request: COReadID.Request) -> Future[int]:
        async def read() -> int:
            self.admit()
            data_type = _data_type(request.canopen_datatype)
            client = self._thread.network.sdo_client(_node_id(request.nodeid))
            data = await client.read(request.index, request.subindex, SDO_TIMEOUT)
            if len(data) != byte_length(data_type):
                raise CanopenError(
                    f'{object_address(request.index, request.subindex)} of node {request.nodeid} '
                    f'has {len(data)} bytes, {data_type.name} has {byte_length(data_type)}'
                )
            return raw_from_bytes(data)

        return self._thread.run_coroutine(read)

    def _write(self, request: COWriteID.Request) -> Future[None]:
        def write() -> Promise[None]:
            self.admit()
            for device in self._thread.network.nodes.values():
                if device.config.node_id == request.nodeid:
                    device.objects.check_owner(request.index)
            data = bytes_from_raw(_data_type(request.canopen_datatype), request.data)
            client = self._thread.network.sdo_client(_node_id(request.nodeid))
            return client.write(request.index, request.subindex, data, SDO_TIMEOUT)

        return self._thread.run(write)

    def _set_nmt(self, request: CONmtID.Request) -> Future[None]:
        async def send() -> None:
            self.admit()
            node_id = request.nodeid if request.nodeid == ALL_NODES else _node_id(request.nodeid)
            await self._thread.network.command_nmt(_nmt_command(request.nmtcommand), node_id)

        return self._thread.run_coroutine(send)


def _data_type(number: int) -> DataType:
    for data_type in SERVICE_TYPES:
        if data_type == number:
            return data_type
    names = ', '.join(f'{data_type.name} {data_type:#04x}' for data_type in SERVICE_TYPES)
    raise CanopenError(f'canopen_datatype {number:#04x} is none of {names}')


def _nmt_command(number: int) -> NmtCommand:
    try:
        return NmtCommand(number)
    except ValueError:
        names = ', '.join(f'{command.value} {command.name}' for command in NmtCommand)
        raise CanopenError(f'nmtcommand {number} is none of {names}') from None


def _node_id(number: int) -> int:
    if not NODE_ID_MIN <= number <= NODE_ID_MAX:
        raise CanopenError(f'node id {number} is not {NODE_ID_MIN} to {NODE_ID_MAX}')
    return number
