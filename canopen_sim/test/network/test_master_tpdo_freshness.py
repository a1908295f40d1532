# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""TPDOs that come on change: their loss is noticed by an event timer, or it is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re
import struct

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, DRIVE_EDS, SCALE, with_defaults
import pytest

from arm_canopen import DriveState, OperationMode, RefusalCause, Severity
from arm_canopen.config import BusConfig, load_bus, NodeConfig
from arm_canopen.config.model import Place
from arm_canopen.config.model.boot_plan import boot_writes
from arm_canopen.config.model.checks import check_bus
from arm_canopen.config.model.tpdo_freshness import with_event_timer
from arm_canopen.master.process_image import ReceivedTpdo, SyncRound
from arm_canopen.standard import ObjectDictionary
from canopen_sim import Drive as SimulatedDrive
from canopen_sim import Fault, FaultInjection

JOINT, NODE_ID = 'joint1', 2
TPDOS = {0x180 + NODE_ID, 0x280 + NODE_ID}
STREAMED = pytest.mark.parametrize(
    'mode',
    [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION],
    ids=lambda m: m.name,
)


def on_change(transmission: int = 255, *, timer: bool = True) -> NodeConfig:
    """Return a drive whose TPDOs come on change, with or without event timers in its EDS."""
    config = drive_config(JOINT, NODE_ID)
    entries = [
        entry
        for entry in config.dictionary
        if timer or not (entry.subindex == 5 and 0x1800 <= entry.index < 0x1A00)
    ]
    dictionary = ObjectDictionary(entries)
    tpdos = tuple(
        with_event_timer(replace(tpdo, transmission=transmission), dictionary)
        for tpdo in config.tpdos
    )
    return replace(config, tpdos=tpdos, dictionary=dictionary)


class Blind:
    """A drive in motion in a cyclic mode."""

    def __init__(self, config: NodeConfig, mode: OperationMode) -> None:
        """Let it move at 1 rad/s."""
        self.net = VirtualNetwork(bus_config(config))
        self.net.boot()
        self.net.do(JOINT, 'init')
        self.net.select(JOINT, mode)
        self.net.commands[JOINT].set_target(50.0)
        self.net.run(0.8)
        assert self.device.velocity / SCALE == pytest.approx(1.0, rel=0.05)

    @property
    def device(self) -> SimulatedDrive:
        """The simulated drive."""
        drive = self.net.devices[JOINT].drive
        assert drive is not None
        return drive

    def lose_tpdos(self) -> list[float]:
        """Lose them for two seconds; return the velocities meanwhile in [rad/s]."""
        self.net.wire.loses = lambda sender, frame: frame.can_id in TPDOS
        found = []
        for _ in range(200):
            self.net.run(0.01)
            found.append(self.device.velocity / SCALE)
        return found


@STREAMED
def test_a_drive_whose_tpdos_stop_to_come_on_change_is_not_fresh(mode: OperationMode) -> None:
    """It is halted on its own ramp, as one that answers SYNC; at rest it stays fresh."""
    blind = Blind(on_change(), mode)
    velocities = blind.lose_tpdos()
    assert min(velocities) > -0.02  # it is not thrown back to where it was seen last
    assert velocities[-1] == pytest.approx(0.0, abs=1e-3)
    refusal = blind.net.drives[JOINT].control.refusal
    assert refusal is not None
    assert refusal.cause is RefusalCause.SILENT
    blind.net.wire.loses = lambda sender, frame: False
    blind.net.run(3.0)
    assert blind.net.drives[JOINT].control.accepts_targets
    assert not [text for text in blind.net.reported(Severity.WARNING) if 'nobody notices' in text]


@STREAMED
@pytest.mark.parametrize(
    'config', [on_change(timer=False), on_change(0)], ids=['no timer', 'type 0']
)
def test_an_axis_is_not_held_at_a_position_of_unknown_age(
    config: NodeConfig, mode: OperationMode
) -> None:
    """Where nothing shows that it is old, the drive is stopped by its own ramp, and disabled."""
    blind = Blind(config, mode)
    (warning,) = [
        text for text in blind.net.reported(Severity.WARNING) if 'nobody notices' in text
    ]
    assert 'TPDO 1, 2' in warning
    velocities = blind.lose_tpdos()
    assert min(velocities) > -0.02
    assert velocities[-1] == pytest.approx(0.0, abs=1e-3)
    blind.net.run(5.0)
    assert blind.device.state is DriveState.SWITCH_ON_DISABLED


def test_a_device_that_refuses_its_event_timer_is_named() -> None:
    """It boots, and is not taken for silent when it only rests."""
    without = on_change(timer=False).dictionary
    config = replace(bus_config(on_change()), locations={(JOINT,): Place()})
    net = VirtualNetwork(config, dictionaries={JOINT: without})
    net.boot()
    net.run(2.0)
    assert net.drives[JOINT].view.fresh
    warnings = [text for text in net.reported(Severity.WARNING) if 'nobody notices' in text]
    assert len(warnings) == 1
    net.power_off(JOINT)
    net.run(0.5)
    net.power_on(JOINT)
    net.run_until(net.all_ready)
    assert len([text for text in net.reported() if 'nobody notices' in text]) == 1


def test_a_timer_that_is_taken_at_the_next_boot_counts_again() -> None:
    """The loss is noticed from then on, and a device that refuses it once more is named again."""
    net = VirtualNetwork(replace(bus_config(on_change()), locations={(JOINT,): Place()}))
    refused = FaultInjection(Fault.SDO_ABORT, object=(0x1800, 5), abort=0x06090030)
    net.start()
    for refuses in (True, False, True):
        begin = len(net.reported(Severity.WARNING))
        net.power_off(JOINT)
        net.run(0.5)
        device = net.power_on(JOINT)
        if refuses:
            device.faults.inject(refused, net.now)
        net.run_until(net.all_ready)
        reported = net.reported(Severity.WARNING)[begin:]
        assert any('TPDO 1: nobody notices' in text for text in reported) is refuses
        net.run(2.0)
        assert net.drives[JOINT].view.fresh
        net.wire.loses = lambda sender, frame: frame.can_id == 0x180 + NODE_ID
        net.run(1.0)
        assert net.drives[JOINT].view.fresh is refuses
        net.wire.loses = lambda sender, frame: False


@pytest.mark.parametrize(
    ('timer', 'inhibit', 'expected'),
    [(0, 0, 0.1), (50, 0, 0.05), (10_000, 0, 0.1), (10_000, 2000, 0.4), (50, 2000, 0.4)],
)
def test_the_timer_of_the_eds_is_no_longer_than_ours(
    timer: int, inhibit: int, expected: float
) -> None:
    """A loss is noticed after 0.3 s, unless the device sends less often (0x1800:03 in 0.1 ms)."""
    config, defaults = drive_config(JOINT, NODE_ID), {(0x1800, 5): timer, (0x1800, 3): inhibit}
    dictionary = with_defaults(config.dictionary, defaults)
    tpdo = replace(config.tpdos[0], transmission=255)
    assert with_event_timer(tpdo, dictionary).event_time == pytest.approx(expected)


def test_a_drive_in_operation_is_taken_over_and_gets_its_event_timer() -> None:
    """Its PDOs are those of the bus.yml all the same; its loss is noticed from then on."""
    timed = replace(on_change(), reset_communication=False)
    untimed = tuple(replace(tpdo, event_time=None) for tpdo in timed.tpdos)
    net = VirtualNetwork(bus_config(replace(timed, tpdos=untimed)))
    net.boot()
    net.do(JOINT, 'init')
    net._config = replace(bus_config(timed), locations={(JOINT,): Place()})
    net.replace_master()
    net.start()
    net.run(2.0)
    assert net.network.nodes[JOINT].taken_over
    assert net.drives[JOINT].view.fresh
    net.wire.loses = lambda sender, frame: frame.can_id in TPDOS
    net.run(1.0)
    assert not net.drives[JOINT].view.fresh


def loaded(
    tmp_path: Path, tpdos: str, sync_period: int = 10_000, *, eds: Path | str = DRIVE_EDS
) -> BusConfig:
    """Return the bus of a drive with these TPDOs, and a time between two SYNCs in [us]."""
    file = tmp_path / 'bus.yml'
    master = f'{{node_id: 1, driver: ros2_canopen::MasterDriver, sync_period: {sync_period}}}'
    file.write_text(
        f'master: {master}\n'
        f'joint1:\n  node_id: 2\n  dcf: {eds}\n'
        f'  driver: ros2_canopen::Cia402Driver\n{tpdos}'
    )
    return load_bus(file)


@pytest.mark.parametrize(
    ('keys', 'time'),
    [
        ('transmission: 255', 0.1),
        ('transmission: 254, inhibit_time: 2000', 0.4),
        ('transmission: 255, event_timer: 30', 0.03),
        ('transmission: 255, event_timer: 0', 0.0),
        ('transmission: 0', None),
        ('transmission: 1', None),
    ],
)
def test_the_event_timer_by_default(tmp_path: Path, keys: str, time: float | None) -> None:
    """It is set where it is needed and nobody has chosen, and tried only."""
    bus = loaded(tmp_path, f'  tpdo:\n    1: {{{keys}}}\n')
    (node,) = bus.nodes
    assert node.tpdos[0].event_time == time
    writes = [write for write in boot_writes(bus, node) if write.address == (0x1800, 5)]
    assert [struct.unpack('<H', write.data)[0] / 1000 for write in writes] == (
        [] if time is None else [time]
    )
    assert [write.requested for write in writes] == ['event_timer' in keys] * len(writes)


@pytest.mark.parametrize('sync_period', [10_000, 0])
@pytest.mark.parametrize(
    ('keys', 'lossy', 'lossy_without_sync'),
    [
        ('transmission: 255', False, False),
        ('transmission: 255, event_timer: 0', True, True),
        ('transmission: 0', True, True),
        ('transmission: 1', False, True),
        ('from EDS: 252', True, True),
        ('from EDS: 253', True, True),
    ],
)
def test_check_and_boot_name_what_may_get_lost(
    tmp_path: Path, keys: str, sync_period: int, *, lossy: bool, lossy_without_sync: bool
) -> None:
    """The one before anything runs, at the place of the key, the other when it does."""
    if keys.startswith('from EDS'):
        eds = DRIVE_EDS.read_text().split('[1800sub2]')
        eds[1] = re.sub('DefaultValue=.*', f'DefaultValue={keys[-3:]}', eds[1], count=1)
        (tmp_path / 'other.eds').write_text('[1800sub2]'.join(eds))
        bus = loaded(tmp_path, '', sync_period, eds='other.eds')
    else:
        bus = loaded(tmp_path, f'  tpdo:\n    1: {{{keys}}}\n', sync_period)
    found = [str(problem) for problem in check_bus(bus).warnings]
    expected = lossy if sync_period else lossy_without_sync
    assert any('when TPDO 1 gets lost' in text for text in found) is expected
    sync = SyncRound(lambda: None, period=bus.master.sync_period)
    assert ReceivedTpdo(bus.nodes[0].tpdos[0], sync).loss_unnoticed is expected
