# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device as the master sees it: NMT state, heartbeat, EMCY, SDO client and process image."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from enum import Enum
from functools import partial

from ..can.frame import Frame
from ..config.model import NodeConfig
from ..exceptions import CodecError, SdoError
from ..standard.datatypes import decode, encode, Value
from ..standard.dictionary import ObjectEntry
from ..standard.emcy import Emergency
from ..standard.nmt import COMMANDED_STATES, NmtCommand, NmtState, parse_heartbeat
from ..standard.objects import Index
from .background_objects import BackgroundReader, BackgroundWriter
from .events import Event, EventKind, Report, Severity
from .guarding import Guarding
from .process_image import Input, ProcessImage, Reader, SyncRound, Writer
from .scheduler import Promise, Scheduler
from .sdo_client import SdoClient
from .start_values import start_value

SILENCE_MAX = 0.5  # [s] without an answer to SYNC after which a device takes no targets
HISTORY = 16  # EMCYs that are remembered
START_TIME = 0.25  # [s] in which a device follows the command to start


class BootPhase(Enum):
    """How far a device has come; the value is how a person reads it."""

    WAITING = 'waiting for the device'
    STATE = 'asking for its NMT state'
    IDENTITY = 'checking its identity'
    CONFIGURING = 'configuring'
    ERROR_CONTROL = 'waiting for its heartbeat'
    HELD = 'waiting for mandatory devices'
    STARTING = 'starting'
    OPERATIONAL = 'operational'
    FAILED = 'failed'


class RemoteNode:
    """One device on the bus.

    Attributes:
        config: What bus.yml and its EDS say.
        image: Its process image.
        sdo: Its SDO client.
        nmt_state: NMT state as received, None before the first heartbeat or boot-up.
        phase: How far it has booted.
        phase_detail: What it is doing in that phase, or why it failed.
        online: Booted, and not lost since.
        left_operational: Online, but somebody stopped it or sent it to pre-operational.
        wanted: NMT state that was commanded last, by whomever on this bus; None when unknown.
        last_heartbeat: Steady time of the last heartbeat in [s].
        owes_heartbeat: It was started and never sent a heartbeat, though it is supervised; it has
            to show one before it is started again.
        taken_over: It was in operation already when it came online, and has not been disturbed
            since.
        watch_slot: Entry of its 0x1016 by which it watches the master, 0 for none.
        emergencies: The last EMCYs, the newest at the end, with the steady time of each in [s].
        last_emergency: Last EMCY that was no reset, None when the device reported its end.
        loss: Why it was lost last, empty while it is online.
        missed_pdos: TPDOs that did not answer a SYNC.
    """

    def __init__(
        self,
        config: NodeConfig,
        scheduler: Scheduler,
        sync: SyncRound,
        send: Callable[[Frame], None],
        report: Report,
    ) -> None:
        """Build the device from its configuration.

        Args:
            config: What bus.yml and its EDS say.
            scheduler: Time.
            sync: The SYNC round of the bus.
            send: Hands a frame to the bus.
            report: Takes events.
        """
        self.config = config
        self.image = ProcessImage(
            config.tpdos,
            config.rpdos,
            sync,
            start=partial(start_value, config),
            send_last=Index.CONTROLWORD,
        )
        self.sdo = SdoClient(config.node_id, config.name, scheduler, send)
        self.nmt_state: NmtState | None = None
        self.phase = BootPhase.WAITING
        self.phase_detail = ''
        self.online = False
        self.left_operational = False
        self.wanted: NmtState | None = None
        self.last_heartbeat = 0.0
        self.owes_heartbeat = False
        self.taken_over = False
        self.watch_slot = 0
        self.emergencies: deque[tuple[float, Emergency]] = deque(maxlen=HISTORY)
        self.last_emergency: Emergency | None = None
        self.loss = ''
        self.missed_pdos = 0
        self.on_boot_up: Callable[[], None] = lambda: None
        self.on_lost: list[Callable[[str], None]] = []  # its drivers stop
        self.on_dropped_out: Callable[[], None] = lambda: None  # it has to be booted again
        self._supervised = False
        self._online_since = 0.0
        self._commanded_at = 0.0
        self._answered_at = 0.0
        self._silent = False
        self._scheduler = scheduler
        self._report = report
        self._polled: dict[tuple[int, int], BackgroundReader] = {}
        self._background_writers: list[BackgroundWriter] = []
        self._every_sync = [entry for entry in self.image.inputs if entry.every_sync]
        self._timed = [entry for entry in self.image.inputs if entry.deadline > 0.0]
        self._stopped_pdos: set[int] = set()
        self._guarding: Guarding | None = None
        if config.guarded:
            timing = (config.guard_time, config.retry_factor)
            self._guarding = Guarding(config.node_id, *timing, send)
        for entry in self.image.inputs:
            entry.on_short = self._tell_short

    @property
    def operational(self) -> bool:
        """Online, and nobody stopped it or sent it to pre-operational."""
        return self.online and not self.left_operational

    @property
    def answers(self) -> bool:
        """Whether its TPDOs come: those that answer SYNC, and those with an event time."""
        silent = self._scheduler.now - self._answered_at >= SILENCE_MAX
        return not (silent and self._every_sync) and not self._stopped_pdos

    @property
    def phase_text(self) -> str:
        """How far it has booted, in words."""
        return f'{self.phase.value} {self.phase_detail}'.rstrip()

    @property
    def name(self) -> str:
        """Name in bus.yml."""
        return self.config.name

    def expect_answers(self) -> None:
        """A SYNC is about to be sent: await the TPDOs that answer each one."""
        if self.online:
            if not all(entry.awaited for entry in self._every_sync):
                self._answered_at = self._scheduler.now
                self._silent = False
            for entry in self._every_sync:
                entry.expect()

    def report(self, kind: EventKind, severity: Severity, text: str) -> None:
        """Tell the owner of the network something about this device."""
        self._report(Event(kind, severity, self.name, text))

    def count_missed(self) -> int:
        """Count the TPDOs that did not answer the last SYNC, and return their number."""
        missed = sum(entry.awaited for entry in self._every_sync)
        self.missed_pdos += missed
        if missed and self.operational and not self.answers and not self._silent:
            self._silent = True
            self.report(
                EventKind.PDO,
                Severity.WARNING,
                f'has not answered SYNC for {SILENCE_MAX * 1000:g} ms, and takes no targets until '
                'it does; is it still there?',
            )
        return missed

    def receive_heartbeat(self, frame: Frame) -> None:
        """Take a heartbeat or boot-up message."""
        state = parse_heartbeat(frame.data)
        if state is None:
            return
        guarding = self._guarding if state is not NmtState.BOOT_UP else None
        if guarding is not None and self.online and not guarding.receive(frame.data):
            return
        self.last_heartbeat = frame.timestamp
        if state is not self.nmt_state:
            self._nmt_state_changed(state)
        if state is NmtState.BOOT_UP:
            self.last_emergency = None  # whatever it was, it ended with the restart
            self.on_boot_up()
        elif self._dropped_out(state, frame.timestamp):
            self.lost(
                f'left Operational by itself (NMT state {state.name}): it has missed the master '
                'or the start, or its error behaviour 0x1029 says so; it is booted again'
            )
            self.on_dropped_out()

    def note_command(self, command: NmtCommand) -> None:
        """An NMT command for this device is on the bus, from us or from somebody else."""
        self.wanted = COMMANDED_STATES.get(command)
        self._commanded_at = self._scheduler.now

    def _dropped_out(self, state: NmtState, now: float) -> bool:
        followed = now - self._commanded_at > START_TIME
        started = self.online and self.wanted is NmtState.OPERATIONAL
        return started and followed and state is not NmtState.OPERATIONAL

    def _nmt_state_changed(self, state: NmtState) -> None:
        before, self.nmt_state = self.nmt_state, state
        left_before = self.left_operational
        self.left_operational = (
            self.online
            and state is not NmtState.OPERATIONAL
            and (left_before or before is NmtState.OPERATIONAL)
        )
        severity = Severity.WARNING if self.left_operational else Severity.INFO
        self.report(EventKind.NMT_STATE, severity, f'NMT state {state.name}')
        if self.left_operational and not left_before and state is not NmtState.BOOT_UP:
            # it hears no PDO any more: what it said before is no longer true, and whoever drives
            # it must not go on as if it followed
            self.image.clear()
            itself = self.wanted is NmtState.OPERATIONAL
            who = 'it left Operational by itself, for' if itself else 'somebody sent it to'
            self._stop_drivers(f'{who} NMT state {state.name}')

    def receive_emergency(self, frame: Frame) -> None:
        """Take an EMCY message."""
        try:
            emergency = Emergency.decode(frame.data)
        except CodecError as error:
            self.report(EventKind.EMERGENCY, Severity.WARNING, f'odd EMCY: {error}')
            return
        self.emergencies.append((frame.timestamp, emergency))
        if emergency.is_reset:
            self.last_emergency = None
            self.report(EventKind.EMERGENCY, Severity.INFO, f'EMCY: {emergency}')
        else:
            self.last_emergency = emergency
            self.report(EventKind.EMERGENCY, Severity.ERROR, f'EMCY: {emergency}')

    def go_online(self, now: float, *, taken_over: bool = False) -> None:
        """The device is booted: talk to it, and watch its life signs when it is configured.

        Args:
            now: Steady time in [s], from which the first heartbeat is awaited.
            taken_over: It was in operation already, and was not disturbed.
        """
        self.taken_over = taken_over
        self.image.clear()  # what it sent before it was configured says nothing about now
        self.online = True
        self._supervised = self.config.heartbeat_timeout > 0
        self.last_heartbeat = now
        self.owes_heartbeat = False
        self._online_since = self._answered_at = now
        self._silent = False
        self.loss = ''
        if self._guarding is not None:
            self._guarding.start(now)

    def watch(self, now: float) -> bool:
        """Look for life signs and PDOs that are overdue; tells whether the device was lost now.

        Args:
            now: Steady time in [s].
        """
        if self._supervised and now - self.last_heartbeat > self.config.heartbeat_timeout:
            self._heartbeat_lost()
            return True
        if self._guarding is not None and self._guarding.advance(now):
            self.lost(
                f'lost: no answer to node guarding {self.config.retry_factor} times in a row, '
                f'each {self.config.guard_time * 1000:g} ms apart'
            )
            return True
        if self._timed and self.operational:
            self._watch_timed(now)
        return False

    def _watch_timed(self, now: float) -> None:
        for entry in self._timed:
            number = entry.config.number
            if entry.values is None or now - entry.timestamp <= entry.deadline:
                self._stopped_pdos.discard(number)
            elif number not in self._stopped_pdos:
                self._stopped_pdos.add(number)
                self.report(
                    EventKind.PDO,
                    Severity.WARNING,
                    f'TPDO {number} has stopped: none for {entry.deadline * 1000:g} ms, though '
                    'its event timer says so; the device takes no targets until it comes again',
                )

    def _tell_short(self, entry: Input, length: int) -> None:
        if entry.length_errors == 1:
            self.report(
                EventKind.PDO,
                Severity.WARNING,
                f'TPDO {entry.config.number} (0x{entry.config.cob_id:03X}) has {length} bytes, '
                f'its mapping {entry.codec.size}; it is not used. Does the device have another '
                'mapping than bus.yml, or does somebody else send with this identifier?',
            )

    def _heartbeat_lost(self) -> None:
        timeout = self.config.heartbeat_timeout * 1000  # [ms]
        self.owes_heartbeat = self.last_heartbeat <= self._online_since
        self.lost(f'heartbeat lost: none within its consumer time of {timeout:g} ms')

    def lost(self, reason: str) -> None:
        """The device is gone: forget what it said and tell whoever drives it."""
        self.report(EventKind.HEARTBEAT_LOST, Severity.ERROR, reason)
        self.loss = reason
        self.nmt_state = None
        self.online = False
        self._stop_drivers(reason)  # first, so that nobody asks it again when its SDOs end
        self.offline(reason)

    def _stop_drivers(self, reason: str) -> None:
        self.taken_over = False  # whatever it did, from now on it is led anew
        for driver_stops in self.on_lost:
            driver_stops(reason)

    def offline(self, reason: str) -> None:
        """Stop talking to the device until it is booted again."""
        self.online = False
        self.left_operational = False
        self._supervised = False
        self._stopped_pdos.clear()
        if self._guarding is not None:
            self._guarding.stop()
        self.image.clear()
        self.sdo.cancel_all(reason)
        for entry in self._polled.values():
            entry.value = None
        for writer in self._background_writers:
            writer.forget()

    def reader(self, index: int, subindex: int = 0) -> Reader:
        """Return a reader for an object, by TPDO when it is mapped, else by polling."""
        mapped = self.image.reader(index, subindex)
        if mapped is not None:
            return mapped
        return self._polled.setdefault((index, subindex), BackgroundReader())

    def writer(self, index: int, subindex: int = 0) -> Writer:
        """Return a writer for an object, by RPDO when it is mapped, else by SDO on change."""
        mapped = self.image.writer(index, subindex)
        if mapped is not None:
            return mapped
        writer = BackgroundWriter(self, index, subindex)
        self._background_writers.append(writer)
        return writer

    async def poll(self, period: float) -> None:
        """Keep the objects that no TPDO carries up to date while the device is online."""
        while self._polled and self.online:
            for address, entry in list(self._polled.items()):
                try:
                    value = await self.read_object(*address)
                except (SdoError, CodecError):
                    if not self.online:
                        return
                    continue  # the SDO counters show it; the value stays as old as it is
                entry.value = value if isinstance(value, (int, float)) else None
            await self._scheduler.timer(period)

    async def unwatch(self) -> None:
        """Have the device watch the master no longer, before the master ends; never raises."""
        if not self.online or not self.watch_slot:
            return
        try:
            await self.write_object(Index.CONSUMER_HEARTBEAT, self.watch_slot, 0)
        except (SdoError, CodecError) as error:
            self.report(EventKind.BOOT, Severity.WARNING, f'goes on to watch the master: {error}')

    def entry(self, index: int, subindex: int = 0) -> ObjectEntry:
        """Return what the EDS says of an object.

        Raises:
            SdoError: The EDS does not know it.
        """
        entry = self.config.dictionary.get(index, subindex)
        if entry is None:
            raise SdoError(
                f'{self.name} has no object 0x{index:04X}:{subindex:02X} in '
                f'{self.config.eds.name}; the services of the master node, whose requests name '
                'the data type, reach it all the same'
            )
        return entry

    async def read_object(
        self, index: int, subindex: int = 0, *, timeout: float | None = None
    ) -> Value:
        """Read an object by SDO and decode it by its type in the EDS.

        Args:
            index: Object index.
            subindex: Sub-index.
            timeout: How long each answer may take in [s]; by default what bus.yml says.

        Raises:
            SdoError: The device did not answer or aborted, or the EDS does not know the object.
            CodecError: The answer does not fit the type.
        """
        entry = self.entry(index, subindex)
        patience = self.config.sdo_timeout if timeout is None else timeout
        return decode(entry.data_type, await self.sdo.read(index, subindex, patience))

    def write_object(self, index: int, subindex: int, value: Value) -> Promise[None]:
        """Write an object by SDO, encoded by its type in the EDS; errors reject the promise."""
        try:
            data = encode(self.entry(index, subindex).data_type, value)
        except (SdoError, CodecError) as error:
            refused: Promise[None] = Promise()
            refused.reject(error)
            return refused
        return self.sdo.write(index, subindex, data, self.config.sdo_timeout)
