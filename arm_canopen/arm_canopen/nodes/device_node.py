# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS node of one device: NMT, SDO and raw PDO access, compatible with ros2_canopen's proxy.

Further services read and write objects of any type by name or number. The messages of ros2_canopen
carry objects as raw 32 bits.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping
from concurrent.futures import Future
from functools import partial
import struct
from typing import Any

from canopen_interfaces.msg import COData
from canopen_interfaces.srv import CORead, COWrite
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from arm_msgs.srv import ReadObject, WriteObject
from canopen_core import CanopenError, CodecError, ObjectError, SdoError
from canopen_core.eds import bytes_from_text, text_from_bytes
from canopen_core.standard import (
    byte_length,
    DataType,
    MappedObject,
    NmtCommand,
    NmtState,
    Number,
    object_address,
    object_path,
    ObjectEntry,
    PdoCodec,
    SIGNED_BITS,
)
from node_runner import create_deferred_service, destroyed_when_refused, LATCHED

from ..config.model import NodeConfig
from ..master.events import Event, EventKind, Severity
from ..master.process_image import ReceivedTpdo
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .output_thread import OutputThread

NMT_STATE_WORDS: dict[NmtState, str] = {
    NmtState.BOOT_UP: 'BOOTUP',
    NmtState.PRE_OPERATIONAL: 'PREOP',
    NmtState.OPERATIONAL: 'START',
    NmtState.STOPPED: 'STOP',
}
"""The states of ~/nmt_state, in ros2_canopen's words; ERROR stands for a device that was lost."""


def node_options(config: NodeConfig) -> dict[str, Any]:
    """Return node options with the namespace and remappings that bus.yml sets for a device."""
    remappings = [f'{old}:={new}' for old, new in config.remappings.items()]
    arguments = [word for rule in remappings for word in ('-r', rule)]
    return {
        'namespace': config.namespace or None,
        'cli_args': ['--ros-args', *arguments] if arguments else None,
    }


class DeviceTopics:
    """Publishers of ``~/nmt_state`` and ``~/rpdo`` of a device."""

    def __init__(self, node: Node, device: RemoteNode, output: OutputThread) -> None:
        self._device = device
        self._output = output
        self._nmt_state = node.create_publisher(String, '~/nmt_state', LATCHED)
        self._rpdo = node.create_publisher(COData, '~/rpdo', 10)
        self._listened = False

    def take_event(self, event: Event) -> None:
        """Publish the NMT state if the event changes it."""
        if event.kind in (EventKind.NMT_STATE, EventKind.HEARTBEAT_LOST):
            state = self._device.nmt_state
            words = 'ERROR' if state is None else NMT_STATE_WORDS[state]
            self._nmt_state.publish(String(data=words))

    def update_listeners(self) -> None:
        """Publish received objects on ~/rpdo only while the topic has subscribers."""
        listened = self._rpdo.get_subscription_count() > 0
        if listened != self._listened:
            self._listened = listened
            for entry in self._device.image.tpdos:
                (entry.listen if listened else entry.ignore)(self._received)

    def _received(self, entry: ReceivedTpdo) -> None:
        values = entry.values or ()
        self._output.post_stream(entry, partial(self._publish_objects, entry, values))

    def _publish_objects(self, entry: ReceivedTpdo, values: tuple[float, ...]) -> None:
        for mapped, value in zip(entry.config.mapping, values, strict=True):
            data = raw_from_number(mapped, value)
            self._rpdo.publish(COData(index=mapped.index, subindex=mapped.subindex, data=data))


def log_bus_event(node: Node, event: Event) -> None:
    """Log an event of a bus."""
    logger = node.get_logger()
    if event.severity is Severity.INFO and event.kind is EventKind.NMT_STATE:
        logger.debug(str(event))  # ~/nmt_state has it
    elif event.severity is Severity.INFO:
        logger.info(str(event))
    elif event.severity is Severity.WARNING:
        logger.warning(str(event))
    else:
        logger.error(str(event))


Transfer = tuple[ObjectEntry, bytes]

NMT_SERVICES: dict[str, NmtCommand] = {
    'nmt_start_node': NmtCommand.START,
    'nmt_stop_node': NmtCommand.STOP,
    'nmt_enter_pre_operational': NmtCommand.ENTER_PRE_OPERATIONAL,
    'nmt_reset_node': NmtCommand.RESET_NODE,
    'nmt_reset_communication': NmtCommand.RESET_COMMUNICATION,
}
"""Services and the NMT commands that they send; ros2_canopen has the first and the fourth."""


class DeviceNode(Node):
    """ROS node with the services and topics of one device."""

    @destroyed_when_refused
    def __init__(self, device: RemoteNode, thread: NetworkThread, output: OutputThread) -> None:
        config = device.config
        super().__init__(config.name, **node_options(config))
        self.device = device  # the device
        self.output = output  # the thread that publishes and answers
        self._thread = thread
        # called before every request; raises CanopenError when none is taken at the moment
        self.admit: Callable[[], None] = lambda: None
        fixed = ParameterDescriptor(description='CANopen node id', read_only=True)
        self.declare_parameter('node_id', config.node_id, fixed, ignore_override=True)
        self.topics = DeviceTopics(self, device, output)  # what it publishes
        self.create_subscription(COData, '~/tpdo', self._write_pdo, 10)
        for name, command in NMT_SERVICES.items():
            self._offer_nmt(name, command)
        self.offer(ReadObject, '~/read_object', self._read_object, self._answer_read_object)
        self.offer(WriteObject, '~/write_object', self._write_object, self._answer_write_object)
        self.offer(CORead, '~/sdo_read', self._read, partial(answer_read, self))
        self.offer(COWrite, '~/sdo_write', self._write, partial(answer_success, self))

    def offer(
        self,
        service_type: Any,  # noqa: ANN401  # service classes have no type
        name: str,
        handler: Callable[[Any], Future[Any]],
        respond: Callable[[Any, Future[Any]], Any],
    ) -> None:
        """Create a service that responds when a future is done.

        ``handler`` gets each admitted request; ``respond`` fills in the response and returns it.
        """

        def admitted(request: Any) -> Future[Any]:  # noqa: ANN401
            self.admit()
            return handler(request)

        post = self.output.post
        create_deferred_service(self, service_type, name, admitted, respond, post=post)

    def offer_trigger(self, name: str, handler: Callable[[], Future[str]]) -> None:
        """Create a std_srvs/Trigger service; its message is the result or error of the future."""

        def respond(response: Any, future: Future[str]) -> Any:  # noqa: ANN401
            answer_message(response, future)
            if not response.success:
                self.get_logger().warning(f'{name}: {response.message}')
            return response

        self.offer(Trigger, name, lambda request: handler(), respond)

    def publish_objects(
        self, topic: str, values: Callable[[], Mapping[tuple[int, int], Number]]
    ) -> None:
        """Send the objects of a message by RPDO, or log why they are refused."""
        try:
            self.admit()
            objects = values()
        except CanopenError as error:
            self.get_logger().warning(f'{topic}: {error}')
            return
        network = self._thread.network
        sent = self._thread.call(partial(network.publish_objects, self.device, objects))

        def log_unsent(sent: Future[None]) -> None:
            if (error := sent.exception()) is not None:
                self.get_logger().warning(f'{topic}: {error}')

        sent.add_done_callback(log_unsent)

    def _write_pdo(self, message: COData) -> None:
        def values() -> Mapping[tuple[int, int], Number]:
            address = message.index, message.subindex
            place = object_address(*address)
            mapped = self.device.image.mapped_output(*address)
            if mapped is None:
                raise CanopenError(f'{place} is in no RPDO of the device; map it')
            try:
                self.device.objects.check_owner(message.index)
                return {address: number_from_raw(mapped, message.data)}
            except CanopenError as error:
                raise CanopenError(f'{place}: {error}') from error

        self.publish_objects('~/tpdo', values)

    def _offer_nmt(self, name: str, command: NmtCommand) -> None:
        node_id = self.device.config.node_id

        def send() -> Coroutine[Promise[Any], None, str]:
            return self._thread.network.command_nmt(command, node_id)

        self.offer_trigger(f'~/{name}', lambda: self._thread.run_coroutine(send))

    def _read(self, request: CORead.Request) -> Future[int]:
        device, index, subindex = self.device, request.index, request.subindex

        async def read() -> int:
            data = await device.sdo.read(index, subindex, device.config.sdo_timeout)
            return raw_from_bytes(data)

        return self._thread.run_coroutine(read)

    def _write(self, request: COWrite.Request) -> Future[None]:
        device, index, subindex = self.device, request.index, request.subindex

        def write() -> Promise[None]:
            device.objects.check_owner(index)
            data = bytes_from_raw(device.objects.entry(index, subindex).data_type, request.data)
            timeout = device.config.write_timeout(index, subindex)
            return device.sdo.write(index, subindex, data, timeout)

        return self._thread.run(write)

    def _read_object(self, request: ReadObject.Request) -> Future[Transfer]:
        _require_clear(request.object)
        return self._thread.run_coroutine(partial(self.device.objects.upload, request.object))

    def _answer_read_object(
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

    def _write_object(self, request: WriteObject.Request) -> Future[Transfer]:
        _require_clear(request.object)

        def to_bytes(entry: ObjectEntry) -> bytes:
            data = bytes(request.data) or bytes_from_text(entry.data_type, request.value)
            text_from_bytes(entry.data_type, data)  # refuses raw bytes that are no such value
            return data

        return self._thread.run_coroutine(
            partial(self.device.objects.download, request.object, to_bytes)
        )

    def _answer_write_object(
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


def answer_message(response: Any, future: Future[str]) -> Any:  # noqa: ANN401
    """Fill in success, and the result or error of the future as the message."""
    error = future.exception()
    response.success = error is None
    response.message = future.result() if error is None else str(error)
    return response


def answer_read(node: Node, response: Any, future: Future[int]) -> Any:  # noqa: ANN401
    """Fill in success and data; log a failure, as the response has no field for it."""
    answer_success(node, response, future)
    if response.success:
        response.data = future.result()
    return response


def answer_success(node: Node, response: Any, future: Future[Any]) -> Any:  # noqa: ANN401
    """Fill in success of a command; log a failure, as the response has no field for it."""
    error = future.exception()
    response.success = error is None
    if isinstance(error, (CanopenError, SdoError)):
        node.get_logger().warning(str(error))
    elif error is not None:
        node.get_logger().error(f'{type(error).__name__}: {error}')
    return response


def _require_clear(path: str) -> None:
    """Reject decimal digits: YAML turns an unquoted 0x2003 into 8195."""
    digits = path.strip().partition(':')[0]
    if digits.isdecimal():
        number = f'0x{int(digits):X}'
        raise ObjectError(
            f'object {path!r} is 0x{digits}, or {number}, of which YAML makes {digits} without '
            f"quotes; write the one that is meant, in quotes: object: '{number}'"
        )


RAW_BYTES = 4  # [byte] in COData, CORead and COWrite


def raw_from_bytes(data: bytes) -> int:
    """Return up to four bytes as a number, zero-extended.

    Raises:
        CodecError: There are more than four bytes, which the message cannot carry.
    """
    if len(data) > RAW_BYTES:
        raise CodecError(f'the object has {len(data)} bytes, more than the 4 of this message')
    return int.from_bytes(data, 'little')


def bytes_from_raw(data_type: DataType, raw: int) -> bytes:
    """Convert the 32 bits of a message to the bytes of an object.

    A negative number may come zero-extended to its type or sign-extended to 32 bits.

    Raises:
        CodecError: The type does not fit into 32 bits, or the value does not fit the type.
    """
    size = byte_length(data_type)
    if size is None or size > RAW_BYTES:
        raise CodecError(f'{data_type.name} does not fit into the 32 bits of this message')
    bits = size * 8
    raw = _narrowed(data_type, bits, raw)
    if raw >> (1 if data_type is DataType.BOOLEAN else bits):
        raise CodecError(f'0x{raw:X} does not fit {data_type.name}')
    return raw.to_bytes(size, 'little')


def _narrowed(data_type: DataType, bits: int, raw: int) -> int:
    """Truncate a negative number that was sign-extended to 32 bits to the width of its type."""
    negative = raw >> (bits - 1) == (1 << (33 - bits)) - 1 if bits <= 32 else False
    return raw & ((1 << bits) - 1) if negative and data_type in SIGNED_BITS else raw


def raw_from_number(mapped: MappedObject, value: Number) -> int:
    """Return a PDO value as the 32 bits of a message; truncate a wider one."""
    return int.from_bytes(PdoCodec([mapped]).pack([value])[:RAW_BYTES], 'little')


def number_from_raw(mapped: MappedObject, raw: int) -> Number:
    """Convert the 32 bits of a message to the value of a mapped object.

    A negative number may come zero-extended to its type or sign-extended to 32 bits.

    Raises:
        CodecError: The value does not fit the object.
    """
    raw = _narrowed(mapped.data_type, mapped.bits, raw)
    if raw >> min(mapped.bits, 32):
        raise CodecError(f'0x{raw:X} does not fit the {mapped.bits} bits of the object')
    return PdoCodec([mapped]).unpack(struct.pack('<Q', raw))[0]
