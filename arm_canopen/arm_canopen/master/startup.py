# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When devices are started, and what the loss of a mandatory one means (CiA 302-2, 0x1F80)."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Sequence
from functools import partial
from typing import Any, TypeAlias

from canopen_core import BusError
from canopen_core.standard import ALL_NODES, NmtCommand

from ..config.model.bus import MasterConfig
from .events import Event, EventKind, Report, Severity
from .frame_sender import SendNmt
from .remote_node import RemoteNode
from .scheduler import Promise, Scheduler

CommandNmt: TypeAlias = Callable[[NmtCommand, int], Coroutine[Promise[Any], None, str]]
"""Sends a command after the axes that it concerns were brought to rest."""


class Startup:
    """Holds configured devices back until all mandatory ones are configured.

    Without a mandatory device each one is started as soon as it is ready.
    """

    def __init__(
        self,
        config: MasterConfig,
        nodes: Sequence[RemoteNode],
        scheduler: Scheduler,
        send_nmt: SendNmt,
        report: Report,
        *,
        command_nmt: CommandNmt,
    ) -> None:
        self._config = config
        self._nodes = list(nodes)
        self._scheduler = scheduler
        self._send_nmt = send_nmt
        self._command_nmt = command_nmt
        self._report = report
        self._waiting: dict[RemoteNode, Promise[bool]] = {}
        # all mandatory devices were configured, so nobody is held back any more
        self.complete = not self._missing()
        for node in nodes:
            if node.config.mandatory:
                node.on_gone = partial(self._lost, node)

    async def watch(self) -> None:
        """Report mandatory devices that are not there within `boot_time`."""
        if self._config.boot_time <= 0.0 or self.complete:
            return
        await self._scheduler.timer(self._config.boot_time)
        missing = self._missing()
        if missing and not self.complete:
            names = '; '.join(f'{node.name}: {node.phase_text}' for node in missing)
            self._report_error(
                f'mandatory devices have not booted within {self._config.boot_time:g} s, so no '
                f'device is started: {names}'
            )

    def missing_text(self) -> str:
        """Name the mandatory devices that are waited for."""
        return ', '.join(node.name for node in self._missing())

    async def admit(self, node: RemoteNode) -> bool:
        """Wait until a configured device may be started.

        Returns:
            True when it has been started together with the others, by one frame.
        """
        if self.complete:
            return False
        promise: Promise[bool] = Promise()
        self._waiting[node] = promise
        if not self._missing():
            self._release()
        return await promise

    def forget(self, node: RemoteNode) -> None:
        """The boot of a device begins anew, so it waits for nothing any more."""
        self._waiting.pop(node, None)

    def _missing(self) -> list[RemoteNode]:
        return [
            node
            for node in self._nodes
            if node.config.mandatory and not node.online and node not in self._waiting
        ]

    def _release(self) -> None:
        self.complete = True
        # one frame starts who is there: a device that is still being configured must not get it
        together = self._config.start_all_nodes and len(self._waiting) == len(self._nodes)
        waiting, self._waiting = self._waiting, {}

        def admit(sent: Promise[None] | None) -> None:
            for promise in waiting.values():
                promise.resolve(together and (sent is None or sent.error is None))

        if together and self._config.start_nodes:
            self._send_nmt(NmtCommand.START, ALL_NODES).when_done(admit)
        else:
            admit(None)

    def _lost(self, node: RemoteNode) -> None:
        if not self.complete:
            return
        if self._config.reset_all_nodes:
            self.complete = False
            self._report_error(f'{node.name} is mandatory and lost: all devices are reset')
            self._scheduler.background(self._command(NmtCommand.RESET_NODE))
        elif self._config.stop_all_nodes:
            self._report_error(
                f'{node.name} is mandatory and lost: all devices are stopped; start them by '
                'NMT when it is back'
            )
            self._scheduler.background(self._command(NmtCommand.STOP))
        else:
            self._report_error(f'{node.name} is mandatory and lost; the others go on without it')

    async def _command(self, command: NmtCommand) -> None:
        """Bring the axes to rest, and send a command to all devices."""
        try:
            await self._command_nmt(command, ALL_NODES)
        except BusError as error:
            self._report_error(str(error))

    def _report_error(self, text: str) -> None:
        self._report(Event(EventKind.BOOT_FAILED, Severity.ERROR, '', text))
