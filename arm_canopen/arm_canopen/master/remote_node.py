# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device as the master sees it: NMT state, boot, life signs, EMCY, PDOs and objects."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, TypeAlias

from canopen_core import CodecError, SdoError
from canopen_core.can import Frame
from canopen_core.standard import (
    COMMANDED_STATES,
    Emergency,
    Index,
    NmtCommand,
    NmtState,
    parse_heartbeat,
    RESETS,
)

from ..config.model import NodeConfig
from .events import Event, EventKind, Report, Severity
from .frame_sender import Send
from .life_signs import EmergencyLog, LifeSigns, PdoWatch
from .process_image import SentRpdo, SyncRound
from .remote_objects import RemoteObjects
from .scheduler import Promise, Scheduler
from .sdo_channel import SdoCounters

START_TIME = 0.25  # [s] in which a device follows the command to start
LIVE_SHARE = 0.5  # of the consumer time of its life signs, in which a TPDO shows that it lives
RESET_TIME = 10.0  # [s] in which a device that was reset has sent its boot-up message
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 30.0  # [s] before a device that drops out is booted again
STABLE_TIME = 10.0  # [s] in operation after which a drop is the first one again


LeadToRest: TypeAlias = Callable[[str, Severity], Coroutine[Promise[Any], None, bool]]


class BootPhase(Enum):
    """How far a device has come; the value is how a person reads it."""

    WAITING = 'waiting for the device'
    STATE = 'asking for its NMT state'
    RESTING = 'bringing its axes to rest'
    IDENTITY = 'checking its identity'
    CONFIGURING = 'configuring'
    ERROR_CONTROL = 'waiting for its life sign'
    HELD = 'waiting for mandatory devices'
    STARTING = 'starting'
    OPERATIONAL = 'operational'
    FAILED = 'failed'


class RemoteNode:
    """One device on the bus."""

    def __init__(
        self,
        config: NodeConfig,
        scheduler: Scheduler,
        sync: SyncRound,
        send: Send,
        report: Report,
    ) -> None:
        self.config = config  # its configuration, from bus.yml and its EDS
        self.name = config.name  # name in bus.yml
        self.online = False  # booted, and not lost since
        self._scheduler = scheduler
        self._report = report
        # its objects, by PDO and SDO
        self.objects = RemoteObjects(
            config, scheduler, sync, send, report=self.report, is_online=lambda: self.online
        )
        self.image = self.objects.image  # its process image
        self.sdo = self.objects.sdo  # its SDO client
        # NMT state as received, None before the first heartbeat or boot-up and after a loss; the
        # commanded one of a device without heartbeat and guarding, and where it leaves Operational
        self.nmt_state: NmtState | None = None
        self.phase = BootPhase.WAITING  # how far it has booted
        self.phase_detail = ''  # what it is doing in that phase, or why it failed
        # online, but another node stopped it or sent it to pre-operational
        self.left_operational = False
        # NMT state that was commanded last, by whomever on this bus; None when unknown
        self.wanted: NmtState | None = None
        # it was in operation already when it came online, and has not been disturbed since
        self.taken_over = False
        self.watch_slot = 0  # entry of its 0x1016 by which it watches the master, 0 for none
        self.loss = ''  # why it was lost last, empty while it is online
        self.life = LifeSigns(config, send)  # its heartbeat, or its answers to node guarding
        self.emergencies = EmergencyLog(self.report)  # its EMCYs
        self.pdos = PdoWatch(self.image.tpdos, self.report)  # whether its TPDOs come
        # sends it an NMT command
        self.send_nmt: Callable[[NmtCommand], object] = lambda command: None
        self.on_boot_up: Callable[[], None] = lambda: None  # called when it has restarted
        # its drivers, which stop; each gets the reason
        self.on_lost: list[Callable[[str], None]] = []
        # called when it was lost by itself; what an NMT command does to it is no loss
        self.on_gone: Callable[[], None] = lambda: None
        # its drivers, which bring what moves to rest and take its power away, for a reason that
        # is reported with a severity; each returns whether that was seen
        self.lead_to_rest: list[LeadToRest] = []
        self._missing = ''  # the life sign, in words
        self._resting: Promise[list[bool]] | None = None
        # its drivers, which stop because a step of the cycle failed for this device; each gets the
        # error, and the RPDO that cannot be sent for it, if it is one
        self.on_failed: list[Callable[[Exception, SentRpdo | None], None]] = []
        self._failed = False
        # called when it has to be booted again, though it did not restart, with the time to leave
        # it alone before in [s]
        self.on_dropped_out: Callable[[float], None] = lambda pause: None
        self._drops = 0  # drops out of operation in a row
        self._booted_at = 0.0
        self._commanded: NmtCommand | None = None
        self._commanded_at = 0.0

    @property
    def operational(self) -> bool:
        """Online, and neither stopped nor sent to pre-operational."""
        return self.online and not self.left_operational

    @property
    def was_booted(self) -> bool:
        """Whether this master has booted it, so that its axes may move by a command of ours."""
        return self.online or bool(self.loss)

    @property
    def left_by_itself(self) -> bool:
        """Whether no NMT command has brought it where it is."""
        return not self._being_reset and self.wanted in {None, NmtState.OPERATIONAL}

    @property
    def phase_text(self) -> str:
        """How far it has booted, in words."""
        return f'{self.phase.value} {self.phase_detail}'.rstrip()

    def report(self, kind: EventKind, severity: Severity, text: str) -> None:
        """Report something about this device to the owner of the network."""
        self._report(Event(kind, severity, self.name, text))

    def expect_answers(self) -> None:
        """A SYNC is about to be sent: await the TPDOs that answer each one."""
        if self.online:
            self.pdos.expect()

    def receive_heartbeat(self, frame: Frame) -> None:
        """Process a heartbeat or boot-up message."""
        state = parse_heartbeat(frame.data)
        if state is None or not self.life.take(state, frame, supervised=self.online):
            return
        if state is not self.nmt_state and not self._is_outdated(state, frame.timestamp):
            self._nmt_state_changed(state)
        if state is NmtState.BOOT_UP:
            self.emergencies.restarted()
            self.on_boot_up()
        elif self._dropped_out(state, frame.timestamp):
            if frame.timestamp - self._booted_at > STABLE_TIME:
                self._drops = 0
            self._drops += 1
            pause = float(min(FIRST_PAUSE * 2 ** (self._drops - 1), LONGEST_PAUSE))
            again = f', as it has done so {self._drops} times in a row' if self._drops > 1 else ''
            self.lost(
                f'left Operational by itself (NMT state {state.name}): {self._why_dropped()}; it '
                f'is booted again in {pause:g} s{again}'
            )
            self.on_dropped_out(pause)

    def note_command(self, command: NmtCommand) -> None:
        """An NMT command for this device is on the bus, from this master or from another."""
        ran = self.left_operational or NmtState.OPERATIONAL in (self.wanted, self.nmt_state)
        self.wanted = COMMANDED_STATES.get(command)
        self._commanded = command
        self._commanded_at = self._scheduler.now
        if self.wanted is None:
            return
        if self.is_mute:
            if self.wanted is not self.nmt_state:
                self._nmt_state_changed(self.wanted)
        elif self.wanted is not NmtState.OPERATIONAL:
            if self.online and ran:
                self._commanded_away(self.wanted)
        elif self.left_operational:  # its TPDOs and life signs show whether it starts
            self.image.clear()  # what came after it was commanded away
            self.left_operational = False

    def _commanded_away(self, state: NmtState) -> None:
        """Act at once on a command to leave Operational; its next life sign may be far away."""
        now = self._scheduler.now
        if self.life.missed and self._lives(now):
            self.life.start(now)  # the TPDOs that have shown that it lives end now
        self._nmt_state_changed(state, ran=True)

    def go_online(self, now: float, *, taken_over: bool = False) -> None:
        """The device is booted: talk to it, and await its first life sign from ``now`` on.

        One that is ``taken_over`` was in operation already, and was not disturbed.
        """
        self.taken_over = taken_over
        self.image.clear()  # what it sent before it was configured is no longer true
        self.online = True
        self._failed = False
        self._booted_at = now
        self.life.start(now)
        self.loss = ''
        if self.config.is_drive:
            self.pdos.warn_of_losses()

    def watch(self, now: float) -> bool:
        """Check for overdue life signs and PDOs; return whether it was lost now."""
        self.emergencies.look(now)
        missing = self.life.overdue(now)
        if missing:
            self._miss(missing, now)
        rested = self._resting is not None and self._resting.done
        if rested:
            self._resting = None
        if (rested and self.operational) or (self.life.missed and not self._lives(now)):
            self.lost(self._missing)
            return True
        if self.operational:
            self.pdos.look(now)
        return False

    def _lives(self, now: float) -> bool:
        """Return whether its TPDOs show that it is in operation, though a life sign is missing."""
        recent = now - self.pdos.last <= LIVE_SHARE * self.life.consumer_time
        return recent and self.operational and not self.life.silent

    def _miss(self, missing: str, now: float) -> None:
        """Lead a device to rest before it counts as lost, as its configuration would let it coast.

        Only when a life sign is missing twice in a row; the TPDOs show as much. From then on it is
        lost, even if one comes again: its drivers have no power any more.
        """
        self._missing = missing
        if not self._lives(now):
            return
        if self.life.missed == 1:
            text = f'{missing}, but its TPDOs come: it goes on until the next one is missing, too'
            self.report(EventKind.HEARTBEAT_LATE, Severity.WARNING, text)
        elif self._resting is None:
            self._resting = self.bring_to_rest(missing)

    def bring_to_rest(
        self, reason: str, severity: Severity = Severity.ERROR
    ) -> Promise[list[bool]]:
        """Bring all its axes to rest at the same time; for each, whether that was seen."""
        ends = [self._scheduler.spawn(lead(reason, severity)) for lead in self.lead_to_rest]
        return self._scheduler.spawn(self._scheduler.gather(ends))

    def fail(self, error: Exception, output: SentRpdo | None = None) -> None:
        """Stop its drivers, because a step of the cycle failed, or ``output`` cannot be sent.

        Other devices go on.
        """
        for driver_fails in self.on_failed:
            driver_fails(error, output)
        if not self.on_failed and not self._failed:
            self._failed = True  # once for each boot, as the text may be another one each time
            text = f'{type(error).__name__}: {error}'
            self.report(EventKind.PDO, Severity.ERROR, f'its part of the cycle failed: {text}')

    def restarted(self) -> None:
        """It sent a boot-up message: it is another one than before."""
        self.sdo.restarted()
        if self.online:
            self.lost('restarted: a boot-up message came while it was operational')
        else:
            self.offline('the device restarted')

    def lost(self, reason: str) -> None:
        """The device is gone: forget its values, and stop its drivers."""
        severity = Severity.ERROR
        if self._being_reset and self._commanded is not None:
            reason = f'restarts, by the NMT command {self._commanded.name}'
            severity = Severity.INFO
        self.report(EventKind.HEARTBEAT_LOST, severity, reason)
        self.loss = reason
        self.nmt_state = None
        self.online = False
        self._resting = None
        self._stop_drivers(reason)  # first, so that no driver sends new SDOs when these end
        self.offline(reason)
        if severity is Severity.ERROR:
            self.on_gone()

    def offline(self, reason: str) -> None:
        """Stop talking to the device until it is booted again."""
        self.online = False
        self.left_operational = False
        self.life.stop()
        self.pdos.stop()
        self.objects.forget(reason)

    async def unwatch(self) -> None:
        """Stop the device watching the master, before the master ends; never raises."""
        if not self.online or not self.watch_slot:
            return
        try:
            await self.objects.write_object(Index.CONSUMER_HEARTBEAT, self.watch_slot, 0)
        except (SdoError, CodecError) as error:
            self.report(EventKind.BOOT, Severity.WARNING, f'goes on to watch the master: {error}')

    @property
    def _being_reset(self) -> bool:
        """Whether an NMT command on this bus has just reset it."""
        recent = self._scheduler.now - self._commanded_at <= RESET_TIME
        return self._commanded in RESETS and recent

    @property
    def is_mute(self) -> bool:
        """Whether it never sends its NMT state, so that it counts as in the commanded one."""
        return not self.config.heartbeat_producer and not self.config.uses_node_guarding

    def _why_dropped(self) -> str:
        emergency = self.emergencies.last
        if emergency is not None:
            return f'its last EMCY is {emergency}'
        return (
            'it sent no EMCY; it has missed the master or the start, or its error behaviour '
            '0x1029 demands it'
        )

    def _is_outdated(self, state: NmtState, now: float) -> bool:
        """Whether it was sent before the device had got the command to leave Operational."""
        recent = now - self._commanded_at <= START_TIME
        return self.left_operational and state is NmtState.OPERATIONAL and recent

    def _dropped_out(self, state: NmtState, now: float) -> bool:
        followed = now - self._commanded_at > START_TIME
        started = self.online and self.wanted is NmtState.OPERATIONAL
        return started and followed and state is not NmtState.OPERATIONAL

    def _nmt_state_changed(self, state: NmtState, *, ran: bool = False) -> None:
        """Note a state that it shows or, in ``ran`` Operational before, was commanded to enter."""
        before, self.nmt_state = self.nmt_state, state
        left_before = self.left_operational
        self.left_operational = (
            self.online
            and state is not NmtState.OPERATIONAL
            and (ran or left_before or before is NmtState.OPERATIONAL)
        )
        was_reset = state is NmtState.BOOT_UP and self._being_reset
        severity = Severity.WARNING if self.left_operational and not was_reset else Severity.INFO
        self.report(EventKind.NMT_STATE, severity, f'NMT state {state.name}')
        if self.left_operational and not left_before and state is not NmtState.BOOT_UP:
            # it processes no PDO any more: its values are no longer true, and whoever drives
            # it must not go on as if it followed
            self.image.clear()
            itself = self.wanted is NmtState.OPERATIONAL
            who = 'it left Operational by itself, for' if itself else 'it was sent to'
            self._stop_drivers(f'{who} NMT state {state.name}')

    def _stop_drivers(self, reason: str) -> None:
        self.taken_over = False  # from now on it is commanded anew
        for driver_stops in self.on_lost:
            driver_stops(reason)


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """Snapshot of the state of one device."""

    name: str  # name in bus.yml
    node_id: int  # CANopen node id
    online: bool  # booted, and not lost since
    nmt_state: NmtState | None  # NMT state as received, None before the first
    left_operational: bool  # online, but an NMT command took it out of Operational
    phase: BootPhase  # how far it has booted
    phase_detail: str  # what it is doing in that phase, or why it failed
    # time since the last heartbeat in [s]; None when there was none or none is supervised
    heartbeat_age: float | None
    emergency: Emergency | None  # last EMCY that the device did not take back
    emergencies: tuple[str, ...]  # the last EMCYs with their age, the newest first, in words
    missed_pdos: int  # TPDOs that did not answer a SYNC
    sdo: SdoCounters  # what became of the SDO transfers


def node_status(node: RemoteNode, now: float) -> NodeStatus:
    """Return a snapshot of a device."""
    seen = node.config.heartbeat_timeout > 0 and node.life.last > 0
    return NodeStatus(
        name=node.name,
        node_id=node.config.node_id,
        online=node.online,
        nmt_state=node.nmt_state,
        left_operational=node.left_operational,
        phase=node.phase,
        phase_detail=node.phase_detail,
        heartbeat_age=now - node.life.last if seen else None,
        emergency=node.emergencies.last,
        emergencies=tuple(
            f'{now - time:.1f} s ago {emergency}'
            for time, emergency in reversed(node.emergencies.history)
        ),
        missed_pdos=node.pdos.missed,
        sdo=replace(node.sdo.counters),
    )
