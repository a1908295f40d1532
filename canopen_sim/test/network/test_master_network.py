# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network in operation: heartbeats, restarts, EMCY, SYNC, missed PDOs, and a sick bus."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from bus_rig import booted, FRAME_TIME, VirtualNetwork
from drive_samples import bus_config, drive_config, pdo, PERIOD, sdo_write
import pytest

from arm_canopen import EventKind, SdoAbortError, SdoTimeoutError, Severity
from arm_canopen.can import Frame
from arm_canopen.master.network import NEVER, UPDATE_SHARE
from arm_canopen.master.status import node_status
from arm_canopen.standard import (
    DataType,
    nmt_frame,
    NmtCommand,
    NmtState,
    ObjectDictionary,
    ObjectEntry,
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
    """Each device by its name, not before its time and at the next look after it."""
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


def test_a_device_that_returns_is_booted_again() -> None:
    """After a power cut of some length the device is operational without anybody asking."""
    net = network()
    net.boot()
    net.power_off('a')
    net.run(5.0)
    assert not net.network.nodes['a'].online
    net.power_on('a')
    net.run_until(net.all_ready, 0.5)
    assert events(net, EventKind.BOOT, 'a') == ['operational', 'operational']
    assert events(net, EventKind.BOOT, 'b') == ['operational']


def test_a_short_power_cut_is_noticed_by_the_boot_up_message() -> None:
    """Also one shorter than the consumer time: the restart is reported, and the device booted."""
    net = network()
    net.boot()
    net.run(0.2)
    net.power_off('a')
    net.run(0.05)
    net.power_on('a')
    net.run_until(lambda: not net.network.nodes['a'].online, 0.1)
    net.run_until(net.all_ready, 0.5)
    assert 'restarted' in events(net, EventKind.HEARTBEAT_LOST, 'a')[0]


def test_a_device_behind_a_broken_cable_is_found_again() -> None:
    """When its frames come through again it is booted, although it never restarted."""
    net = network()
    net.boot()
    net.wire.loses = lambda sender, frame: sender == 'a'
    net.run(3.0)
    assert not net.network.nodes['a'].online
    net.wire.loses = lambda sender, frame: False
    net.run_until(net.all_ready, 3.0)


def test_a_device_without_heartbeat_is_not_watched() -> None:
    """With no producer time configured, silence is no loss."""
    config = drive_config('a', 2, heartbeat_producer=0.0, heartbeat_timeout=0.0)
    net = booted(config)
    net.power_off('a')
    net.run(10.0)
    assert net.network.nodes['a'].online
    assert node_status(net.network.nodes['a'], net.now).heartbeat_age is None


def test_the_status_has_the_age_of_the_heartbeat() -> None:
    """It grows while nothing comes, and is small when one came."""
    net = network()
    net.boot()
    net.run(1.0)
    node = net.network.nodes['a']
    age = node_status(node, net.now).heartbeat_age
    assert age is not None
    assert 0.0 <= age <= 0.1 + PERIOD
    later = node_status(node, net.now + 0.2).heartbeat_age
    assert later == pytest.approx(age + 0.2)


def test_an_emergency_comes_with_the_identifier_that_bus_yml_has_written() -> None:
    """The device sends it as 0x1014 says, and there the master listens, not at the usual one.

    A device keeps an identifier in use, so the EMCY is switched off while it changes.
    """
    config = drive_config('a', 2)
    config = replace(config, sdo_writes=(*config.sdo_writes, sdo_write(0x1014, 0, 0x90)))
    net = booted(config)
    net.devices['a'].faults.inject(FaultInjection(Fault.OVER_TEMPERATURE), net.now)
    net.run(0.1)
    assert net.frames(0x090)
    assert not net.frames(EMCY + 2)
    assert '0x4310' in events(net, EventKind.EMERGENCY, 'a')[0]


def test_a_device_gets_another_identifier_of_time() -> None:
    """It keeps one in use, so TIME is switched off while it changes."""
    config = drive_config('a', 2)
    time = ObjectEntry(0x1012, 0, 'TIME', DataType.UNSIGNED32, default=0x8000_0100)
    config = replace(
        config,
        dictionary=ObjectDictionary([*config.dictionary, time]),
        sdo_writes=(*config.sdo_writes, sdo_write(0x1012, 0, 0x8000_0181)),
    )
    net = booted(config)
    assert net.devices['a'].clock.can_id == 0x181


def test_emergencies_are_reported_in_words_until_they_end() -> None:
    """The last one is kept until the device takes it back, or restarts."""
    net = network()
    net.boot()
    node = net.network.nodes['a']
    for data in ('10 82 11 00 00 00 00 00', '20 43 09 01 02 03 04 05'):
        net.send_as('a', Frame(EMCY + 2, bytes.fromhex(data)))
    net.run(0.01)
    reported = events(net, EventKind.EMERGENCY, 'a')
    assert '0x8210 PDO not processed, length error' in reported[0]
    assert '0x4320 too low drive temperature' in reported[1]
    assert node.emergencies.last is not None
    assert node.emergencies.last.code == 0x4320
    net.send_as('a', Frame(EMCY + 2, bytes(8)))
    net.run(0.01)
    assert node.emergencies.last is None
    net.send_as('a', Frame(EMCY + 2, bytes.fromhex('20 43 09 01 02 03 04 05')))
    net.run(0.01)
    net.power_off('a')
    net.power_on('a')
    net.run(0.2)
    assert node.emergencies.last is None


def test_an_odd_emergency_is_reported_as_such() -> None:
    """Too short a frame is no EMCY, but no reason to be silent."""
    net = network()
    net.boot()
    net.send_as('a', Frame(EMCY + 2, b'\x10'))
    net.run(0.01)
    assert 'odd EMCY' in events(net, EventKind.EMERGENCY, 'a')[0]


@pytest.mark.parametrize('data', [b'', b'\x05\x00', b'\x33'])
def test_an_odd_heartbeat_is_no_heartbeat(data: bytes) -> None:
    """It neither counts as a sign of life nor changes the state."""
    net = network()
    net.boot()
    node = net.network.nodes['a']
    before = (node.life.last, node.nmt_state)
    node.receive_heartbeat(Frame(HEARTBEAT + 2, data, timestamp=net.now + 1.0))
    assert (node.life.last, node.nmt_state) == before


def test_states_are_reported_when_they_change_only() -> None:
    """A heartbeat of the same state is no news."""
    net = network('a')
    net.boot()
    net.run(2.0)
    states = events(net, EventKind.NMT_STATE)
    assert states == [text for n, text in enumerate(states) if n == 0 or text != states[n - 1]]
    assert states[-1] == 'NMT state OPERATIONAL'


def test_a_device_that_somebody_stops_is_warned_of_until_it_is_started() -> None:
    """Leaving operational is a warning; coming back ends it."""
    net = network('a')
    net.boot()
    net.run(0.5)
    net.network.send_nmt(NmtCommand.STOP, 2)
    net.run(0.2)
    node = net.network.nodes['a']
    assert node.left_operational
    assert 'NMT state STOPPED' in str(net.reported(Severity.WARNING))
    net.network.send_nmt(NmtCommand.START, 2)
    net.run(0.2)
    assert not node.left_operational
    assert node.nmt_state is NmtState.OPERATIONAL


@pytest.mark.parametrize('ours', [True, False], ids=['ours', "another tool's"])
@pytest.mark.parametrize('command', [NmtCommand.STOP, NmtCommand.ENTER_PRE_OPERATIONAL])
def test_a_state_that_somebody_commanded_is_left_alone(command: NmtCommand, ours: bool) -> None:
    """The master does not start what a person stopped, by a service or by a tool on the bus."""
    net = network('a')
    net.boot()
    net.run(0.5)
    if ours:
        net.network.send_nmt(command, 2)
    else:
        net.send_as('tool', Frame(0, nmt_frame(command, 2)))
    net.run(3.0)
    node = net.network.nodes['a']
    assert node.left_operational
    assert 'by itself' not in net.story()
    net.send_as('tool', Frame(0, nmt_frame(NmtCommand.START)))
    net.run(0.5)
    assert node.operational


def test_a_start_that_got_lost_is_sent_again() -> None:
    """The device goes on to say that it is pre-operational: it is booted again."""
    net = network('a')
    lost: list[Frame] = []

    def loses(sender: str, frame: Frame) -> bool:
        start = frame.can_id == 0 and frame.data == nmt_frame(NmtCommand.START, 2)
        if start and not lost:
            lost.append(frame)
            return True
        return False

    net.wire.loses = loses
    net.start()
    net.run_until(lambda: net.network.nodes['a'].nmt_state is NmtState.OPERATIONAL)
    assert lost
    assert 'left Operational by itself' in net.story()


@pytest.mark.parametrize(
    ('overflow', 'counters'),
    [(0, [b''] * 8), (5, [b'\1', b'\2', b'\3', b'\4', b'\5', b'\1', b'\2', b'\3'])],
)
def test_sync_counts_as_the_standard_says(overflow: int, counters: list[bytes]) -> None:
    """With an overflow value from 1 to it, without one no data (CiA 301, 7.2.5)."""
    net = network(sync_overflow=overflow)
    net.start()
    net.run(7.5 * PERIOD)
    assert net.frames(SYNC) == counters


def test_sync_is_the_last_frame_of_each_cycle() -> None:
    """All RPDOs have left when it comes, so that devices take them together."""
    net = network()
    net.boot()
    begin = net.now
    net.run(0.1)
    sent = [s for s in net.wire.log if s.sender == 'master' and s.time > begin]
    syncs = [n for n, s in enumerate(sent) if s.frame.can_id == SYNC]
    ids = [{s.frame.can_id for s in sent[a + 1 : b]} for a, b in pairwise(syncs)]
    assert set.union(*ids) == {0x202, 0x302, 0x402, 0x203, 0x303, 0x403}
    assert all(group == ids[0] for group in ids)
    for a, b in pairwise(syncs):
        assert sent[b].time - sent[a].time == pytest.approx(PERIOD)


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


def test_feedback_comes_once_for_each_sync_with_the_last_answer() -> None:
    """Between SYNC and the next cycle, when all TPDOs are there."""
    net = network('a', 'b', 'c')
    net.boot()
    net.feedback_times.clear()
    net.run_until(lambda: bool(net.feedback_times))  # begin between two rounds
    net.feedback_times.clear()
    begin = net.now
    net.run(0.5 - PERIOD / 2)
    syncs = [s.time for s in net.wire.log if s.frame.can_id == SYNC and s.time > begin]
    assert [sync for _, sync in net.feedback_times] == pytest.approx(syncs)
    tpdos = {0x182, 0x282, 0x183, 0x283, 0x184, 0x284}
    for moment, sync in net.feedback_times:
        answers = [
            s.time
            for s in net.wire.log
            if s.frame.can_id in tpdos and sync <= s.time < sync + PERIOD
        ]
        assert len(answers) == len(tpdos)
        assert max(answers) < moment < sync + PERIOD


def test_missed_pdos_are_counted_and_hold_nothing_up() -> None:
    """Each lost TPDO counts once for its device; the drives wait half a period for it."""
    net = network('a', 'b')
    net.boot()
    net.run(0.1)
    assert net.network.missed_pdos == 0
    net.feedback_times.clear()
    net.wire.loses = lambda sender, frame: frame.can_id == 0x283
    net.run(10 * PERIOD)
    net.wire.loses = lambda sender, frame: False
    net.run(2 * PERIOD)
    nodes = net.network.nodes
    assert (nodes['a'].pdos.missed, nodes['b'].pdos.missed) == (0, 10)
    assert net.network.missed_pdos == 10
    assert len(net.feedback_times) == 12
    late = [moment - sync for moment, sync in net.feedback_times[1:9]]
    assert late == pytest.approx([UPDATE_SHARE * PERIOD] * len(late))


def test_boots_restarts_and_losses_count_no_missed_pdos() -> None:
    """Only a device that should answer can miss to."""
    net = network('a', 'b')
    net.boot()
    net.run(0.2)
    net.power_off('a')
    net.power_on('a')
    net.run(0.5)
    net.run_until(net.all_ready)
    assert net.network.missed_pdos <= 2  # those of the cycle in which it restarted
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
    net.wire.loses = lambda sender, frame: False
    net.run_until(lambda: node.online)
    assert node.image.tpdos[0].values is None


def test_the_masters_heartbeat_comes_from_the_cycle() -> None:
    """At its period while the cycle runs, and not at all while it hangs."""
    net = network(heartbeat_producer=0.1)
    net.start()
    net.run(1.0)
    own = [s for s in net.wire.log if s.frame.can_id == HEARTBEAT + 1]
    assert [s.frame.data for s in own] == [bytes((NmtState.OPERATIONAL,))] * len(own)
    gaps = [b.time - a.time for a, b in pairwise(own)]
    assert len(own) in (10, 11)
    assert gaps == pytest.approx([0.1] * len(gaps), abs=PERIOD)
    before = len(own)
    for _ in range(100):
        net.network.advance(net.now + 1.0)
    assert len(net.frames(HEARTBEAT + 1)) == before


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


def test_heartbeats_do_not_crowd_after_a_pause() -> None:
    """A cycle that comes late sends one heartbeat, and the next a period later."""
    net = network(heartbeat_producer=0.1)
    net.network.start(net.now)
    for moment in (0.0, 0.1, 0.47, 0.48, 0.49, 0.56, 0.57, 0.58):
        net.network.cycle(net.now + moment, PERIOD)
        net.network.update(net.now + moment, PERIOD)
    assert len(net.frames(HEARTBEAT + 1)) == 4


def test_a_bus_that_refuses_frames_is_reported_once_and_recovers() -> None:
    """The reason once, the recovery once; boots go on, and all is well in the end."""
    net = network()
    net.boot()
    net.wire.refuses = 'vcan0: transmit queue full'
    net.run(2.0)
    assert events(net, EventKind.BUS) == ['vcan0: transmit queue full']
    net.wire.refuses = ''
    net.run_until(lambda: len(events(net, EventKind.BUS)) == 2, 0.1)
    assert 'takes frames again' in events(net, EventKind.BUS)[1]
    net.run(3.0)
    assert net.all_ready()


def test_a_bus_that_refuses_frames_from_the_start() -> None:
    """The master starts all the same, and boots the devices when it can."""
    net = network()
    net.wire.refuses = 'vcan0 is down'
    net.start()
    net.run(3.0)
    assert events(net, EventKind.BUS) == ['vcan0 is down']
    net.wire.refuses = ''
    net.run_until(net.all_ready, 5.0)


def test_strange_frames_are_counted_and_passed_over() -> None:
    """Unknown identifiers, remote, extended and error frames reach nobody."""
    net = network()
    net.boot()
    node = net.network.nodes['a']
    count, unknown = node.image.tpdos[0].count, net.network.unknown_frames
    for frame in (
        Frame(0x7FF, b'\0'),
        Frame(0x182, bytes(3), is_extended=True),
        Frame(0x182, b'', is_remote=True),
        Frame(0x182, bytes(8), is_error=True),
    ):
        net.network.receive(frame)
    assert node.image.tpdos[0].count == count
    assert net.network.unknown_frames == unknown + 3
    assert net.network.controller.error_frames == 1


def test_every_frame_is_shown_to_whoever_counts() -> None:
    """The hook for statistics sees known and unknown frames alike."""
    net = network()
    seen: list[int] = []
    net.network.on_frame = lambda frame: seen.append(frame.can_id)
    net.network.receive(Frame(0x7FF))
    net.network.receive(Frame(0x182, bytes(3)))
    assert seen == [0x7FF, 0x182]


def test_devices_that_shall_be_kept_alive_are_not_reset() -> None:
    """One of them among others: each of the others is reset by its id."""
    nodes = [drive_config(name, 2 + n) for n, name in enumerate('abc')]
    nodes[1] = replace(nodes[1], reset_communication=False)
    net = VirtualNetwork(bus_config(*nodes))
    net.network.start(net.now)
    resets = [data for data in net.frames(0x000) if data[0] == NmtCommand.RESET_COMMUNICATION]
    assert resets == [b'\x82\x02', b'\x82\x04']


def test_all_are_reset_by_one_frame() -> None:
    """Without exceptions one command to everybody is enough."""
    net = network('a', 'b', 'c')
    net.network.start(net.now)
    assert net.frames(0x000) == [b'\x82\x00']


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
    node.image.tpdos[0].listener = lambda entry: promises.append(
        node.sdo.write(0x2000, 0, b'', 0.02)
    )
    promises: list[object] = []
    net.network.receive(Frame(0x182, bytes(3), timestamp=begin + 0.5))
    assert len(promises) == 1
    assert net.network.scheduler.next_deadline() == pytest.approx(begin + 0.52)


def test_an_identical_run_sends_identical_frames() -> None:
    """Two runs of one story do not differ in a single frame or its time."""

    def story() -> list[object]:
        net = network('a', 'b')
        net.boot()
        net.do('a', 'init')
        net.run(0.3)
        return list(net.wire.log)

    assert story() == story()


def test_frames_of_one_cycle_fit_the_time_of_the_bus() -> None:
    """The virtual bus is no faster than a real one of 1 Mbit/s."""
    net = network('a', 'b')
    net.boot()
    net.run(0.1)
    # SYNC, and 2 TPDOs of each drive; the RPDOs leave after them
    for moment, sync in net.feedback_times[-3:]:
        assert 4.99 * FRAME_TIME < moment - sync < 8 * FRAME_TIME


@pytest.mark.parametrize(
    ('frame', 'what'),
    [(Frame(0x80), 'SYNC'), (Frame(0x701, b'\x05'), 'the heartbeat 0x701')],
    ids=['sync', 'heartbeat'],
)
def test_another_master_is_noticed(frame: Frame, what: str) -> None:
    """It is said once what only the master of a bus sends."""
    net = network('a')
    net.boot()
    for _ in range(5):
        net.send_as('other_master', frame)
        net.run(0.01)
    said = [
        text for text in net.reported(Severity.ERROR) if 'another master is on this bus' in text
    ]
    assert len(said) == 1
    assert what in said[0]


def test_a_device_that_does_not_answer_sync_is_reported_before_its_heartbeat_is_missed() -> None:
    """Once, and again when it falls silent again."""
    net = network('a')
    net.boot()
    net.run(0.2)
    for count in (1, 2):
        net.wire.loses = lambda sender, frame: frame.can_id in (0x182, 0x282)
        net.run(1.0)
        assert not net.drives['a'].view.fresh
        reported = [
            text for text in net.reported(Severity.WARNING) if 'has not answered SYNC' in text
        ]
        assert len(reported) == count
        net.wire.loses = lambda sender, frame: False
        net.run(0.2)
        assert net.drives['a'].view.fresh


def test_a_pause_of_the_cycle_is_reported_with_its_consequence() -> None:
    """Whoever reads of faults afterwards shall know whose fault it was."""
    net = VirtualNetwork(
        bus_config(drive_config('a', 2), heartbeat_producer=0.1, heartbeat_timeout=0.3)
    )
    net.network.note_pause(0.2, 1.0)
    net.network.note_pause(0.6, 1.5)
    short, long = net.reported(Severity.WARNING)
    assert 'held up for 200 ms' in short
    assert 'taken it for dead' not in short
    assert 'taken it for dead' in long


def test_pauses_of_a_busy_computer_are_summed_up() -> None:
    """A line for each would bury what matters."""
    net = VirtualNetwork(bus_config(drive_config('a', 2)))
    for number in range(50):
        net.network.note_pause(0.12 + number * 1e-3, 0.5 * number)
    lines = net.reported(Severity.WARNING)
    assert len(lines) == 3
    assert 'held up for 160 ms by this computer, and 19 times before, for 159 ms' in lines[-1]


def test_devices_do_not_miss_a_master_that_has_taken_its_leave() -> None:
    """After the watch is ended there is no EMCY when the heartbeat stops."""
    net = VirtualNetwork(
        bus_config(
            drive_config('a', 2, heartbeat_consumer=True),
            heartbeat_producer=0.1,
            heartbeat_timeout=0.3,
        )
    )
    net.boot()
    net.run(0.5)
    node = net.network.nodes['a']
    net.result(net.network.scheduler.spawn(node.unwatch()))
    net.wire.loses = lambda sender, frame: sender == 'master'
    net.run(2.0)
    assert 'EMCY' not in net.story()


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


def test_an_empty_bus_is_reported_once() -> None:
    """Without anybody to acknowledge a frame each one is sent over and over."""
    net = network('a')
    for _ in range(100):
        net.network.receive(Frame(0x020, bytes(8), timestamp=net.now, is_error=True))
    assert len([text for text in net.reported(Severity.WARNING) if 'acknowledges' in text]) == 1


def test_rpdos_leave_when_the_tpdos_of_the_sync_have_come() -> None:
    """SYNC is first in its cycle; nobody's work stands between its deadline and the frame."""
    net = network('a', 'b')
    net.boot()
    begin = net.now
    net.run(20 * PERIOD)
    pdos = {
        0x202: 'rpdo',
        0x302: 'rpdo',
        0x402: 'rpdo',
        0x182: 'tpdo',
        0x283: 'tpdo',
        SYNC: 'sync',
    }
    kinds = [
        pdos[s.frame.can_id] for s in net.wire.log if s.time > begin and s.frame.can_id in pdos
    ]
    cycle = ['sync', 'tpdo', 'tpdo', 'rpdo', 'rpdo', 'rpdo']
    start = kinds.index('sync')
    whole = kinds[start : start + 18 * len(cycle)]
    assert whole == 18 * cycle


def test_an_update_that_was_missed_is_done_in_the_next_cycle() -> None:
    """A computer that is too slow for its period still leads its drives."""
    net = network('a')
    net.boot()
    updates: list[float] = []
    net.network.on_cycle = lambda now, period: updates.append(now)
    master = net.network
    for number in (1, 2):
        now = net.now + number * PERIOD
        master.sync()
        master.cycle(now, PERIOD)  # ends after the next deadline, each time
        if now >= master.next_update:
            master.update(now, PERIOD)
    assert len(updates) == 1
