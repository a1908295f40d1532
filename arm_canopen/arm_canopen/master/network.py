# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The CANopen network of one bus, as an object without threads, clock or I/O of its own.

Its owner hands it every received frame and the time, and starts its cycles; it sends through
a function. See ``runner.py`` for the thread that does so on a real bus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import datetime, timezone
from functools import partial
from traceback import walk_tb
from typing import TypeAlias

from canopen_core import BusError, CanopenError
from canopen_core.can import ControllerState, Frame
from canopen_core.standard import (
    ALL_NODES,
    CAN_ID_MASK,
    CobId,
    COMMANDED_STATES,
    encode_time_of_day,
    nmt_addressee,
    NmtCommand,
    NmtState,
    Number,
    object_address,
    parse_nmt,
)

from ..config.model import BusConfig
from .boot import BootManager, Startup
from .events import Event, EventKind, Report, Severity
from .frame_sender import BusSender, ControllerWatch, NmtSender, PeriodicFrame
from .other_master import OtherMasterWatch
from .process_image import SentRpdo, SyncRound
from .remote_node import RemoteNode
from .scheduler import completed, Promise, Scheduler
from .sdo_client import SdoClient

DEFECT_PERIOD = 10.0  # [s] between two reports of the same defect
NEVER = float('inf')
UPDATE_SHARE = 0.5  # share of the period after SYNC at which missing TPDOs are no longer awaited
WATCH_PERIOD = 0.005  # [s] between two checks of life signs, their shortest period

CycleHook: TypeAlias = Callable[[float, float], None]


class Network:
    """Master of one bus: boots and supervises its devices, and runs the SYNC cycle."""

    def __init__(
        self,
        config: BusConfig,
        send: Callable[[Frame], None],
        report: Report,
        wall_clock: Callable[[], datetime] = lambda: datetime.now(timezone.utc),
        *,
        beside_master: bool = False,
    ) -> None:
        """Nothing is sent before :meth:`start`; ``send`` may raise BusError.

        With ``beside_master`` another master runs other devices on this bus, so no NMT command is
        sent to all nodes.
        """
        master = config.master
        self.config = config  # the bus
        self.scheduler = Scheduler()  # time and coroutines of the network
        self.scheduler.on_defect = self._report_defect
        # called in each cycle before the RPDOs are sent, with time and period in [s]
        self.on_cycle: CycleHook = lambda now, period: None
        # called after each update, with the time of the SYNC in [s] whose TPDOs the drives have
        # taken
        self.on_feedback: Callable[[float], None] = lambda sync_time: None
        # called with each received frame, for statistics
        self.on_frame: Callable[[Frame], None] = lambda frame: None
        self.controller = ControllerWatch(report)  # the CAN controller as its error frames show it
        self.unknown_frames = 0  # frames with an identifier that no device on this bus should use
        # sends a frame; reports a bus that refuses it once, until it works again
        self.send = BusSender(send, report).send
        self._report = report
        # NMT state of the master; only in Operational it sends SYNC and RPDOs
        self.state = NmtState.OPERATIONAL if master.start else NmtState.PRE_OPERATIONAL
        # time at which :meth:`update` is due in [s]; infinite once it is done in this cycle
        self.next_update = NEVER
        self._sync = SyncRound(self._round_complete, master.sync_window, master.sync_period)
        self._sync_time = 0.0
        self._feedback_due = self._round_open = False
        self._watch_at = 0.0
        self._defects: dict[object, float] = {}  # time of the next report, by place in the code
        self._pauses: list[float] = []  # delays since the last report
        self._pause_reported = -NEVER
        self._sync_count = 0
        # sent with the set-points, so that both stop together
        self._heartbeat = PeriodicFrame(
            CobId.HEARTBEAT + master.node_id,
            master.heartbeat_producer,
            lambda: bytes((self.state,)),
            self.send,
        )
        self._time = PeriodicFrame(  # CiA 301, 7.2.6
            master.time_cob_id & CAN_ID_MASK,
            master.time_period,
            lambda: encode_time_of_day(wall_clock()),
            self.send,
        )
        self._broadcasts = not beside_master
        self._nmt = NmtSender(self.scheduler, self.send, master.nmt_inhibit_time, self._note_nmt)
        # its devices by name
        self.nodes = {
            node.name: RemoteNode(node, self.scheduler, self._sync, self.send, report)
            for node in config.nodes
        }
        nodes = list(self.nodes.values())
        for node in nodes:
            node.send_nmt = partial(self.send_nmt, node_id=node.config.node_id)
        self._startup = Startup(
            master, nodes, self.scheduler, self.send_nmt, report, command_nmt=self.command_nmt
        )
        self._boots = BootManager(
            config, nodes, self.scheduler, self._startup, send=self.send, send_nmt=self.send_nmt
        )
        # called with a device whose life signs are missing; boots it again
        self.on_node_lost: Callable[[RemoteNode], None] = self._boots.start
        self._unconfigured_clients: dict[int, SdoClient] = {}
        self._handlers: dict[int, Callable[[Frame], None]] = {}
        for cob_id, take in self._connect(
            OtherMasterWatch(config, report, expected=beside_master)
        ):
            self._handlers.setdefault(cob_id, take)  # devices must not override NMT and SYNC

    def start(self, now: float) -> None:
        """Reset the devices and start to boot all of them concurrently."""
        self.scheduler.advance(now)
        nodes = list(self.nodes.values())
        self.scheduler.background(self._startup.watch())
        resets = [node.config.reset_communication and node.config.boot for node in nodes]
        if all(resets):
            self.send_nmt(NmtCommand.RESET_COMMUNICATION, ALL_NODES)
        for node, reset in zip(nodes, resets, strict=True):
            if all(resets) or not reset:
                self._boots.start(node, was_reset=reset)
                continue
            sent = self.send_nmt(NmtCommand.RESET_COMMUNICATION, node.config.node_id)
            sent.when_done(
                lambda _, node=node: self._boots.start(node, was_reset=True)  # type: ignore[misc]
            )

    def receive(self, frame: Frame) -> None:
        """Process a frame from the bus."""
        self.on_frame(frame)
        self.scheduler.set_time(frame.timestamp)
        if frame.is_error:
            self.controller.receive(frame)
            return
        if self.controller.state is ControllerState.BUS_OFF:
            self.controller.receive_data()
        handler = self._handlers.get(frame.can_id)
        if handler is None or frame.is_extended or frame.is_remote:
            self.unknown_frames += 1
            return
        handler(frame)

    def advance(self, now: float) -> None:
        """Advance the time: run timers and conditions, check for overdue heartbeats."""
        self._contain(partial(self.scheduler.advance, now))
        if now < self._watch_at:
            return
        self._watch_at = now + WATCH_PERIOD
        self._contain_each(partial(self._watch, now))

    def _watch(self, now: float, node: RemoteNode) -> None:
        if node.watch(now):
            self.on_node_lost(node)

    def sync(self) -> None:
        """Send SYNC at its deadline, before any work that takes time."""
        if self._syncs:
            overflow = self.config.master.sync_overflow
            if not overflow:
                self.send(Frame(CobId.SYNC))
                return
            self._sync_count = self._sync_count % overflow + 1  # CiA 301, 7.2.5.2.2
            self.send(Frame(CobId.SYNC, bytes((self._sync_count,))))

    def cycle(self, now: float, period: float) -> None:
        """Begin the cycle whose SYNC has just been sent."""
        if self._round_open and self._sync.pending:
            self._contain_each(lambda node: node.pdos.count_missed())
        self._round_open = self._syncs
        overdue = self.next_update < NEVER
        self.next_update = now
        if self._syncs:
            self._sync.start(now)
            self._contain_each(lambda node: node.expect_answers())
            self._feedback_due = True
            if not overdue:  # TPDOs of an overdue update belong to the previous SYNC
                self._sync_time = now
                if self._sync.pending:
                    self.next_update = now + UPDATE_SHARE * period
        self.advance(now)
        self._contain(partial(self._time.advance, now))

    def update(self, now: float, period: float) -> None:
        """Run drives and motion sources, and send the RPDOs that the next SYNC activates.

        Due at :attr:`next_update`: when all TPDOs of the SYNC have arrived, or at the latest half
        a period after SYNC. The heartbeat is sent here, so that devices stop by themselves when
        their set-points are no longer updated.
        """
        self.next_update = NEVER
        updated = self._contain(partial(self.on_cycle, now, period))
        if self.state is NmtState.OPERATIONAL:
            for node in self.nodes.values():
                if node.online:
                    self._send_outputs(node, now)
        if self._feedback_due:
            self._feedback_due = False
            self._contain(partial(self.on_feedback, self._sync_time))
        if updated:
            self._contain(partial(self._heartbeat.advance, now))

    @property
    def _syncs(self) -> bool:
        """Whether SYNC is sent."""
        return self.state is NmtState.OPERATIONAL and self.config.master.sync_period > 0

    def _send_outputs(self, node: RemoteNode, now: float) -> None:
        for output in node.image.rpdos:
            try:
                if not output.leaves(now):
                    continue
                refusal = self.send(output.frame())
                if refusal is None and not output.cyclic:  # else it stays due
                    output.left(now)
            except Exception as error:  # noqa: BLE001
                output.due = False
                node.fail(error, output)

    def _contain(self, step: Callable[[], object]) -> bool:
        """Run a step of the cycle; report its exception and return False, so others still run."""
        try:
            step()
        except Exception as error:  # noqa: BLE001
            self._report_defect(error)
            return False
        return True

    def _contain_each(self, step: Callable[[RemoteNode], object]) -> None:
        """Run a step for each device; stop a device for which it fails, the others continue."""
        for node in self.nodes.values():
            try:
                step(node)
            except Exception as error:  # noqa: BLE001, PERF203
                node.fail(error)

    def send_nmt(self, command: NmtCommand, node_id: int) -> Promise[None]:
        """Send an NMT command to one device, to all with id 0, or to the master with its own id.

        A master that is not operational sends neither SYNC nor RPDOs.

        Returns:
            Done when the bus has accepted the command, rejected with a BusError if it refuses it.
            Abandoning the promise before cancels the command.
        """
        if node_id == self.config.master.node_id:
            self._set_state(command)
            return completed()
        if node_id == ALL_NODES and not self._broadcasts:
            each = [self._nmt.send(command, n.config.node_id) for n in self.nodes.values()]
            return self.scheduler.spawn(self._all(each))
        return self._nmt.send(command, node_id)

    async def command_nmt(self, command: NmtCommand, node_id: int) -> str:
        """Send an NMT command of a client, see :meth:`send_nmt`; return a report in words.

        Moving axes that the command would take from the master are brought to rest first; axes not
        confirmed at rest are reported, too.

        Raises:
            BusError: The bus has refused the command.
        """
        unseen: list[str] = []
        if command is not NmtCommand.START:
            everyone = node_id in (ALL_NODES, self.config.master.node_id)
            led = {
                node.name: node.bring_to_rest(
                    f'NMT {command.name} was commanded', Severity.WARNING
                )
                for node in self.nodes.values()
                if node.operational and (everyone or node.config.node_id == node_id)
            }
            ends = zip(led, await self.scheduler.gather(list(led.values())), strict=True)
            unseen = [name for name, seen in ends if not all(seen)]
        await self.send_nmt(command, node_id)
        answer = f'NMT {command.name} sent to {nmt_addressee(node_id)}'
        if unseen:
            answer += f'; not seen to stand before: {", ".join(unseen)}'
            self._report(Event(EventKind.BUS, Severity.WARNING, '', answer))
        return answer

    async def _all(self, sent: Sequence[Promise[None]]) -> None:
        await self.scheduler.gather(sent)

    def publish_objects(self, node: RemoteNode, values: Mapping[tuple[int, int], Number]) -> None:
        """Write objects and send the RPDOs that carry them, each RPDO once.

        An event-driven RPDO is sent at once, a synchronous one with the next cycle; the RPDOs of a
        drive are sent in every cycle anyway.

        Raises:
            CanopenError: The device or the master is not operational, no RPDO carries one of
                them, or the bus refuses it; the text names the RPDOs sent before.
        """
        if not node.operational or self.state is not NmtState.OPERATIONAL:
            what = 'the master' if node.operational else node.name
            raise CanopenError(f'{what} is not operational, so no RPDO is sent')
        before = {address: node.image.commanded(*address) for address in values}
        for address, value in before.items():
            if value is None:
                raise CanopenError(f'{object_address(*address)} is in no RPDO of {node.name}')
        outputs = {
            id(output): output
            for address, value in values.items()
            for output in node.image.store(*address, value)
        }
        waiting = [each for each in outputs.values() if each.cyclic or each.synchronous]
        sent = [each for each in outputs.values() if each not in waiting]
        for number, output in enumerate(sent):
            refusal = self.send(output.frame())
            if refusal is not None:
                raise self._taken_back(node, before, sent[:number], refusal)
            output.left(self.scheduler.now)
        for output in waiting:
            output.due = True

    @staticmethod
    def _taken_back(
        node: RemoteNode,
        before: Mapping[tuple[int, int], Number | None],
        sent: Sequence[SentRpdo],
        refusal: BusError,
    ) -> BusError:
        """Restore unsent values, so that they are not sent later; return the error to raise."""
        left = {(each.index, each.subindex) for output in sent for each in output.config.mapping}
        for address, value in before.items():
            if address not in left:
                node.image.store(*address, value or 0)
        numbers = ', '.join(str(output.config.number) for output in sent)
        return BusError(f'RPDO {numbers} was sent, the rest not: {refusal}') if sent else refusal

    def _set_state(self, command: NmtCommand) -> None:
        before = self.state
        self.state = COMMANDED_STATES.get(command, NmtState.OPERATIONAL)
        if before is NmtState.STOPPED:
            self._sync_count = 0  # CiA 301, 7.2.5.2.2: it begins with 1 again
        if self.state is not before:
            sends = 'sends' if self.state is NmtState.OPERATIONAL else 'sends no'
            text = f'the master is in NMT state {self.state.name}: it {sends} SYNC and RPDOs'
            self._report(Event(EventKind.BUS, Severity.INFO, '', text))

    def sdo_client(self, node_id: int) -> SdoClient:
        """Return the SDO client of a node id, even if bus.yml does not name it."""
        for node in self.nodes.values():
            if node.config.node_id == node_id:
                return node.sdo
        client = self._unconfigured_clients.get(node_id)
        if client is None:
            client = SdoClient(node_id, f'node {node_id}', self.scheduler, self.send)
            self._unconfigured_clients[node_id] = client
            self._handlers[CobId.SDO_RESPONSE + node_id] = client.receive
        return client

    @property
    def pending_pdos(self) -> int:
        """Number of TPDOs of the last SYNC that :meth:`update` still waits for."""
        return self._sync.pending if self.next_update < NEVER else 0

    @property
    def missed_pdos(self) -> int:
        """Number of TPDOs that did not answer a SYNC, over all devices."""
        return sum(node.pdos.missed for node in self.nodes.values())

    @property
    def late_pdos(self) -> int:
        """Number of TPDOs that answered a SYNC after the synchronous window."""
        return self._sync.late

    def _report_defect(self, error: BaseException) -> None:
        # keyed by place of origin, as the values in its text may differ each time
        place = tuple((frame.f_code, line) for frame, line in walk_tb(error.__traceback__))
        if self.scheduler.now < self._defects.get(place, 0.0):
            return
        self._defects[place] = self.scheduler.now + DEFECT_PERIOD
        text = f'a defect in the CANopen master: {type(error).__name__}: {error}'
        self._report(Event(EventKind.BUS, Severity.ERROR, '', text))

    def _connect(
        self, other_master: OtherMasterWatch
    ) -> Iterator[tuple[int, Callable[[Frame], None]]]:
        """Map each COB-ID to its handler."""
        yield CobId.NMT, self._receive_nmt
        yield CobId.HEARTBEAT + self.config.master.node_id, other_master.receive
        yield CobId.SYNC, other_master.receive
        for node in self.nodes.values():
            node_id = node.config.node_id
            yield CobId.HEARTBEAT + node_id, node.receive_heartbeat
            yield CobId.SDO_RESPONSE + node_id, node.sdo.receive
            yield CobId.SDO_REQUEST + node_id, node.sdo.receive_request
            for entry in node.image.tpdos:
                yield entry.config.cob_id, entry.receive
            if node.config.emergency_id is not None:
                yield node.config.emergency_id, node.emergencies.receive

    def _receive_nmt(self, frame: Frame) -> None:
        """Record NMT commands of another master or tool, so as not to counteract them."""
        parsed = parse_nmt(frame.data)
        if parsed is not None:
            self._note_nmt(*parsed)

    def note_pause(self, late: float, now: float) -> None:
        """Report a cycle that is ``late`` in [s], before its consequences show.

        Reports on a busy computer are rate-limited and include the delays since the last. Missing
        TPDOs that no SYNC requested are not counted against devices.
        """
        for node in self.nodes.values():
            node.pdos.excuse(late)
        watched = self.config.master.heartbeat_timeout
        if now - self._pause_reported < DEFECT_PERIOD and not 0 < watched < late:
            self._pauses.append(late)
            return
        text = f'the cycle was held up for {late * 1000:.0f} ms by this computer'
        if self._pauses:
            longest = max(self._pauses) * 1000
            text += f', and {len(self._pauses)} times before, for {longest:.0f} ms at most'
        self._pause_reported = now
        self._pauses.clear()
        if 0 < watched < late:
            text += (
                f'; devices that wait {watched * 1000:.0f} ms for the heartbeat of the master '
                'have taken it for dead'
            )
        self._report(Event(EventKind.CYCLE, Severity.WARNING, '', text))

    def _note_nmt(self, command: NmtCommand, node_id: int) -> None:
        for node in self.nodes.values():
            if node_id in (ALL_NODES, node.config.node_id):
                node.note_command(command)

    def _round_complete(self) -> None:
        """Make the update due now, unless this cycle has already done it."""
        if self.next_update < NEVER:
            self.next_update = self.scheduler.now
