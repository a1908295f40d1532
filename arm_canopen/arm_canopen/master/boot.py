# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Booting a device: identity, configuration, error control, start (CiA 302-2, 7.4 and 0x1F80)."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterable, Sequence
from contextlib import suppress
from enum import Enum
from functools import partial
from typing import Any, TypeAlias

from canopen_core import BootError, BusError, SdoAbortError, SdoError, SdoTimeoutError
from canopen_core.standard import ALL_NODES, Index, NmtCommand, NmtState

from ..config.model import BusConfig, SdoWrite
from ..config.model.bus import Identity, MasterConfig
from .configuration import Configurator, preset_outputs, read_outputs
from .events import Event, EventKind, Report, Severity
from .frame_sender import Send, SendNmt
from .life_signs import guarding_request
from .remote_node import BootPhase, RemoteNode
from .scheduler import Promise, Scheduler, Task
from .sdo_channel import SECOND_ANSWER_TIME

BOOT_UP_TIME = 0.25  # [s] in which devices that were reset usually announce themselves
STATE_TIMEOUT = 0.5  # [s] to wait for a life sign beyond the period of the heartbeat
RESTORE_SIGNATURE = b'load'  # CiA 301, 7.5.2.14


class BootFault(Enum):
    """Reason why a boot failed, with its letter in CiA 302-2.

    Identity faults are named like the attributes of Identity.
    """

    NO_ANSWER = 'B', 'no answer to the read of 0x1000'
    DEVICE_TYPE = 'C', 'device type 0x1000 differs'
    VENDOR_ID = 'D', 'vendor id 0x1018:01 differs'
    NO_GUARDING = 'F', 'no answer to node guarding'
    CONFIGURATION = 'J', 'configuration failed'
    NO_HEARTBEAT = 'K', 'no heartbeat'
    RUNNING = 'L', 'was operational already'
    PRODUCT_CODE = 'M', 'product code 0x1018:02 differs'
    REVISION_NUMBER = 'N', 'revision number 0x1018:03 differs'
    SERIAL_NUMBER = 'O', 'serial number 0x1018:04 differs'

    def __str__(self) -> str:
        """Return the letter with its source, as manuals of masters list it."""
        letter, text = self.value
        return f'CiA 302-2 boot error {letter}: {text}'


class BootProcess:
    """Boots one device, with retries until it is operational.

    It detects the device by its boot-up message or its answer to a read of 0x1000, whichever comes
    first, so it also finds a device that missed the reset.
    """

    def __init__(
        self,
        node: RemoteNode,
        bus: BusConfig,
        scheduler: Scheduler,
        send_nmt: SendNmt,
        startup: Startup,
        *,
        request_state: Callable[[int], object],
    ) -> None:
        self._node = node
        self._scheduler = scheduler
        self._send_nmt = send_nmt
        self._startup = startup
        self._request_state = request_state
        self._start = bus.master.start_nodes
        self._sdo_timeout = bus.master.boot_timeout
        self._configurator = Configurator(
            node,
            bus,
            on_write=lambda place: self._enter(BootPhase.CONFIGURING, place),
        )
        line = bus.place_of(node.name, 'reset_communication').line
        self._written = f' ({bus.file}:{line})' if line else ''
        self._reported = ''
        self._failure = ''  # failure of the previous attempt, in words
        self._fault: BootFault | None = BootFault.CONFIGURATION
        self._restored = False

    async def run(self, *, announced: bool, pause: float = 0.0, was_reset: bool = False) -> None:
        """Boot the device after ``pause`` in [s]; return when it is operational.

        A device that has ``announced`` itself by its boot-up message is not searched for. One that
        ``was_reset`` gets no request before its boot-up time, as that would be lost.
        """
        self._startup.forget(self._node)
        self._failure = ''
        if was_reset:
            self._enter(BootPhase.WAITING)
            await self._scheduler.timer(BOOT_UP_TIME)
        if pause > 0.0:
            self._enter(BootPhase.WAITING, f'{pause:g} s, as it {self._node.loss}')
            await self._scheduler.timer(pause)
        while not await self._attempt(announced=announced):
            announced = False
            await self._scheduler.timer(self._node.config.boot_timeout)

    async def _attempt(self, *, announced: bool) -> bool:
        config = self._node.config
        try:
            if not announced:
                await self._find()
            if not config.boot or (
                not announced and not config.reset_communication and await self._runs()
            ):
                await self._take_over()
            else:
                await self._boot()
        except (BootError, BusError, SdoError) as error:
            self._fail(str(error))
            return False
        return True

    async def _find(self) -> None:
        self._enter(BootPhase.WAITING)
        while not await self._answers():
            self._report_once(
                'no boot-up message and no answer yet; the boot begins when it answers. Check '
                f'power, wiring, termination, bit rate and node id {self._node.config.node_id} '
                f'({BootFault.NO_ANSWER})'
            )

    async def _answers(self) -> bool:
        """Read 0x1000; return whether the device answers at all."""
        try:
            with suppress(SdoAbortError):
                await self._node.sdo.read(Index.DEVICE_TYPE, 0, self._node.config.boot_timeout)
        except SdoTimeoutError:
            return False
        return True

    async def _boot(self) -> None:
        node = self._node
        self._enter(BootPhase.IDENTITY)
        await self._check_identity(node.config.identity)
        self._enter(BootPhase.RESTING)
        before = f'lost before: {node.loss}' if node.loss else 'not enabled by this master'
        await node.bring_to_rest(f'it was enabled when its device was found ({before})')
        # PDO parameters may only be written while the device does not process PDOs
        await self._command(NmtCommand.ENTER_PRE_OPERATIONAL)
        if node.life.silent and node.config.uses_node_guarding:
            await self._await_answer_to_guarding()
        self._fault = BootFault.CONFIGURATION
        if node.config.restore_configuration and not self._restored:
            await self._restore(node.config.restore_configuration)
        configured_at = self._scheduler.now
        await self._configurator.apply()
        # not waiting for the first heartbeat saves its period; its absence is noticed all the
        # same, and only a device that once was without it has to show it first
        if node.life.silent and not node.config.uses_node_guarding:
            await self._await_heartbeat(configured_at)
        await read_outputs(node, self._sdo_timeout)
        if not self._startup.complete:
            self._enter(BootPhase.HELD, self._startup.missing_text())
        started = await self._startup.admit(node)
        self._enter(BootPhase.STARTING)
        if self._start and not started:
            await self._command(NmtCommand.START)
        self._restored = False
        self._go_online(
            'operational' if self._start else 'configured; start_nodes is false in bus.yml'
        )

    async def _command(self, command: NmtCommand) -> None:
        """Send an NMT command and wait until it is sent; withdraw it if the boot ends before."""
        sent = self._send_nmt(command, self._node.config.node_id)
        try:
            await sent
        finally:
            sent.abandon()

    async def _restore(self, subindex: int) -> None:
        """Restore default parameters, which take effect after a reset (CiA 301, 7.5.2.14)."""
        node = self._node
        await self._configurator.write(
            SdoWrite(Index.RESTORE_PARAMETERS, subindex, RESTORE_SIGNATURE)
        )
        self._restored = True
        await self._command(NmtCommand.RESET_NODE)
        # the boot-up message ends this boot and starts the next one
        await self._scheduler.timer(node.config.boot_timeout)
        raise BootError(
            f'{node.name} (node {node.config.node_id}) sent no boot-up message within '
            f'{node.config.boot_timeout:g} s after its defaults were restored'
        )

    async def _runs(self) -> bool:
        """Return whether a device with the keep-alive bit is already operational."""
        node = self._node
        self._fault = BootFault.NO_HEARTBEAT
        self._enter(BootPhase.STATE)
        self._request_state(node.config.node_id)
        timeout = node.config.heartbeat_producer + STATE_TIMEOUT
        try:
            await self._scheduler.until(lambda: node.nmt_state is not None, timeout)
        except TimeoutError:
            raise BootError(
                f'{node.name} (node {node.config.node_id}) is to be kept alive '
                '(reset_communication: false), but does not send its NMT state: neither by a '
                'heartbeat nor as an answer to node guarding; it is left alone. Call '
                f'~/nmt_reset_node once, or remove reset_communication: false{self._written}'
            ) from None
        return node.nmt_state is NmtState.OPERATIONAL

    async def _take_over(self) -> None:
        """Take over a running device without sending a frame that could disturb it."""
        node = self._node
        self._enter(BootPhase.IDENTITY)
        await self._check_identity(node.config.identity)
        self._fault = BootFault.CONFIGURATION
        if node.config.boot:
            await self._configurator.write_error_control()
        differences = await self._configurator.differences()
        if differences:
            raise BootError(
                f'{node.name} (node {node.config.node_id}) runs with other PDOs: '
                f'{"; ".join(differences)}; it is left alone. Call ~/nmt_reset_node to '
                'have it configured'
            )
        await preset_outputs(node)
        reason = f' ({BootFault.RUNNING})' if node.nmt_state is NmtState.OPERATIONAL else ''
        self._go_online(f'taken over as it runs, nothing was reset{reason}', taken_over=True)

    def _go_online(self, text: str, *, taken_over: bool = False) -> None:
        self._node.go_online(self._scheduler.now, taken_over=taken_over)
        if not self._node.config.is_drive:
            self._scheduler.background(self._node.objects.read_digital_inputs())
        self._reported = self._failure = ''
        self._enter(BootPhase.OPERATIONAL)
        self._node.report(EventKind.BOOT, Severity.INFO, text)

    async def _check_alone(self) -> None:
        """Refuse a node id shared by several devices: each would execute the commands for one.

        A frame that the bus brings twice is no second device, so one doubled answer is confirmed
        by another.
        """
        counters, node_id = self._node.sdo.counters, self._node.config.node_id
        self._fault = None  # CiA 302-2 defines no letter for it
        for index in (Index.ERROR_REGISTER, Index.DEVICE_TYPE):
            with suppress(SdoAbortError):
                await self._configurator.read_number(index, 0)
            doubled = counters.doubled  # a server answers in order, so late answers precede
            await self._scheduler.timer(SECOND_ANSWER_TIME)
            if counters.doubled == doubled:
                return
        raise BootError(
            f'two devices have node id {node_id}: each SDO of {self._node.name} is answered '
            'twice; it is not started, as both would move. Switch one of them off, and give it '
            'another node id (by its switches, or the tool of its vendor)'
        )

    async def _check_identity(self, expected: Identity) -> None:
        await self._check_alone()
        for attribute, index, subindex, wanted in expected.objects:
            self._fault = BootFault[attribute.upper()]
            found = await self._configurator.read_number(index, subindex)
            if found != wanted:
                title = attribute.replace('_', ' ')
                key = attribute if index == Index.IDENTITY else 'dcf (0x1000)'
                raise BootError(
                    f'{self._node.name} (node {self._node.config.node_id}) is another device: '
                    f'{title} 0x{found:08X}, expected 0x{wanted:08X}; correct {key} in bus.yml or '
                    'use the EDS of this device'
                )

    async def _await_answer_to_guarding(self) -> None:
        """Wait for an answer to node guarding before the first write, else raise."""
        node = self._node
        self._fault = BootFault.NO_GUARDING
        self._enter(BootPhase.ERROR_CONTROL)
        since = self._scheduler.now
        self._request_state(node.config.node_id)
        try:
            await self._scheduler.until(lambda: node.life.last > since, STATE_TIMEOUT)
        except TimeoutError:
            raise BootError(
                f'{node.name} (node {node.config.node_id}) has never answered node guarding; it '
                'is not started, because its loss would go unnoticed. It is requested again every '
                f'{node.config.boot_timeout + STATE_TIMEOUT:g} s; give it a heartbeat_producer '
                'instead of guard_time, or guard_time: 0 if it has neither'
            ) from None

    async def _await_heartbeat(self, since: float) -> None:
        node = self._node
        timeout = node.config.heartbeat_timeout
        self._fault = BootFault.NO_HEARTBEAT
        self._enter(BootPhase.ERROR_CONTROL)
        try:
            await self._scheduler.until(lambda: node.life.last > since, timeout)
        except TimeoutError:
            raise BootError(
                f'{node.name} (node {node.config.node_id}) sent no heartbeat within '
                f'{timeout * 1000:g} ms although 0x1017 was written; it is not started, because '
                'its loss would go unnoticed: does it support heartbeat_producer?'
            ) from None

    def _enter(self, phase: BootPhase, detail: str = '') -> None:
        self._node.phase = phase
        self._node.phase_detail = '; '.join(filter(None, (detail, self._failure)))

    def _fail(self, reason: str) -> None:
        step, fault = self._node.phase.value, f' ({self._fault})' if self._fault else ''
        self._failure = ''
        self._enter(BootPhase.FAILED, f'{step}: {reason}{fault}')
        self._failure = f'the last attempt failed while {step}: {reason}{fault}'
        self._report_once(f'boot failed while {step}: {reason}{fault}')

    def _report_once(self, text: str) -> None:
        """Report a failure unless the previous attempt failed for the same reason."""
        if text != self._reported:
            self._reported = text
            self._node.report(EventKind.BOOT_FAILED, Severity.WARNING, text)


class BootManager:
    """Starts the boot of a device when it appears, restarts or is lost."""

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
        """Subscribe to device events; no boot begins before :meth:`start`."""
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

    def start(
        self,
        node: RemoteNode,
        *,
        announced: bool = False,
        pause: float = 0.0,
        was_reset: bool = False,
    ) -> None:
        """Boot a device, see :meth:`BootProcess.run`; restart a boot that is in progress."""
        self._end(node)
        process = self._processes[node.name]
        boot = process.run(announced=announced, pause=pause, was_reset=was_reset)
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


CommandNmt: TypeAlias = Callable[[NmtCommand, int], Coroutine[Promise[Any], None, str]]
"""Sends a command after the axes that it concerns were brought to rest."""


class Startup:
    """Delays the start of configured devices until all mandatory ones are configured.

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
        # all mandatory devices were configured, so no other device is held back any more
        self.complete = not self._missing()
        for node in nodes:
            if node.config.mandatory:
                node.on_gone = partial(self._lost, node)

    async def watch(self) -> None:
        """Report mandatory devices that are missing after ``boot_time``."""
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
        """Return a text that names the missing mandatory devices."""
        return ', '.join(node.name for node in self._missing())

    async def admit(self, node: RemoteNode) -> bool:
        """Wait until a configured device may be started.

        Returns:
            True if one NMT frame has started it together with the others.
        """
        if self.complete:
            return False
        promise: Promise[bool] = Promise()
        self._waiting[node] = promise
        if not self._missing():
            self._release()
        return await promise

    def forget(self, node: RemoteNode) -> None:
        """Remove a device from those waiting, because its boot restarts."""
        self._waiting.pop(node, None)

    def _missing(self) -> list[RemoteNode]:
        return [
            node
            for node in self._nodes
            if node.config.mandatory and not node.online and node not in self._waiting
        ]

    def _release(self) -> None:
        self.complete = True
        # one frame starts all present devices; those still being configured must not receive it
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
        """Bring the axes to rest, then send an NMT command to all devices."""
        try:
            await self._command_nmt(command, ALL_NODES)
        except BusError as error:
            self._report_error(str(error))

    def _report_error(self, text: str) -> None:
        self._report(Event(EventKind.BOOT_FAILED, Severity.ERROR, '', text))
