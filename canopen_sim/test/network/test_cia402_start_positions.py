# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Drives that stand somewhere at power-on: the master knows where, and nothing moves unasked."""

from __future__ import annotations

from pathlib import Path

from bus_rig import VirtualNetwork
from drive_samples import DRIVE_EDS
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import BusConfig, CanopenError, OperationMode
from arm_canopen.config import load_bus
from canopen_sim import DeviceHost
from canopen_sim.simulation import add_devices

pytestmark = pytest.mark.slow

JOINT, PLACE = 'joint1', -1.25
TWO_AXES = DRIVE_EDS.with_name('cia402_two_axes.eds')
SCALES = {
    'default': '',
    'scale': 'scale_pos_to_dev: 57295.78, scale_pos_from_dev: 1.745329e-5,',
    'turned': 'scale_pos_to_dev: -2000, scale_pos_from_dev: -0.0005,',
    'offset': 'offset_pos_to_dev: 300, offset_pos_from_dev: -0.3,',
    'factor group': 'scale_from_factor_group: true,',
    'factor group of bus.yml': 'scale_from_factor_group: true, '
    'sdo: [{index: 0x6092, sub_index: 1, value: 3141592}],',
}
MODES = [
    OperationMode.PROFILE_POSITION,
    OperationMode.PROFILE_VELOCITY,
    OperationMode.VELOCITY,
    OperationMode.INTERPOLATED_POSITION,
    OperationMode.CYCLIC_POSITION,
    OperationMode.CYCLIC_VELOCITY,
]


def bus_of(folder: Path, keys: str = '', eds: Path = DRIVE_EDS) -> BusConfig:
    """Write and read a bus with one drive."""
    path = folder / 'bus.yml'
    path.write_text(f"""
master: {{node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}}
{JOINT}:
  {{{keys} node_id: 2, driver: "ros2_canopen::Cia402Driver", dcf: {eds},
  heartbeat_producer: 100, tpdo: {{
    1: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6041}}, {{index: 0x6061}}]}},
    2: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6064}}, {{index: 0x606C}}]}}}},
  rpdo: {{
    1: {{cob_id: auto, mapping: [{{index: 0x6040}}, {{index: 0x6060}}]}},
    2: {{cob_id: auto, mapping: [{{index: 0x607A}}, {{index: 0x60FF}}]}},
    3: {{cob_id: auto, mapping: [{{index: 0x60C1, sub_index: 1}}]}}}}}}
""")
    return load_bus(path)


def network(bus: BusConfig, positions: dict[str, float]) -> VirtualNetwork:
    """Return a booted network whose drives stood at positions when they got power."""
    host = DeviceHost(lambda frame: None)
    add_devices(host, bus, positions)
    net = VirtualNetwork(bus)
    for node in bus.nodes:
        places = [drive.position for drive in host.device(node.node_id).drives]
        for drive, place in zip(net.devices[node.name].drives, places, strict=True):
            drive.count_from(place)
    net.boot()
    return net


@pytest.mark.parametrize('keys', SCALES.values(), ids=SCALES)
def test_the_master_reads_the_position_in_the_units_of_bus_yml(tmp_path: Path, keys: str) -> None:
    """Whatever scales it; an SDO that changes the factor group counts, too."""
    bus = bus_of(tmp_path, keys)
    net = network(bus, {JOINT: PLACE})
    net.run(0.2)
    assert net.drives[JOINT].view.position == pytest.approx(PLACE, abs=1e-3)
    assert net.devices[JOINT].drives[0].position != 0.0


@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_nothing_moves_when_a_drive_is_enabled_there(tmp_path: Path, mode: OperationMode) -> None:
    """In no mode; and after a target it is at the target."""
    net = network(bus_of(tmp_path), {JOINT: PLACE})
    net.do(JOINT, 'init')
    net.select(JOINT, mode)
    net.run(0.5)
    assert net.devices[JOINT].drives[0].position == pytest.approx(1000 * PLACE, abs=0.01)
    if mode in {OperationMode.PROFILE_POSITION, OperationMode.CYCLIC_POSITION}:
        net.commands[JOINT].set_target(PLACE + 0.01)
        net.run(2.0)
        assert net.drives[JOINT].view.position == pytest.approx(PLACE + 0.01, abs=1e-3)


@pytest.mark.parametrize(('method', 'moves'), [(19, True), (35, False)])
def test_homing_begins_there(tmp_path: Path, method: int, moves: bool) -> None:
    """Home is where the switch is, or where the drive is; it is 0 afterwards, as without."""
    writes = (
        f'{{index: 0x6098, sub_index: 0, value: {method}}}, '
        '{index: 0x6099, sub_index: 1, value: 1000}, {index: 0x6099, sub_index: 2, value: 200}, '
        '{index: 0x609A, sub_index: 0, value: 20000}'
    )
    net = network(bus_of(tmp_path, f'sdo: [{writes}],'), {JOINT: PLACE})
    drive = net.devices[JOINT].drives[0]
    start = drive.position - drive.origin
    net.do(JOINT, 'init')
    net.do(JOINT, 'home')
    net.run(0.2)
    assert net.drives[JOINT].view.position == pytest.approx(0.0, abs=2e-3)
    assert (abs(drive.position - drive.origin - start) > 100) is moves


def test_it_stays_over_a_loss_of_power_with_an_absolute_encoder(tmp_path: Path) -> None:
    """One that counts begins with 0."""
    device = network(bus_of(tmp_path), {JOINT: PLACE}).devices[JOINT]
    for kept, place in ((True, 1000 * PLACE), (False, 0.0)):
        device.switch_off(30.0)
        device.switch_on(30.0, position_kept=kept)
        assert device.drives[0].position == place


def test_each_axis_of_a_device_has_its_own(tmp_path: Path) -> None:
    """By the name of its channel; one that is not given reports 0."""
    keys = 'num_channels: 2, channel_names: [table_x, table_y],'
    net = network(bus_of(tmp_path, keys, TWO_AXES), {'table_y': 0.5})
    assert [drive.position for drive in net.devices[JOINT].drives] == [0.0, 500.0]


@given(st.floats(-2e6, 2e6))
def test_any_position_is_met_within_half_an_increment(place: float) -> None:
    """Up to the range of 0x6064."""
    host = DeviceHost(lambda frame: None)
    add_devices(host, _article(), {'panda_joint1': place})
    assert host.devices[0].drives[0].position / 1000 == pytest.approx(place, abs=0.5001e-3)


def _article() -> BusConfig:
    return load_bus(Path(__file__).parents[3] / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml')


@pytest.mark.parametrize(
    ('positions', 'words'),
    [
        ({'joint7': 0.1}, "no drive 'joint7' in .*bus.yml; drives: joint1"),
        ({JOINT: float('nan')}, 'joint1: position nan'),
        ({JOINT: 3e6}, r'joint1: position 3e\+06 is 3e\+09 increments'),
    ],
)
def test_what_no_drive_can_report_is_refused(
    tmp_path: Path, positions: dict[str, float], words: str
) -> None:
    """With name and value."""
    with pytest.raises(CanopenError, match=words):
        add_devices(DeviceHost(lambda frame: None), bus_of(tmp_path), positions)
