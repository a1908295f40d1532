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

START_TIME = 0.25  # [s] for a device to follow the NMT start command
LIVE_SHARE = 0.5  # share of the heartbeat consumer time in which a TPDO proves it alive
RESET_TIME = 10.0  # [s] until a device that was reset sends its boot-up message
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 30.0  # [s] before a lost device is booted again
STABLE_TIME = 10.0  # [s] in operation after which the count of losses restarts


LeadToRest: TypeAlias = Callable[[str, Severity], Coroutine[Promise[Any], None, bool]]


class BootPhase(Enum):
    """Progress of the boot of a device; the value is the text for the user."""

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
    """One device on the bus, as the master sees it."""

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
        # commanded state if it has no heartbeat or guarding, or is commanded out of Operational
        self.nmt_state: NmtState | None = None
        self.phase = BootPhase.WAITING  # progress of its boot
        self.phase_detail = ''  # current step of that phase, or why it failed
        # online, but another node stopped it or sent it to pre-operational
        self.left_operational = False
        # last NMT state commanded by any node on this bus; None if unknown
        self.wanted: NmtState | None = None
        # it was already operational when it came online, and was not disturbed since
        self.taken_over = False
        self.watch_slot = 0  # its entry of 0x1016 for the master, 0 for none
        self.loss = ''  # reason of the last loss, empty while it is online
        self.life = LifeSigns(config, send)  # its heartbeat, or its answers to node guarding
        self.emergencies = EmergencyLog(self.report)  # its EMCYs
        self.pdos = PdoWatch(self.image.tpdos, self.report)  # supervision of its TPDOs
        # sends it an NMT command
        self.send_nmt: Callable[[NmtCommand], object] = lambda command: None
        self.on_boot_up: Callable[[], None] = lambda: None  # called when it has restarted
        # its drivers, which stop; each gets the reason
        self.on_lost: list[Callable[[str], None]] = []
        # called when it is lost, other than by an NMT command
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
        self._drops = 0  # consecutive losses
        self._booted_at = 0.0
        self._commanded: NmtCommand | None = None
        self._commanded_at = 0.0

    @property
    def operational(self) -> bool:
        """Whether it is online and not commanded out of Operational."""
        return self.online and not self.left_operational

    @property
    def was_booted(self) -> bool:
        """Whether this master booted it, so that this master's commands may move its axes."""
        return self.online or bool(self.loss)

    @property
    def left_by_itself(self) -> bool:
        """Whether no NMT command explains its present state."""
        return not self._being_reset and self.wanted in {None, NmtState.OPERATIONAL}

    @property
    def phase_text(self) -> str:
        """Progress of its boot, in words."""
        return f'{self.phase.value} {self.phase_detail}'.rstrip()

    def report(self, kind: EventKind, severity: Severity, text: str) -> None:
        """Report something about this device to the owner of the network."""
        self._report(Event(kind, severity, self.name, text))

    def expect_answers(self) -> None:
        """Expect the TPDOs that answer each SYNC; call it before a SYNC is sent."""
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
        """Process an NMT command for this device, from this master or another node."""
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
            self.image.clear()  # values received after it was commanded out of Operational
            self.left_operational = False

    def _commanded_away(self, state: NmtState) -> None:
        """React at once to a command to leave Operational, before its next life sign."""
        now = self._scheduler.now
        if self.life.missed and self._lives(now):
            self.life.start(now)  # its TPDOs, which proved it alive, end now
        self._nmt_state_changed(state, ran=True)

    def go_online(self, now: float, *, taken_over: bool = False) -> None:
        """Mark the booted device online, and expect its first life sign from ``now`` in [s] on.

        A device that is ``taken_over`` was already operational, and was not disturbed.
        """
        self.taken_over = taken_over
        self.image.clear()  # values sent before its configuration are outdated
        self.online = True
        self._failed = False
        self._booted_at = now
        self.life.start(now)
        self.loss = ''
        if self.config.is_drive:
            self.pdos.warn_of_losses()

    def watch(self, now: float) -> bool:
        """Check for overdue life signs and PDOs; return whether the device was lost now."""
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
        """Return whether its TPDOs prove it operational although a life sign is missing."""
        recent = now - self.pdos.last <= LIVE_SHARE * self.life.consumer_time
        return recent and self.operational and not self.life.silent

    def _miss(self, missing: str, now: float) -> None:
        """Bring a device to rest before it counts as lost, as it would coast otherwise.

        This begins when two consecutive life signs are missing while TPDOs arrive. The device is
        lost then, even if a life sign arrives again: its drives have no power any more.
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
        """Bring all its axes to rest; the promise returns for each whether it was confirmed."""
        ends = [self._scheduler.spawn(lead(reason, severity)) for lead in self.lead_to_rest]
        return self._scheduler.spawn(self._scheduler.gather(ends))

    def fail(self, error: Exception, output: SentRpdo | None = None) -> None:
        """Stop its drivers, because a step of the cycle failed, or ``output`` cannot be sent.

        Other devices continue.
        """
        for driver_fails in self.on_failed:
            driver_fails(error, output)
        if not self.on_failed and not self._failed:
            self._failed = True  # once for each boot, as the text may be another one each time
            text = f'{type(error).__name__}: {error}'
            self.report(EventKind.PDO, Severity.ERROR, f'its part of the cycle failed: {text}')

    def restarted(self) -> None:
        """Handle its boot-up message: the device is lost, or stays offline."""
        self.sdo.restarted()
        if self.online:
            self.lost('restarted: a boot-up message came while it was operational')
        else:
            self.offline('the device restarted')

    def lost(self, reason: str) -> None:
        """Handle the loss of the device: forget its values and stop its drivers."""
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
        """Stop communication with the device until it is booted again."""
        self.online = False
        self.left_operational = False
        self.life.stop()
        self.pdos.stop()
        self.objects.forget(reason)

    async def unwatch(self) -> None:
        """Disable the supervision of the master by the device, before it ends; never raises."""
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
        """Whether it never sends its NMT state, so the commanded state is assumed."""
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
        """Handle a new NMT state, received or commanded; ``ran``: it was Operational before."""
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
        self.taken_over = False  # this master commands it from now on
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
    phase: BootPhase  # progress of its boot
    phase_detail: str  # current step of that phase, or why it failed
    # time since the last heartbeat in [s]; None before the first or without supervision
    heartbeat_age: float | None
    emergency: Emergency | None  # last EMCY that was not reset
    emergencies: tuple[str, ...]  # the last EMCYs in words with their age, newest first
    missed_pdos: int  # TPDOs that did not answer a SYNC
    sdo: SdoCounters  # results of the SDO transfers


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
