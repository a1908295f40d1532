# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the node of a device publishes, and how it and the node of the bus report events."""

from __future__ import annotations

from functools import partial
from typing import Any

from canopen_interfaces.msg import COData
from rclpy.node import Node
from std_msgs.msg import String

from canopen_core.standard import NmtState
from node_runner import LATCHED

from ..config.model import NodeConfig
from ..master.events import Event, EventKind, Severity
from ..master.object_access import raw_from_number
from ..master.process_image import ReceivedTpdo
from ..master.remote_node import RemoteNode
from .output_thread import OutputThread

NMT_STATE_WORDS: dict[NmtState, str] = {
    NmtState.BOOT_UP: 'BOOTUP',
    NmtState.PRE_OPERATIONAL: 'PREOP',
    NmtState.OPERATIONAL: 'START',
    NmtState.STOPPED: 'STOP',
}
"""The states of ~/nmt_state, in ros2_canopen's words; ERROR stands for a device that was lost."""


def node_options(config: NodeConfig) -> dict[str, Any]:
    """Return the options of the node of a device, by the namespace and remappings of bus.yml."""
    remappings = [f'{old}:={new}' for old, new in config.remappings.items()]
    arguments = [word for rule in remappings for word in ('-r', rule)]
    return {
        'namespace': config.namespace or None,
        'cli_args': ['--ros-args', *arguments] if arguments else None,
    }


class DeviceTopics:
    """``~/nmt_state`` and ``~/rpdo`` of a device."""

    def __init__(self, node: Node, device: RemoteNode, output: OutputThread) -> None:
        self._device = device
        self._output = output
        self._nmt_state = node.create_publisher(String, '~/nmt_state', LATCHED)
        self._rpdo = node.create_publisher(COData, '~/rpdo', 10)
        self._listened = False

    def take_event(self, event: Event) -> None:
        """Publish the NMT state where an event changes it."""
        if event.kind in (EventKind.NMT_STATE, EventKind.HEARTBEAT_LOST):
            state = self._device.nmt_state
            words = 'ERROR' if state is None else NMT_STATE_WORDS[state]
            self._nmt_state.publish(String(data=words))

    def update_listeners(self) -> None:
        """Publish each received object on ~/rpdo while somebody listens, and only then."""
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
