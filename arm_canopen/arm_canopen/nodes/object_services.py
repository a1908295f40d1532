# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services that read and write objects of any type by name or number."""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial

from arm_msgs.srv import ReadObject, WriteObject
from canopen_core import CanopenError, ObjectError
from canopen_core.eds import bytes_from_text, text_from_bytes
from canopen_core.standard import object_address, object_path, ObjectEntry

from ..master.runner import NetworkThread
from .device_node import DeviceNode

Transfer = tuple[ObjectEntry, bytes]


class ObjectServices:
    """``~/read_object`` and ``~/write_object`` of one device."""

    def __init__(self, node: DeviceNode, thread: NetworkThread) -> None:
        self._node = node
        self._objects = node.device.objects
        self._thread = thread
        node.offer(ReadObject, '~/read_object', self._read, self._answer_read)
        node.offer(WriteObject, '~/write_object', self._write, self._answer_write)

    def _read(self, request: ReadObject.Request) -> Future[Transfer]:
        _require_clear(request.object)
        return self._thread.run_coroutine(partial(self._objects.upload, request.object))

    def _answer_read(
        self, response: ReadObject.Response, future: Future[Transfer]
    ) -> ReadObject.Response:
        try:
            entry, data = future.result()
            response.index, response.subindex = entry.address
            response.type, response.data = entry.data_type.name, data
            response.value = text_from_bytes(entry.data_type, data)
        except CanopenError as error:
            response.message = str(error)
        else:
            response.success = True
        return response

    def _write(self, request: WriteObject.Request) -> Future[Transfer]:
        _require_clear(request.object)

        def to_bytes(entry: ObjectEntry) -> bytes:
            data = bytes(request.data) or bytes_from_text(entry.data_type, request.value)
            text_from_bytes(entry.data_type, data)  # refuses raw bytes that are no such value
            return data

        return self._thread.run_coroutine(
            partial(self._objects.download, request.object, to_bytes)
        )

    def _answer_write(
        self, response: WriteObject.Response, future: Future[Transfer]
    ) -> WriteObject.Response:
        try:
            entry, data = future.result()
        except CanopenError as error:
            response.message = str(error)
            return response
        response.index, response.subindex = entry.address
        written = text_from_bytes(entry.data_type, data)
        address = object_address(entry.index, entry.subindex)
        response.success = True
        response.message = f'{address} {object_path(entry)} = {written}'
        return response


def _require_clear(path: str) -> None:
    """Refuse decimal digits: where 0x2003 is not quoted, YAML makes 8195 of it."""
    digits = path.strip().partition(':')[0]
    if digits.isdecimal():
        number = f'0x{int(digits):X}'
        raise ObjectError(
            f'object {path!r} is 0x{digits}, or {number}, of which YAML makes {digits} without '
            f"quotes; write the one that is meant, in quotes: object: '{number}'"
        )
