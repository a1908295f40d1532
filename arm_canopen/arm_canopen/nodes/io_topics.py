# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Topics and services of I/O modules (CiA 401) and encoders (CiA 406) that have no other driver.

Digital channels use std_msgs/UInt8MultiArray with 0 or 1 per line, analogue ones
std_msgs/Float64MultiArray in device counts: every client has these types, and they are short in
`ros2 topic pub`. Both list the PDO-mapped channels in the order of their sub-indices.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from functools import partial
import math
from typing import Any

from canopen_interfaces.srv import COTargetDouble
from std_msgs.msg import Float64MultiArray, UInt8MultiArray

from canopen_core import CodecError
from canopen_core.standard import (
    bit_length,
    DeviceProfile,
    DIGITAL_OUTPUTS,
    EncoderObject,
    ERROR_OBJECTS,
    IO_GROUPS,
    IoGroup,
    Number,
    object_address,
    ObjectEntry,
    profile_number,
)
from node_runner import LATCHED

from ..config.model import NodeConfig
from ..master.process_image import InputReader, ReceivedTpdo
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from .device_node import answer_success, DeviceNode
from .joint_state_publisher import DriveJointStates, EncoderState


class Channels:
    """PDO-mapped channels of one kind."""

    def __init__(self, device: RemoteNode, group: IoGroup) -> None:
        places = {
            (mapped.index, mapped.subindex)
            for pdo in device.config.pdos
            if pdo.enabled and pdo.direction.name == group.direction
            for mapped in pdo.mapping
        }
        entries = group.entries(device.config.dictionary, places)
        self.group = group
        self.entries = [entry for entry in entries if entry.address in places]
        # lines of each object: its bits, or one analogue channel
        self._lines = [
            bit_length(e.data_type) or 1 if group.is_digital else 1 for e in self.entries
        ]
        self._device = device
        readers = (device.image.reader(*entry.address) for entry in self.entries)
        self.readers: list[InputReader] = [each for each in readers if each is not None]

    def received(self) -> list[Number] | None:
        """Return the value of each input; None while any is unknown."""
        values = [reader.value for reader in self.readers]
        return None if None in values else self._split([value or 0 for value in values])

    @property
    def missing(self) -> str:
        """Describe the missing TPDOs that leave inputs unknown; empty when all are known."""
        silent = {r.source.config.number for r in self.readers if r.source.values is None}
        numbers = ', '.join(map(str, sorted(silent)))
        return f'unknown: TPDO {numbers} not received since the boot' if silent else ''

    def commanded(self) -> list[Number] | None:
        """Return the last value sent to each output; None if nothing was sent since it booted."""
        outputs = [self._device.image.sent(*entry.address) for entry in self.entries]
        return None if None in outputs else self._split([value or 0 for value in outputs])

    def packed(self, data: Sequence[Number]) -> Mapping[tuple[int, int], Number]:
        """Return the object values that set every output to its value in ``data``.

        Raises:
            CodecError: The number of values is wrong, or a value does not fit its output.
        """
        if len(data) != sum(self._lines):
            word = '0 or 1' if self.group.is_digital else 'in counts of the device'
            raise CodecError(
                f'{len(data)} values for {sum(self._lines)} outputs; write one for each, {word}'
            )
        if self.group.is_digital:
            for number, value in enumerate(data, 1):
                if value not in (0, 1):
                    raise CodecError(f'output {number} cannot be {value}; write 0 or 1')
        values, begin = {}, 0
        for entry, lines in zip(self.entries, self._lines, strict=True):
            part = data[begin : begin + lines]
            begin += lines
            value = part[0] if lines == 1 else sum(int(bit) << n for n, bit in enumerate(part))
            values[entry.address] = self._device.objects.check_output(*entry.address, value)
        return values

    def _split(self, values: Sequence[Number]) -> list[Number]:
        if not self.group.is_digital:
            return list(values)
        return [
            int(value) >> bit & 1
            for value, lines in zip(values, self._lines, strict=True)
            for bit in range(lines)
        ]


LOOKS = 2  # looks in a row at which inputs that are unknown are logged


class IoTopics:
    """Topics ``~/digital_inputs`` and ``~/analog_inputs``, and topics that write outputs.

    Input topics are latched and published on change.
    """

    def __init__(self, node: DeviceNode) -> None:
        self._node = node
        all_channels = (Channels(node.device, group) for group in IO_GROUPS)
        self._channels = [channels for channels in all_channels if channels.entries]
        self._looks = Counter[str]()  # how often in a row inputs were unknown, by topic
        for channels in self._channels:
            self._offer(channels)

    def diagnostics(self) -> dict[str, str]:
        """Return inputs, outputs, and how outputs react to the loss of the master.

        Inputs that stay unknown are logged once: nothing is published for them.
        """
        values = {}
        for channels in self._channels:
            group = channels.group
            data = channels.commanded() if group.is_output else channels.received()
            unknown = 'not commanded since the boot' if group.is_output else channels.missing
            if not group.is_output:
                self._warn(group.name, channels.missing if self._node.device.operational else '')
            separator = '' if group.is_digital else ' '
            values[group.name] = unknown if data is None else separator.join(map(str, data))
        config = self._node.device.config
        outputs = [e for c in self._channels if c.group.is_output for e in c.entries]
        return values | ({'outputs_on_loss': outputs_on_loss(config, outputs)} if outputs else {})

    def _warn(self, name: str, missing: str) -> None:
        self._looks[name] = self._looks[name] + 1 if missing else 0
        if self._looks[name] == LOOKS:
            self._node.get_logger().warning(
                f'~/{name} is silent: {missing}; does the device send it when it starts, or by'
                ' an event timer (event_timer in bus.yml)?'
            )

    def _offer(self, channels: Channels) -> None:
        group, node = channels.group, self._node
        message = UInt8MultiArray if group.is_digital else Float64MultiArray
        topic = f'~/{group.name}'
        if group.is_output:

            def write(message: UInt8MultiArray | Float64MultiArray) -> None:
                node.publish_objects(topic, partial(channels.packed, message.data))

            node.create_subscription(message, topic, write, 10)
            return
        publisher = node.create_publisher(message, topic, LATCHED)
        last: list[Number] = []

        def received(_: ReceivedTpdo) -> None:
            data = channels.received()
            if data is not None and data != last:
                last[:] = data
                number = int if group.is_digital else float
                ready = message(data=[number(value) for value in data])
                node.output.post_stream(publisher, partial(publisher.publish, ready))

        for source in {id(reader.source): reader.source for reader in channels.readers}.values():
            source.listen(received)


def outputs_on_loss(config: NodeConfig, outputs: Sequence[ObjectEntry]) -> str:
    """Describe how outputs react to the loss of the master, from bus.yml and EDS."""
    if not (config.heartbeat_consumer or config.life_guarding):
        return 'kept: the device does not watch the master (0x1016)'
    parts = []
    for entry in outputs:
        mode, value = (
            config.value_after_boot(index, entry.subindex)
            for index in ERROR_OBJECTS.get(entry.index, (0, 0))
        )
        if not (isinstance(mode, int) and isinstance(value, int)):
            text = 'as the manual of the device says'
        elif not mode:
            text = 'kept'
        elif entry.index in DIGITAL_OUTPUTS.indices:
            text = f'bits 0x{mode:02X} to those of 0x{value:02X}'
        else:
            text = f'to {value}'
        parts.append(f'{object_address(*entry.address)} {text}')
    return ', '.join(parts)


class EncoderTopics:
    """``~/joint_states`` and ``~/preset`` of an encoder."""

    def __init__(self, node: DeviceNode, thread: NetworkThread) -> None:
        self._node, self._thread = node, thread
        self._state = EncoderState(node.device, thread)
        self.joint_states = DriveJointStates(node, [self._state])
        node.offer(COTargetDouble, '~/preset', self._preset, partial(answer_success, node))

    def diagnostics(self) -> dict[str, str]:
        """Return position and velocity as diagnostic values."""
        state = self._state
        return {'position': f'{state.position:.6f}', 'velocity': f'{state.velocity:.6f}'}

    def _preset(self, request: Any) -> Future[None]:  # noqa: ANN401  # service classes have no type
        device = self._node.device
        scales, objects = device.config.drive, device.objects
        counts = (request.target - scales.offset_pos_from_dev) / scales.scale_pos_from_dev
        total = device.config.value_after_boot(EncoderObject.TOTAL_RANGE)
        high = total if isinstance(total, int) and total else 1 << 32
        if not (math.isfinite(counts) and 0 <= round(counts) < high):
            raise CodecError(
                f'a position of {request.target:g} is {counts:g} measuring units; '
                f'{device.name} has 0 to {high - 1} (0x6002)'
            )
        return self._thread.run(
            lambda: objects.write_object(EncoderObject.PRESET, 0, round(counts))
        )


def offer_io(node: DeviceNode, thread: NetworkThread) -> IoTopics | EncoderTopics | None:
    """Create the topics of the device profile in 0x1000; None for drives and other profiles."""
    config = node.device.config
    profile = 0 if config.is_drive else profile_number(config.dictionary)
    if profile == DeviceProfile.GENERIC_IO:
        return IoTopics(node)
    return EncoderTopics(node, thread) if profile == DeviceProfile.ENCODER else None
