# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lifecycle nodes of a bus whose bus.yml names lifecycle drivers, and their manager."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from canopen_core import BootError

from ..cia402.commands import AxisCommands
from ..master.lifecycle import Managed, MANAGER, Supervisor, Verb, Work
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from .device_node import DeviceNode
from .lifecycle_services import LifecycleServices
from .output_thread import OutputThread

BOOT_ATTEMPTS = 3  # boot time-outs that an activation waits, as ros2_canopen does


class ManagedBus:
    """The lifecycle of a master and its devices.

    A device that is not active takes no commands. Deactivating a drive stops and disables it.
    """

    def __init__(
        self,
        node: Node,
        devices: Mapping[str, DeviceNode],
        axes: Callable[[RemoteNode], Sequence[AxisCommands]],
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        self._scheduler = thread.network.scheduler
        master = Managed(node.get_name(), _nothing)
        self.admit = master.require_active  # lets a request to the master pass
        LifecycleServices(node, master, thread, output)
        managed = []
        for name, device in devices.items():
            entry = Managed(name, self._work(device.device, axes(device.device)))
            device.admit = entry.require_active
            LifecycleServices(device, entry, thread, output)
            managed.append(entry)
        supervisor = Supervisor(master, managed, self._scheduler)
        # the node ``lifecycle_manager``, in the namespace of the master
        self.manager = Node(MANAGER, namespace=node.get_namespace())
        text = ParameterDescriptor(
            description='accepted for ros2_canopen; not needed', read_only=True
        )
        self.manager.declare_parameter('container_name', '', text)
        LifecycleServices(self.manager, Managed(MANAGER, supervisor.work), thread, output)

    def _work(self, device: RemoteNode, axes: Sequence[AxisCommands]) -> Work:
        async def work(verb: Verb) -> None:
            if verb is Verb.ACTIVATE:
                await self._booted(device)
            elif verb in (Verb.DEACTIVATE, Verb.SHUTDOWN):
                await self._scheduler.gather([axis.request('shutdown') for axis in axes])

        return work

    async def _booted(self, device: RemoteNode) -> None:
        timeout = BOOT_ATTEMPTS * device.config.boot_timeout
        try:
            await self._scheduler.until(lambda: device.online, timeout)
        except TimeoutError:
            raise BootError(
                f'{device.name} is not activated: not booted within {timeout:g} s '
                f'({device.phase.value} {device.phase_detail})'.rstrip()
            ) from None


async def _nothing(verb: Verb) -> None:
    """Do no work: the master boots and watches its devices in every state."""
