# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the master notices of its devices: guarding, PDOs that stop or do not fit, EMCYs; TIME."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timezone
import re

from bus_rig import booted, VirtualNetwork
from drive_samples import bus_config, drive_config, pdo, sdo_write, with_defaults
import pytest

from arm_canopen import CodecError, EventKind, Severity
from arm_canopen.can import Frame
from arm_canopen.config import NodeConfig
from arm_canopen.master.emergency_log import EmergencyLog
from arm_canopen.master.life_signs import Guarding
from arm_canopen.master.network import Network
from arm_canopen.master.status import node_status
from arm_canopen.standard import decode_time_of_day, Emergency, encode_time_of_day
from canopen_sim import Fault, FaultInjection

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


def test_a_device_without_heartbeat_is_guarded() -> None:
    """Every guard time; its answers keep it online and report its NMT state."""
    net = booted(guarded_config())
    net.run(1.0)
    node = net.network.nodes['a']
    questions = [sent.time for sent in net.wire.log if sent.frame.is_remote]
    assert node.online
    assert len(questions) == pytest.approx(1.0 / GUARD_TIME, abs=3)
    assert node.nmt_state is not None
    assert net.reported(Severity.WARNING) == []


def test_a_guarded_device_that_does_not_answer_is_lost_and_found() -> None:
    """After the retries, with the count in words; it is booted again when it is back."""
    net = booted(guarded_config())
    net.run(0.5)
    net.power_off('a')
    begin = net.now
    net.run_until(lambda: not net.network.nodes['a'].online)
    assert net.now - begin <= GUARD_TIME * 4 + 0.02
    assert any(
        'no answer to node guarding 3 times' in text for text in net.reported(Severity.ERROR)
    )
    net.power_on('a')
    net.run_until(lambda: net.network.nodes['a'].online)


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


def test_an_answer_that_is_repeated_is_none() -> None:
    """The toggle bit distinguishes a new answer from an old one."""
    requested: list[Frame] = []
    guarding = Guarding(5, 0.1, 2, requested.append)
    guarding.start(0.0)
    assert not guarding.advance(0.0)
    assert guarding.receive(b'\x05')
    assert not guarding.receive(b'\x05')
    assert guarding.receive(b'\x85')
    assert not guarding.advance(0.1)
    assert not guarding.receive(b'\x85')
    assert not guarding.advance(0.2)
    assert guarding.advance(0.31)
    assert requested == [Frame(0x705, is_remote=True)] * 3


def test_an_emergency_is_received_where_the_device_sends_it() -> None:
    """Under the identifier of 0x1014: as bus.yml writes it, else as the EDS has it."""
    written = drive_config('a', 2)
    written = replace(written, sdo_writes=(*written.sdo_writes, sdo_write(0x1014, 0, 0x0A2)))
    eds = drive_config('b', 3)
    eds = replace(eds, dictionary=with_defaults(eds.dictionary, {(0x1014, 0): 0x0B3}))
    silent = drive_config('c', 4)
    silent = replace(silent, dictionary=with_defaults(silent.dictionary, {(0x1014, 0): 1 << 31}))
    net = VirtualNetwork(bus_config(written, eds, silent), absent=['b', 'c'])
    for can_id in (0x0A2, 0x0B3, 0x084):
        net.network.receive(Frame(can_id, bytes.fromhex('10 23 01 00 00 00 00 00'), net.now))
    received = {
        name: node.emergencies.last is not None for name, node in net.network.nodes.items()
    }
    assert received == {'a': True, 'b': True, 'c': False}


@pytest.mark.parametrize('cob_id', [0x80, 0, 0x91])
def test_an_emergency_of_a_device_whose_eds_has_no_node_id_is_received(cob_id: int) -> None:
    """Where the device sends it: with its own node id, and never in the place of SYNC or NMT."""
    drive = drive_config('a', 2)
    written = with_defaults(drive.dictionary, {(0x1014, 0): cob_id})
    drive = replace(drive, dictionary=written.for_node(2))
    net = VirtualNetwork(bus_config(drive), dictionaries={'a': written})
    net.boot()
    device = net.simulated('a')
    device.raise_fault(0x2310, net.now)
    net.run(0.1)
    assert [emcy.code for _, emcy in net.network.nodes['a'].emergencies.history] == [0x2310]
    assert len(net.frames(0x082)) == 1
    net.network.receive(Frame(0x080, b'', net.now))
    assert any('somebody else sends SYNC' in text for text in net.reported())
    assert len(net.network.nodes['a'].emergencies.history) == 1


def test_an_error_that_is_over_or_old_is_not_of_now() -> None:
    """Of a fault, the EMCY that came with it counts."""
    log = EmergencyLog(lambda *_: None)
    assert log.since(0.0) is None
    log.receive(Frame(0x81, Emergency(0x2310, 1).encode(), timestamp=5.0))
    assert log.since(4.9) == Emergency(0x2310, 1)
    assert log.since(5.1) is None
    log.receive(Frame(0x81, Emergency(0, 0).encode(), timestamp=6.0))
    assert log.since(4.9) is None


def test_the_last_emergencies_are_remembered() -> None:
    """With their times, also after their end."""
    net = VirtualNetwork(bus_config(drive_config('a', 2)))
    for second, code in enumerate(('10 23', '00 00', '10 43')):
        data = bytes.fromhex(f'{code} 01 00 00 00 00 00')
        net.network.receive(Frame(0x082, data, net.now + second))
    history = net.network.nodes['a'].emergencies.history
    assert [emergency.code for _, emergency in history] == [0x2310, 0x0000, 0x4310]
    assert [time - net.now for time, _ in history] == [0.0, 1.0, 2.0]


@pytest.mark.parametrize('code', [0x0000, 0x2310], ids='code before 0x{:04X}'.format)
def test_a_flood_of_emergencies_is_reported_once_with_its_number(code: int) -> None:
    """Others are reported at once meanwhile, and the same one again when the flood was over."""
    net = booted(drive_config('a', 2))
    device, node = net.devices['a'], net.network.nodes['a']
    flood = FaultInjection(Fault.EMCY_FLOOD, delay=0.002)

    def reported(severity: Severity) -> list[str]:
        found = (event for event in net.events if event.kind is EventKind.EMERGENCY)
        return [event.text for event in found if event.severity is severity]

    device.faults.inject(flood, net.now)
    net.run(5.0)
    assert [text[:12] for text in reported(Severity.ERROR)] == ['EMCY: 0x1000']
    assert device.drive is not None
    device.drive.raise_fault(0x4310, net.now)
    if code:
        device.drive.raise_fault(code, net.now)
    net.run(25.0)
    others = ['EMCY: 0x4310', f'EMCY: 0x{code:04X}'] if code else ['EMCY: 0x4310']
    assert [text[:12] for text in reported(Severity.ERROR)] == ['EMCY: 0x1000', *others]
    counts = reported(Severity.WARNING)
    assert len(counts) == 2, counts
    assert re.match(r'EMCY: 5\d\d\d more in 10 s \(2\d\d\d x 0x\w{4} ', counts[0]), counts
    assert len(node.emergencies.history) == 1 + len(others)
    assert len(node_status(node, net.now).emergencies) == len(node.emergencies.history)

    device.faults.end(net.now)
    net.run(15.0)
    last = reported(Severity.WARNING)[2:]
    assert len(last) == 1
    device.faults.inject(flood, net.now)
    net.run(0.1)
    assert len(reported(Severity.ERROR)) == 2 + len(others)


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
    for handler in (0x382,):
        net.network._handlers[handler] = lambda frame: None
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


def test_a_time_that_does_not_fit_is_refused() -> None:
    """Before 1984 there is none."""
    with pytest.raises(CodecError, match='1983'):
        encode_time_of_day(datetime(1983, 12, 31, tzinfo=timezone.utc))
    with pytest.raises(CodecError, match='6 bytes'):
        decode_time_of_day(b'')
