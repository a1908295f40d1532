# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The boots of all devices of a bus, which run side by side; each device has one at a time."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from ..config.model import BusConfig
from ..exceptions import SdoError
from .boot import BootProcess
from .bus_sender import Send
from .guarding import guarding_request
from .nmt_sender import SendNmt
from .remote_node import RemoteNode
from .scheduler import Scheduler, Task
from .startup import Startup


class BootManager:
    """Begins the boot of a device when it appears, restarts or drops out."""

    def __init__(
        self,
        bus: BusConfig,
        nodes: Iterable[RemoteNode],
        scheduler: Scheduler,
        startup: Startup,
        *,
        send: Send,
        send_nmt: SendNmt,
    ) -> None:
        """Listen to the devices; nothing is booted before :meth:`start`."""
        self._scheduler = scheduler
        self._tasks: dict[str, Task[None]] = {}
        self._processes: dict[str, BootProcess] = {}
        for node in nodes:
            self._processes[node.name] = BootProcess(
                node,
                bus,
                scheduler,
                send_nmt,
                startup,
                request_state=lambda node_id: send(guarding_request(node_id)),
            )
            node.on_boot_up = partial(self._restarted, node)
            node.on_dropped_out = partial(self._dropped_out, node)

    def start(self, node: RemoteNode, *, announced: bool = False, pause: float = 0.0) -> None:
        """Boot a device, as of :meth:`BootProcess.run`; anew if a boot is on its way."""
        self._end(node)
        boot = self._processes[node.name].run(announced=announced, pause=pause)
        self._tasks[node.name] = self._scheduler.background(boot)

    def _dropped_out(self, node: RemoteNode, pause: float) -> None:
        self.start(node, pause=pause)

    def _restarted(self, node: RemoteNode) -> None:
        self._end(node)
        node.restarted()
        self.start(node, announced=True)

    def _end(self, node: RemoteNode) -> None:
        running = self._tasks.get(node.name)
        if running is not None:
            running.cancel(SdoError('the boot starts again'))
