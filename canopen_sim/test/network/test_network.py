# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bus in operation: signs of life, NMT, EMCY, SYNC, TIME, another master, a sick bus."""

from __future__ import annotations

from collections import Counter
from concurrent.futures import Future
from dataclasses import replace
from datetime import datetime, timezone
import itertools
from itertools import pairwise
import re

from bus_rig import booted, Sent, START, VirtualNetwork
from drive_samples import bus_config, drive_config, pdo, PERIOD, sdo_write, with_defaults
import pytest

from arm_canopen import (
    BusError,
    CanopenMaster,
    CodecError,
    EventKind,
    MasterFrames,
    NodeConfig,
    OtherMasterError,
    SdoAbortError,
    SdoTimeoutError,
    Severity,
)
from arm_canopen.master.life_signs import EmergencyLog
from arm_canopen.master.network import Network, NEVER, UPDATE_SHARE
from arm_canopen.master.other_master import (
    CATCH_UP_MAX,
    describe,
    listen,
    LISTENING_TIME,
    refuse_other_master,
)
from arm_canopen.master.remote_node import node_status, RESET_TIME
from arm_canopen.master.runner import Clock
from canopen_core.can import Frame, VirtualBus, VirtualWire
from canopen_core.standard import (
    CobId,
    DataType,
    decode_time_of_day,
    Emergency,
    encode_time_of_day,
    nmt_frame,
    NmtCommand,
    NmtState,
    ObjectDictionary,
    ObjectEntry,
    RESETS,
)
from canopen_sim import Fault, FaultInjection

pytestmark = pytest.mark.slow

SYNC, EMCY, HEARTBEAT = 0x080, 0x080, 0x700
CONSUMER_TIME = 0.3  # [s] of the sample drives


def network(*names: str, **master: object) -> VirtualNetwork:
    """Return a network of drives with node ids from 2 on."""
    nodes = [drive_config(name, 2 + n) for n, name in enumerate(names or ('a', 'b'))]
    return VirtualNetwork(bus_config(*nodes, **master))


def events(net: VirtualNetwork, kind: EventKind, node: str = '') -> list[str]:
    """Return what was reported of a kind, of one device or of all."""
    return [e.text for e in net.events if e.kind is kind and node in ('', e.node)]


def test_a_lost_heartbeat_is_reported_within_the_consumer_time() -> None:
    """Each device by its name, not before its time and at the next look after it.

    The age of a heartbeat grows while nothing comes.
    """
    net = network('a', 'b', 'c')
    net.boot()
    net.run(0.5)
    begin = net.now
    net.power_off('a')
    net.power_off('c')
    lost_at: dict[str, float] = {}

    def note() -> bool:
        for name, node in net.network.nodes.items():
            if not node.online:
                lost_at.setdefault(name, net.now)
        return len(lost_at) == 2

    net.run_until(note)
    assert set(lost_at) == {'a', 'c'}
    for name, moment in lost_at.items():
        silent_since = net.network.nodes[name].life.last
        assert silent_since <= begin
        assert CONSUMER_TIME < moment - silent_since <= CONSUMER_TIME + PERIOD
        assert '300 ms' in events(net, EventKind.HEARTBEAT_LOST, name)[0]
    assert net.network.nodes['b'].online
    status = node_status(net.network.nodes['a'], net.now)
    assert not status.online
    assert status.nmt_state is None
    age, later = (node_status(net.network.nodes['b'], net.now + t).heartbeat_age for t in (0, 0.2))
    assert age is not None
    assert 0.0 <= age <= 0.1 + PERIOD
    assert later == pytest.approx(age + 0.2)


def test_emergencies_are_reported_in_words_until_they_end() -> None:
    """The last one is kept until the device takes it back, or restarts; odd ones are reported.

    One that is over or old is no error of now.
    """
    net = network()
    net.boot()
    log = net.network.nodes['a'].emergencies

    def send(*texts: str) -> tuple[int | None, int | None]:
        """Send EMCYs of a device; return the last one, and the one of now."""
        for text in texts:
            net.send_as('a', Frame(EMCY + 2, bytes.fromhex(text)))
        begin = net.now
        net.run(0.01)
        found = log.last, log.since(begin)
        last, now = (emcy.code if emcy else None for emcy in found)
        return last, now

    drive_hot, nothing_left = '20 43 09 01 02 03 04 05', '00' * 8
    assert send('10 82 11 00 00 00 00 00', drive_hot) == (0x4320, 0x4320)
    assert send() == (0x4320, None)
    assert send('10') == (0x4320, None)
    assert send('00 00 11 00 00 00 00 00') == (0x4320, None)
    for text, words in zip(
        events(net, EventKind.EMERGENCY, 'a'),
        (
            '0x8210 PDO not processed, length error',
            '0x4320 too low drive temperature',
            *('odd EMCY', 'others remain'),
        ),
        strict=True,
    ):
        assert words in text
    assert send(nothing_left) == (None, None)
    assert send(drive_hot) == (0x4320, 0x4320)
    net.power_off('a')
    net.power_on('a')
    net.run(0.2)
    assert log.last is None


def test_a_state_that_somebody_commanded_is_left_alone() -> None:
    """The master warns, but does not start what a service or a tool on the bus has stopped.

    A state is reported when it changes, not with each heartbeat.
    """
    net = network('a')
    net.boot()
    node = net.network.nodes['a']
    stops = (NmtCommand.STOP, NmtCommand.ENTER_PRE_OPERATIONAL)
    for command, ours in itertools.product(stops, (True, False)):
        net.run(0.5)
        assert events(net, EventKind.NMT_STATE)[-1] == 'NMT state OPERATIONAL'
        net.events.clear()
        if ours:
            net.network.send_nmt(command, 2)
        else:
            net.send_as('tool', Frame(0, nmt_frame(command, 2)))
        net.run(3.0)
        assert node.left_operational
        assert node.nmt_state is not None
        stopped = f'NMT state {node.nmt_state.name}'
        assert stopped in str(net.reported(Severity.WARNING)), (command, ours)
        assert 'by itself' not in net.story()
        net.send_as('tool', Frame(0, nmt_frame(NmtCommand.START)))
        net.run(0.5)
        assert node.operational
        assert events(net, EventKind.NMT_STATE) == [stopped, 'NMT state OPERATIONAL']


def test_sync_counts_as_the_standard_says() -> None:
    """With an overflow value from 1 to it, without one no data (CiA 301, 7.2.5).

    It begins anew where its producer leaves Stopped, and nowhere else.
    """
    for overflow in (0, 5):
        counters = [bytes((n % 5 + 1,)) if overflow else b'' for n in range(8)]
        net = network(sync_overflow=overflow)
        net.start()
        net.run(7.5 * PERIOD)
        assert net.frames(SYNC) == counters
        leaves = (NmtCommand.STOP, counters[:2]), (NmtCommand.ENTER_PRE_OPERATIONAL, counters[:4])
        for command, anew in leaves:
            for each in (command, NmtCommand.START):
                net.network.send_nmt(each, net.network.config.master.node_id)
            net.run(2 * PERIOD)
            assert net.frames(SYNC) == counters + anew


def test_without_sync_the_cycle_goes_on() -> None:
    """A bus without sync_period gets its RPDOs, and no SYNC."""
    net = VirtualNetwork(
        bus_config(
            drive_config(
                'a', 2, tpdos=(pdo(1, 0x182, (0x6041, 0), (0x6061, 0), transmission=255),)
            ),
            sync_period=0.0,
        )
    )
    net.start()
    net.run(0.5)
    assert net.frames(SYNC) == []
    assert len(net.frames(0x202)) > 20
    assert net.feedback_times == []


def test_missed_pdos_are_counted_and_hold_nothing_up() -> None:
    """Each lost TPDO counts once for its device; the drives wait half a period for it."""
    net = network('a', 'b')
    net.boot()
    net.run(0.1)
    assert net.network.missed_pdos == 0
    net.feedback_times.clear()
    net.lose(0x283)
    net.run(10 * PERIOD)
    net.lose()
    net.run(2 * PERIOD)
    nodes = net.network.nodes
    assert (nodes['a'].pdos.missed, nodes['b'].pdos.missed) == (0, 10)
    assert net.network.missed_pdos == 10
    assert len(net.feedback_times) == 12
    late = [moment - sync for moment, sync in net.feedback_times[1:9]]
    assert late == pytest.approx([UPDATE_SHARE * PERIOD] * len(late))
    before = net.network.missed_pdos
    net.power_off('a')  # only a device that should answer can miss to
    net.power_on('a')
    net.run(0.5)
    net.run_until(net.all_ready)
    assert net.network.missed_pdos <= before + 2  # those of the cycle in which it restarted
    before = net.network.missed_pdos
    net.network.send_nmt(NmtCommand.RESET_NODE, 3)
    net.run(1.0)
    assert net.network.missed_pdos <= before + 2


def test_a_device_that_babbles_while_it_is_lost_is_not_waited_for() -> None:
    """PDOs of one whose heartbeat is lost are no answers, and its values are not used."""
    net = network('a', 'b')
    net.boot()
    net.wire.loses = lambda sender, frame: sender == 'a' and frame.can_id in (0x702, 0x582)
    net.run(1.0)
    node = net.network.nodes['a']
    assert not node.online
    assert net.frames(0x182, since=net.now - 0.1), 'the device should go on with its PDOs'
    missed = net.network.missed_pdos
    net.power_off('a')
    net.run(1.0)
    assert net.network.missed_pdos == missed
    net.power_on('a')
    net.lose()
    net.run_until(lambda: node.online)
    assert node.image.tpdos[0].values is None


def test_the_masters_heartbeat_comes_from_the_cycle() -> None:
    """At its period while the cycle runs, not at all while it hangs, and one after a pause."""
    net = network(heartbeat_producer=0.1)
    net.start()
    net.run(1.0)
    own = [s for s in net.wire.log if s.frame.can_id == HEARTBEAT + 1]
    assert [s.frame.data for s in own] == [bytes((NmtState.OPERATIONAL,))] * len(own)
    gaps = [b.time - a.time for a, b in pairwise(own)]
    assert len(own) in (10, 11)
    assert gaps == pytest.approx([0.1] * len(gaps), abs=PERIOD)
    for _ in range(100):
        net.network.advance(net.now + 1.0)
    assert len(net.frames(HEARTBEAT + 1)) == len(own)
    net.now += 0.37  # nothing of the master runs
    begin = net.now
    net.run(0.25)
    after = [s.time for s in net.wire.log if s.frame.can_id == HEARTBEAT + 1 and s.time >= begin]
    assert len(after) == 3
    assert min(b - a for a, b in pairwise(after)) > 0.1 - 1.5 * PERIOD


@pytest.mark.parametrize('broken', ['update', 'on_cycle'])
def test_no_heartbeat_vouches_for_set_points_that_nobody_updates(
    broken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SYNC goes on, and devices that watch the master find it dead."""
    net = network('a', heartbeat_producer=0.1)
    net.boot()
    net.allows_defects = True

    def starve(now: float, period: float) -> None:
        net.network.next_update = NEVER
        if broken == 'on_cycle':
            raise ZeroDivisionError

    monkeypatch.setattr(net.network, broken, starve)
    begin = net.now
    net.run(1.0)
    assert len(net.frames(0x080, since=begin)) == pytest.approx(1.0 / PERIOD, abs=2)
    assert net.frames(HEARTBEAT + 1, since=begin) == []


def test_feedback_of_an_overdue_update_is_stamped_with_the_sync_that_it_answered() -> None:
    """The one before, as the answers to the new one have not come yet."""
    net = network('a')
    net.boot()
    stamps: list[float] = []
    net.network.on_feedback = stamps.append
    net.run_until(lambda: net.network.next_update == NEVER)
    first = net.now + PERIOD
    for time in (first, first + PERIOD):
        net.network.sync()
        net.network.cycle(time, PERIOD)
    net.network.update(first + PERIOD, PERIOD)
    assert stamps == [first]


@pytest.mark.parametrize('booted', [True, False], ids=['in operation', 'at the start'])
def test_a_bus_that_refuses_frames_is_reported_once_and_recovers(*, booted: bool) -> None:
    """The reason once, the recovery once; boots go on, and all is well in the end."""
    net = network()
    if booted:
        net.boot()
    net.wire.refuses = 'vcan0: transmit queue full'
    if not booted:
        net.start()
    net.run(3.0)
    assert events(net, EventKind.BUS) == ['vcan0: transmit queue full']
    net.wire.refuses = ''
    net.run_until(lambda: len(events(net, EventKind.BUS)) == 2, 1.0)
    assert 'takes frames again' in events(net, EventKind.BUS)[1]
    net.run_until(net.all_ready, 5.0)


def test_strange_frames_are_counted_and_passed_over() -> None:
    """Unknown identifiers, remote, extended and error frames reach nobody.

    A heartbeat of no state is no sign of life.
    """
    net = network()
    net.boot()
    node = net.network.nodes['a']
    count, unknown = node.image.tpdos[0].count, net.network.unknown_frames
    life = (node.life.last, node.nmt_state)
    for frame in (
        Frame(0x7FF, b'\0'),
        Frame(0x182, bytes(3), is_extended=True),
        Frame(0x182, b'', is_remote=True),
        Frame(0x182, bytes(8), is_error=True),
        *(Frame(0x702, data, net.now + 1.0) for data in (b'', b'\x05\x00', b'\x33')),
    ):
        net.network.receive(frame)
    assert node.image.tpdos[0].count == count
    assert net.network.unknown_frames == unknown + 3
    assert net.network.controller.error_frames == 1
    assert (node.life.last, node.nmt_state) == life


@pytest.mark.parametrize(
    ('kept', 'resets'), [('', [b'\x82\x00']), ('b', [b'\x82\x02', b'\x82\x04'])]
)
def test_all_are_reset_by_one_frame_but_those_that_shall_be_kept_alive(
    kept: str, resets: list[bytes]
) -> None:
    """With one of these among them, each of the others is reset by its id."""
    configs = [drive_config(name, 2 + n) for n, name in enumerate('abc')]
    nodes = [replace(each, reset_communication=each.name != kept) for each in configs]
    net = VirtualNetwork(bus_config(*nodes))
    net.network.start(net.now)
    assert [data for data in net.frames(0x000) if data[0] == 0x82] == resets


def test_unconfigured_devices_can_be_read_by_sdo() -> None:
    """A node id that bus.yml does not name has a client of its own; a known one has one only."""
    stranger = drive_config('c', 9)
    net = VirtualNetwork(bus_config(drive_config('a', 2), stranger))
    alone = VirtualNetwork(bus_config(drive_config('a', 2)))
    net.boot()
    alone.boot()
    alone.connect('c', net.devices['c'])
    net.devices['c']._sdo.default._send = lambda frame: alone.send_as('c', frame)
    client = alone.network.sdo_client(9)
    assert client is alone.network.sdo_client(9)
    assert alone.network.sdo_client(2) is alone.network.nodes['a'].sdo
    assert alone.result(client.read(0x1000, 0, 0.1)) == bytes.fromhex('92 01 02 00')
    with pytest.raises(SdoAbortError):
        alone.result(client.read(0x2FFF, 0, 0.1))
    with pytest.raises(SdoTimeoutError, match='node 99'):
        alone.result(alone.network.sdo_client(99).read(0x1000, 0, 0.1))


def test_a_time_out_that_begins_with_a_frame_counts_from_it() -> None:
    """A request sent in answer to a frame has its whole time, however long ago the last look."""
    net = network('a')
    net.boot()
    net.run(0.3)  # until nothing else waits
    node = net.network.nodes['a']
    begin = net.network.scheduler.now
    node.image.tpdos[0].listen(lambda entry: promises.append(node.sdo.write(0x2000, 0, b'', 0.02)))
    promises: list[object] = []
    net.network.receive(Frame(0x182, bytes(3), timestamp=begin + 0.5))
    assert len(promises) == 1
    assert net.network.scheduler.next_deadline() == pytest.approx(begin + 0.52)


def test_another_master_is_noticed() -> None:
    """It is said once what only the master of a bus sends."""
    net = network('a')
    net.boot()
    for frame, what in ((Frame(SYNC), 'SYNC'), (Frame(0x701, b'\x05'), 'the heartbeat 0x701')):
        net.events.clear()
        for _ in range(5):
            net.send_as('other_master', frame)
            net.run(0.01)
        errors = net.reported(Severity.ERROR)
        (said,) = [text for text in errors if 'another master is on this bus' in text]
        assert what in said


def test_a_device_that_does_not_answer_sync_is_reported_before_its_heartbeat_is_missed() -> None:
    """Once, and again when it falls silent again."""
    net = network('a')
    net.boot()
    net.run(0.2)
    for count in (1, 2):
        net.lose(0x182, 0x282)
        net.run(1.0)
        assert not net.drives['a'].view.fresh
        reported = [
            text for text in net.reported(Severity.WARNING) if 'has not answered SYNC' in text
        ]
        assert len(reported) == count
        net.lose()
        net.run(0.2)
        assert net.drives['a'].view.fresh


def test_pauses_of_a_busy_computer_are_summed_up() -> None:
    """A line for each would bury what matters: what devices took for the end of the master."""
    net = VirtualNetwork(bus_config(drive_config('a', 2), heartbeat_timeout=0.3))
    for number in range(50):
        net.network.note_pause(0.12 + number * 1e-3, 0.5 * number)
    lines = net.reported(Severity.WARNING)
    assert len(lines) == 3
    assert 'held up for 160 ms by this computer, and 19 times before, for 159 ms' in lines[-1]
    assert 'taken it for dead' not in str(lines)
    net.network.note_pause(0.6, 25.0)
    assert 'taken it for dead' in net.reported(Severity.WARNING)[-1]


CONTROLLER = 0x204  # a controller problem, with counters


def test_the_state_of_the_controller_is_reported_when_it_changes() -> None:
    """Error passive, bus off and the way back are said once each, with the counters."""
    net = network('a')
    net.boot()
    story = [
        (CONTROLLER, '00 08 00 00 00 00 60 00', 'error warning'),
        (CONTROLLER, '00 08 00 00 00 00 62 00', ''),
        (CONTROLLER, '00 20 00 00 00 00 80 05', 'error passive'),
        (0x240, '00 00 00 00 00 00 F8 05', 'bus off'),
        (0x300, '00 00 00 00 00 00 00 00', 'error active'),
    ]
    controller = net.network.controller
    for can_id, data, expected in story:
        before = len(net.reported(Severity.INFO))
        frame = Frame(can_id, bytes.fromhex(data), timestamp=net.now, is_error=True)
        net.network.receive(frame)
        reported = net.reported(Severity.INFO)[before:]
        assert [expected in text for text in reported] == [True] * bool(expected)
    assert (controller.error_frames, controller.transmit_errors) == (5, 0)
    assert 'controller restarted' in controller.last_error
    for _ in range(100):  # without anybody to acknowledge a frame it is sent over and over
        net.network.receive(Frame(0x020, bytes(8), timestamp=net.now, is_error=True))
    assert len([text for text in net.reported(Severity.WARNING) if 'acknowledges' in text]) == 1


PDOS = {0x180: 'tpdo', 0x280: 'tpdo', 0x200: 'rpdo', 0x300: 'rpdo', 0x400: 'rpdo'}


def test_feedback_and_rpdos_come_when_the_tpdos_of_the_sync_have_come() -> None:
    """SYNC, all TPDOs, feedback once, and then all RPDOs together, before the next SYNC."""
    net = network('a', 'b')
    net.boot()
    net.feedback_times.clear()
    net.run_until(lambda: bool(net.feedback_times))  # begin between two rounds
    net.feedback_times.clear()
    begin = net.now
    net.run(19.5 * PERIOD)
    pdos = {base + n: kind for n in (2, 3) for base, kind in PDOS.items()} | {SYNC: 'sync'}
    sent = [s for s in net.wire.log if s.time > begin and s.frame.can_id in pdos]
    kinds = [pdos[s.frame.can_id] for s in sent]
    cycle = ['sync', *['tpdo'] * 4, *['rpdo'] * 6]
    start = kinds.index('sync')
    assert kinds[start : start + 18 * len(cycle)] == 18 * cycle
    syncs = [s.time for s in sent if s.frame.can_id == SYNC]
    assert [b - a for a, b in pairwise(syncs)] == pytest.approx([PERIOD] * (len(syncs) - 1))
    assert [sync for _, sync in net.feedback_times] == pytest.approx(syncs)
    tpdos = [s.time for s, kind in zip(sent, kinds, strict=True) if kind == 'tpdo']
    for moment, sync in net.feedback_times:
        assert max(time for time in tpdos if time < sync + PERIOD) < moment < sync + PERIOD


GUARD_TIME = 0.05  # [s]


def guarded_config(**changes: object) -> NodeConfig:
    """Return a drive without heartbeat, whose state is requested."""
    own = {
        'heartbeat_producer': 0.0,
        'heartbeat_timeout': 0.0,
        'guard_time': GUARD_TIME,
        'life_time_factor': 4,
        'retry_factor': 3,
    }
    return replace(drive_config('a', 2), **{**own, **changes})  # type: ignore[arg-type]


def test_a_guarded_device_that_does_not_answer_is_lost_and_found() -> None:
    """Asked every guard time, lost after the retries, and booted again when it is back."""
    net = booted(guarded_config())
    net.run(1.0)
    node = net.network.nodes['a']
    assert node.online
    assert node.nmt_state is NmtState.OPERATIONAL
    questions = [sent.time for sent in net.wire.log if sent.frame.is_remote]
    assert len(questions) == pytest.approx(1.0 / GUARD_TIME, abs=3)
    assert net.reported(Severity.WARNING) == []
    net.power_off('a')
    begin = net.now
    net.run_until(lambda: not node.online)
    assert net.now - begin <= GUARD_TIME * 4 + 0.02
    assert 'no answer to node guarding 3 times' in str(net.reported(Severity.ERROR))
    net.power_on('a')
    net.run_until(lambda: node.online)
    net.alter(HEARTBEAT + 2, lambda data: bytes(byte & 0x7F for byte in data))
    net.events.clear()
    net.run(0.5)  # an answer without the toggle bit is an old one
    assert 'no answer to node guarding 3 times' in net.story()


def test_a_device_that_never_answers_guarding_is_reported_once_and_left_in_peace() -> None:
    """It is not booted again and again: it has to answer before it is configured again."""
    net = VirtualNetwork(bus_config(guarded_config()))
    node = net.network.nodes['a']
    deaf = {'a'}
    # RTR frames do not reach it, as in a controller that has no remote frames
    net.wire.loses = lambda sender, frame: frame.is_remote and bool(deaf)
    net.boot()
    net.run_until(lambda: not node.online)
    begin = net.now
    net.run(30.0)
    assert not node.online
    assert len(net.reported(Severity.WARNING)) == 2, net.reported(Severity.WARNING)
    assert 'no answer to node guarding 3 times' in net.reported(Severity.ERROR)[0]
    assert 'has never answered node guarding' in net.reported(Severity.WARNING)[-1]
    assert 'guard_time: 0' in net.reported(Severity.WARNING)[-1]
    assert net.frames(0x000, since=begin + 2.0).count(b'\x01\x02') == 0
    questions = [s for s in net.wire.log if s.frame.is_remote and s.time > begin + 2.0]
    assert len(questions) <= 28
    deaf.clear()
    net.run_until(lambda: node.online)
    net.run(2.0)
    assert node.online


def test_an_emergency_is_received_where_the_device_sends_it() -> None:
    """Under the identifier of 0x1014: as bus.yml writes it, else as the EDS has it.

    Where an EDS has no node id, or that of another, it is the one of the device, and never in the
    place of SYNC. A device keeps an identifier in use: EMCY and TIME are off while theirs changes.
    """
    written = drive_config('a', 2)
    time = ObjectEntry(0x1012, 0, 'TIME', DataType.UNSIGNED32, default=0x8000_0100)
    writes = (sdo_write(0x1014, 0, 0x0A2), sdo_write(0x1012, 0, 0x8000_0181))
    written = replace(
        written,
        dictionary=ObjectDictionary([*written.dictionary, time]),
        sdo_writes=(*written.sdo_writes, *writes),
    )
    eds = drive_config('b', 3)
    eds = replace(eds, dictionary=with_defaults(eds.dictionary, {(0x1014, 0): 0x0B3}))
    silent = drive_config('c', 4)
    silent = replace(silent, dictionary=with_defaults(silent.dictionary, {(0x1014, 0): 1 << 31}))
    nameless = drive_config('d', 5)
    without_id = with_defaults(nameless.dictionary, {(0x1014, 0): 0x80})
    nameless = replace(nameless, dictionary=without_id.for_node(5))
    foreign = drive_config('e', 6)
    of_another = with_defaults(foreign.dictionary, {(0x1014, 0): 0x91})
    foreign = replace(foreign, dictionary=of_another.for_node(6))
    net = VirtualNetwork(
        bus_config(written, eds, silent, nameless, foreign),
        dictionaries={'d': without_id, 'e': of_another},
    )
    net.boot()
    assert net.devices['a'].clock.can_id == 0x181
    for name in ('a', 'c', 'd', 'e'):
        net.devices[name].faults.inject(FaultInjection(Fault.OVER_TEMPERATURE), net.now)
    net.send_as('b', Frame(0x0B3, bytes.fromhex('10 43 01 00 00 00 00 00')))
    net.run(0.1)
    nodes = net.network.nodes.items()
    received = {name: [emcy.code for _, emcy in node.emergencies.history] for name, node in nodes}
    assert received == {name: [] if name == 'c' else [0x4310] for name in 'abcde'}
    assert [len(net.frames(can_id)) for can_id in (0x0A2, 0x085, 0x086)] == [1, 1, 1]
    net.network.receive(Frame(SYNC, b'', net.now))
    assert any('another node sends SYNC' in text for text in net.reported())
    assert len(net.network.nodes['d'].emergencies.history) == 1


def test_a_flood_of_emergencies_is_reported_once_with_its_number() -> None:
    """Others are reported at once meanwhile, and the same one again when the flood was over."""
    net = booted(drive_config('a', 2))
    device, node = net.devices['a'], net.network.nodes['a']
    flood = FaultInjection(Fault.EMCY_FLOOD, delay=0.01)

    def reported(severity: Severity) -> list[str]:
        found = (event for event in net.events if event.kind is EventKind.EMERGENCY)
        return [event.text for event in found if event.severity is severity]

    device.faults.inject(flood, net.now)
    net.run(5.0)
    assert [text[:12] for text in reported(Severity.ERROR)] == ['EMCY: 0x1000']
    assert device.drive is not None
    for code in (0x4310, 0x2310):
        device.drive.raise_fault(code, net.now)
    net.run(25.0)
    errors = ['EMCY: 0x1000', 'EMCY: 0x4310', 'EMCY: 0x2310']
    assert [text[:12] for text in reported(Severity.ERROR)] == errors
    counts = reported(Severity.WARNING)
    assert len(counts) == 2, counts
    assert re.match(r'EMCY: (9|1\d)\d\d more in 10 s \([45]\d\d x 0x\w{4} ', counts[0]), counts
    assert len(node.emergencies.history) == len(errors)
    assert len(node_status(node, net.now).emergencies) == len(node.emergencies.history)

    device.faults.end(net.now)
    net.run(15.0)
    last = reported(Severity.WARNING)[2:]
    assert len(last) == 1
    device.faults.inject(flood, net.now)
    net.run(0.1)
    assert len(reported(Severity.ERROR)) == len(errors) + 1


def test_a_flood_that_alternates_or_counts_is_a_flood() -> None:
    """An error that comes and goes, vendor bytes that differ each time, frames that are cut."""
    reported: list[tuple[Severity, str]] = []
    log = EmergencyLog(lambda _, severity, text: reported.append((severity, text)))
    now = 100.0
    for number in range(3000):
        data = (
            Emergency(0x8130, 0x11).encode(),
            Emergency(0, 0).encode(),
            Emergency(0xFF01, 0x81, number.to_bytes(5, 'little')).encode(),
            b'\x01',
        )[number % 4]
        now += 0.01
        log.receive(Frame(0x81, data, timestamp=now))
        log.look(now)
    counts = [text for _, text in reported if ' more in ' in text]
    assert len(reported) == 8 + 2
    assert len(counts) == 2
    log.look(now + 10.0)
    numbers = [int(text.split()[1]) for _, text in reported if ' more in ' in text]
    assert sum(numbers) + len(reported) - len(numbers) == 3000
    assert '0xFF01' in counts[0]
    assert counts[0].endswith(', and others)')


def test_a_pdo_of_another_length_is_reported_once() -> None:
    """With both lengths; a second one is counted only."""
    net = booted(drive_config('a', 2))
    for _ in range(3):
        net.network.receive(Frame(0x182, b'\0', net.now))
    reported = [
        text for text in net.reported(Severity.WARNING) if 'TPDO 1 (0x182) has 1 bytes' in text
    ]
    assert len(reported) == 1


def test_a_pdo_with_an_event_time_that_stops_is_reported() -> None:
    """The device takes no targets until it comes again."""
    config = drive_config('a', 2)
    timed = replace(pdo(3, 0x382, (0x6077, 0), transmission=255), event_time=0.02)
    net = booted(replace(config, tpdos=(*config.tpdos, timed)))
    net.run(0.5)
    node = net.network.nodes['a']
    assert net.drives['a'].view.fresh
    net.network._handlers[0x382] = lambda frame: None
    net.run(0.2)
    assert not net.drives['a'].view.fresh
    assert any('TPDO 3 (0x382) has stopped: none for 60 ms' in text for text in net.reported())
    node.image.tpdos[-1].receive(Frame(0x382, bytes(2), net.now))
    net.run(0.01)
    assert net.drives['a'].view.fresh


def test_pdos_that_come_after_the_window_are_counted() -> None:
    """`sync_window`: what answers a SYNC too late is no answer of that moment."""
    net = booted(drive_config('a', 2), sync_window=0.0001)
    net.run(0.2)
    assert net.network.late_pdos > 10
    patient = VirtualNetwork(bus_config(drive_config('a', 2), sync_window=0.005))
    patient.boot()
    patient.run(0.2)
    assert patient.network.late_pdos == 0


def test_time_is_sent_as_often_as_configured() -> None:
    """TIME carries the time of day in milliseconds since midnight and days since 1984."""
    moment = datetime(2026, 11, 21, 7, 30, 0, 250_000, tzinfo=timezone.utc)
    sent: list[Frame] = []
    config = bus_config(time_period=0.5, time_cob_id=0x4000_0100)
    network = Network(config, sent.append, lambda event: None, lambda: moment)
    network.start(10.0)
    for cycle in range(100):
        network.cycle(10.0 + cycle * 0.01, 0.01)
    times = [frame.data for frame in sent if frame.can_id == 0x100]
    assert len(times) == 2
    assert decode_time_of_day(times[0]) == moment
    assert times[0] == bytes.fromhex('BA FD 9B 01') + (15665).to_bytes(2, 'little')
    with pytest.raises(CodecError, match='1983'):
        encode_time_of_day(datetime(1983, 12, 31, tzinfo=timezone.utc))
    with pytest.raises(CodecError, match='6 bytes'):
        decode_time_of_day(b'')


NODE = 'a'
NODE_ID = 2


@pytest.fixture
def enabled() -> VirtualNetwork:
    """A booted device with an enabled drive."""
    made = VirtualNetwork(bus_config(drive_config(NODE, NODE_ID)))
    made.boot()
    made.do(NODE, 'init')
    made.run(0.5)
    made.events.clear()
    return made


def back(net: VirtualNetwork) -> None:
    """Wait until the device was lost and is booted again."""
    node = net.network.nodes[NODE]
    net.run_until(lambda: not node.online)
    net.run_until(net.all_ready)


def test_a_commanded_reset_is_no_error(enabled: VirtualNetwork) -> None:
    """Of ours or of a tool: reported by name, nothing worse but what the drive itself reports."""
    for command, ours in itertools.product(sorted(RESETS), (True, False)):
        if ours:
            enabled.network.send_nmt(command, NODE_ID)
        else:
            enabled.send_as('tool', Frame(0x000, nmt_frame(command, NODE_ID)))
        back(enabled)
        warned = [text for text in enabled.reported(Severity.WARNING) if 'EMCY' not in text]
        assert warned == [], (command, ours)
        reported = enabled.reported()
        assert f'a: restarts, by the NMT command {command.name}' in reported, (command, ours)
        assert 'a: operational' in reported, (command, ours)
        enabled.do(NODE, 'init')
        enabled.run(0.5)
        enabled.events.clear()
    enabled.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    enabled.power_off(NODE)  # slowly: it misses its heartbeat before its boot-up message comes
    enabled.run(0.9)
    assert not enabled.network.nodes[NODE].online
    enabled.power_on(NODE)
    enabled.run_until(enabled.all_ready)
    assert enabled.reported(Severity.ERROR) == []
    assert sum('restarts, by the NMT command' in text for text in enabled.reported()) == 1


def test_a_reset_that_nobody_commanded_is_an_error(enabled: VirtualNetwork) -> None:
    """So is one long after the last command, and one of another device.

    A reset that is not obeyed does not hide a loss when it is long over.
    """
    enabled.lose(0)
    enabled.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    enabled.run(RESET_TIME + 1.0)
    enabled.lose()
    assert enabled.network.nodes[NODE].online
    enabled.power_off(NODE)
    enabled.run(1.0)
    assert any('heartbeat lost' in text for text in enabled.reported(Severity.ERROR))
    enabled.power_on(NODE)
    enabled.run_until(enabled.all_ready)
    enabled.events.clear()
    enabled.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    back(enabled)
    enabled.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID + 1)
    enabled.run(RESET_TIME)
    enabled.power_off(NODE)
    enabled.power_on(NODE)
    back(enabled)
    errors = enabled.reported(Severity.ERROR)
    assert any('restarted: a boot-up message came' in text for text in errors)


NODE_IDS = range(2, 9)


def seven_drives(inhibit_time: float) -> VirtualNetwork:
    """Return a bus of seven drives whose master waits between NMT commands."""
    configs = [drive_config(f'joint{number}', number) for number in NODE_IDS]
    return VirtualNetwork(bus_config(*configs, nmt_inhibit_time=inhibit_time))


def nmt_commands(net: VirtualNetwork) -> list[Sent]:
    """Return the NMT commands that were on the bus."""
    return [sent for sent in net.wire.log if sent.frame.can_id == CobId.NMT]


def sent_at(net: VirtualNetwork, command: NmtCommand, node_id: int) -> list[float]:
    """Return when a command was sent to a node id in [s]."""
    data = bytes((command, node_id))
    return [sent.time for sent in nmt_commands(net) if sent.frame.data == data]


def test_seven_drives_boot_and_stay() -> None:
    """All of them are operational at the end of their one boot, and none drops out afterwards.

    A command is done when it has left: a reset that waits is no commanded one before, and no
    device is said to restart by itself.
    """
    net = seven_drives(0.1)
    net.boot()
    net.run(1.5)
    assert net.all_ready()
    assert [event for event in net.events if event.kind is EventKind.HEARTBEAT_LOST] == []
    times = [sent.time for sent in nmt_commands(net)]
    assert len(times) == 1 + 2 * len(NODE_IDS)
    assert min(b - a for a, b in pairwise(times)) >= 0.1 - 1e-9
    net.network.advance(net.now)
    begin = net.now
    for command in (NmtCommand.RESET_COMMUNICATION, NmtCommand.START):
        sent = [net.network.send_nmt(command, node_id) for node_id in NODE_IDS]
        assert [promise.done for promise in sent][1:] == [False] * 6
    net.result(sent[-1])
    assert net.now - begin == pytest.approx(1.3)
    net.run_until(net.all_ready)
    net.run(1.0)
    restarts = [event for event in net.events if 'RESET_COMMUNICATION' in event.text]
    assert [event.node for event in restarts] == list(net.devices)
    assert all(event.severity is Severity.INFO for event in restarts)


def test_devices_that_are_reset_one_by_one_boot_once() -> None:
    """The boot of a device begins when its own reset has left, not while that waits."""
    alive = drive_config('alive', 20, reset_communication=False)
    configs = [drive_config(f'joint{number}', number) for number in NODE_IDS]
    net = booted(*configs, alive, nmt_inhibit_time=0.1)
    for node_id in NODE_IDS:
        (reset,) = sent_at(net, NmtCommand.RESET_COMMUNICATION, node_id)
        (stopped,) = sent_at(net, NmtCommand.ENTER_PRE_OPERATIONAL, node_id)
        (started,) = sent_at(net, NmtCommand.START, node_id)
        assert START <= reset < stopped < started


def test_a_start_that_waits_is_withdrawn_when_its_device_restarts() -> None:
    """The device that came back is not the one that was configured."""
    net = seven_drives(0.1)
    net.start()
    last = NODE_IDS[-1]
    net.run_until(lambda: bool(sent_at(net, NmtCommand.ENTER_PRE_OPERATIONAL, last)))
    net.run(0.02)  # configured by now; its start waits behind those of the others
    assert not sent_at(net, NmtCommand.START, last)
    net.power_off(f'joint{last}')
    net.power_on(f'joint{last}')
    net.run_until(net.all_ready)
    (first, again) = sent_at(net, NmtCommand.ENTER_PRE_OPERATIONAL, last)
    (started,) = sent_at(net, NmtCommand.START, last)
    assert first < again < started


@pytest.mark.parametrize('inhibit_time', [0.0, 0.05])
def test_a_command_that_the_bus_refuses_leaves_as_soon_as_the_bus_takes_it(
    inhibit_time: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is not done before, keeps its place, and counts as commanded when it has left.

    One that the bus never takes is answered so, and does not leave later. A stop must leave,
    whatever went wrong before: a defect at one command keeps back no other.
    """
    net = seven_drives(inhibit_time)
    net.boot()
    net.run(0.5)
    net.wire.refuses = 'the transmit queue is full'
    commands = [NmtCommand.STOP, NmtCommand.ENTER_PRE_OPERATIONAL, NmtCommand.START]
    sent = [net.network.send_nmt(command, 2) for command in commands]
    net.run(0.2)
    assert not sent[0].done
    assert net.network.nodes['joint2'].wanted is NmtState.OPERATIONAL
    net.wire.refuses = ''
    net.result(sent[-1])
    assert [sent.frame.data[0] for sent in nmt_commands(net)[-3:]] == commands
    before = len(nmt_commands(net))
    net.wire.refuses = 'the transmit queue is full'
    with pytest.raises(BusError, match='NMT STOP to node 2 was not sent: the transmit queue is'):
        net.result(net.network.send_nmt(NmtCommand.STOP, 2))
    net.wire.refuses = ''
    net.run(0.2)
    assert len(nmt_commands(net)) == before
    net.allows_defects = True
    with monkeypatch.context() as patch:
        patch.setattr(net.network._nmt, '_send', None)
        net.network.send_nmt(NmtCommand.STOP, 3)
        net.run(0.2)
    assert sent_at(net, NmtCommand.STOP, 3) == []
    net.network.send_nmt(NmtCommand.STOP, 4)
    net.run(0.2)
    assert len(sent_at(net, NmtCommand.STOP, 4)) == 1


BUS = bus_config(drive_config('a', 2), drive_config('b', 3))


class SlowBus(VirtualBus):
    """A bus of which each frame takes a time in [s] to be read; the last one comes for ever."""

    def __init__(self, *frames: Frame | None, step: float = 0.01) -> None:
        """Give these frames; None is a moment at which there is none to read."""
        super().__init__('here', VirtualWire())
        self.now = 10.0
        self._frames, self._step = list(frames), step

    def receive(self, timeout: float) -> list[Frame]:
        """Return the next frame."""
        assert timeout >= 0.0
        self.now += max(timeout, self._step)
        frame = self._frames.pop(0) if self._frames[1:] else self._frames[0]
        return [] if frame is None else [frame]


def test_a_master_that_runs_is_refused_by_name() -> None:
    """The refusal names frame, sender and remedies, and nothing was sent."""
    for frame, words in (
        (Frame(0x080), 'SYNC (0x080)'),
        (Frame(0x701, b'\x05'), 'the heartbeat 0x701 of node id 1'),
        (Frame(0x203, bytes(3)), 'RPDO 1 (0x203) of b'),
        (Frame(0x000, b'\x82\x00'), 'the NMT command RESET_COMMUNICATION to all nodes'),
        (Frame(0x000, b'\x01\x02'), 'the NMT command START to node 2'),
    ):
        bus = SlowBus(frame._replace(timestamp=10.05), None)
        with bus, pytest.raises(OtherMasterError, match='another master is on here') as refusal:
            refuse_other_master(bus, BUS, lambda bus=bus: bus.now)  # type: ignore[misc]
        assert bus.counters.sent == 0
        assert words in str(refusal.value)
        assert 'beside_master:=true' in str(refusal.value)


def test_devices_and_tools_are_no_master() -> None:
    """What a device or a tool that only reads may send does not hold up the start."""
    frames = (
        Frame(0x702, b'\x05'),
        Frame(0x701, is_remote=True),
        Frame(0x182, bytes(3)),
        Frame(0x602, bytes(8)),
        Frame(0x7E5, bytes(8)),
        Frame(0x080, is_extended=True),
    )
    bus = SlowBus(*(frame._replace(timestamp=10.05) for frame in frames), None)
    with bus:
        refuse_other_master(bus, BUS, lambda: bus.now)
    assert bus.now >= 10.0 + LISTENING_TIME


UNREAD = Frame(0x182, bytes(3), timestamp=9.0)
OLDER = [Frame(0x182, bytes(3), timestamp=5.0 + number) for number in range(3)]
FRESH = Frame(0x080, timestamp=10.1)


@pytest.mark.parametrize(
    ('frames', 'found'),
    [([*OLDER, FRESH, None], 1), ([*OLDER, FRESH, UNREAD], 1), ([Frame(0x080, timestamp=9.0)], 0)],
    ids=['read to its end', 'endless', 'last words of one that has ended'],
)
def test_a_master_is_found_behind_all_that_waits_to_be_read(
    frames: list[Frame | None], found: int
) -> None:
    """However long that takes, and also where the rest stays unread; what is older is ignored."""
    bus = SlowBus(*frames, *([] if found else [None]), step=1.5 * LISTENING_TIME)
    with bus:
        assert listen(bus, BUS, lambda: bus.now).total() == found


@pytest.mark.parametrize('frame', [Frame(0x080), UNREAD], ids=['no time stamp', 'old'])
@pytest.mark.parametrize('step', [0.01, 2.0 * CATCH_UP_MAX])
def test_a_bus_that_is_not_read_to_its_end_is_refused_in_words(frame: Frame, step: float) -> None:
    """A limited time is given to it; whether there is a master is not known then.

    Beside another master it is led all the same, and what is not known is reported.
    """
    bus = SlowBus(frame, step=step)
    with bus:
        with pytest.raises(OtherMasterError, match='another master is on here is not known') as no:
            refuse_other_master(bus, BUS, lambda: bus.now)
        assert bus.counters.sent == 0
        assert bus.now < 10.0 + LISTENING_TIME + CATCH_UP_MAX + 2.0 * step + 0.1
    assert 'Nothing was sent' in str(no.value)
    assert 'beside_master:=true' in str(no.value)
    beside = SlowBus(frame, step=step)
    with beside:
        clock = Clock(lambda: beside.now, Future)
        master = CanopenMaster(BUS, beside, beside_master=True, clock=clock)
        assert 'another master is on here is not known' in master.listen()


def test_the_virtual_master_shows_itself_within_the_listening_time() -> None:
    """At whatever moment one listens to a running master, it is detected, and no device is."""
    net = booted(*BUS.nodes)
    signs = MasterFrames(BUS)
    for moment in (0.0, 0.0037, 0.0074):  # of a cycle
        begin = net.now + moment
        net.run(moment + LISTENING_TIME)
        received = [s.frame for s in net.wire.log if s.sender == 'master' and s.time >= begin]
        assert any(signs.read(frame) for frame in received), moment
    assert not any(signs.read(s.frame) for s in net.wire.log if s.sender != 'master')


def test_beside_another_master_no_command_is_for_all() -> None:
    """Its devices are not in bus.yml, so each of ours is addressed by its id."""
    config = bus_config(drive_config('a', 2), drive_config('b', 3))
    net = VirtualNetwork(config, beside_master=True)
    net.boot()
    assert net.frames(0x000)[:2] == [b'\x82\x02', b'\x82\x03']
    net.send_as('other', Frame(0x080))
    net.run(0.05)
    assert all(command[1] for command in net.frames(0x000))
    assert not net.reported(Severity.ERROR)
    assert any('another master is on this bus' in text for text in net.reported(Severity.WARNING))


def test_the_clearest_evidence_is_named_first() -> None:
    """Many RPDOs do not hide the SYNC, nor that an NMT command.

    With sync_period 0 a device may be the SYNC producer.
    """
    signs = MasterFrames(BUS)
    frames = [*[Frame(0x202, bytes(3))] * 9, *[Frame(0x080)] * 3, Frame(0x000, b'\x01\x00')]
    found = Counter(sign for frame in frames if (sign := signs.read(frame)) is not None)
    assert describe(found) == (
        'the NMT command START to all nodes 1 times, SYNC (0x080) 3 times, '
        'RPDO 1 (0x202) of a 9 times'
    )
    silent = bus_config(drive_config('a', 2), sync_period=0.0)
    assert MasterFrames(silent).read(Frame(0x080)) is None
