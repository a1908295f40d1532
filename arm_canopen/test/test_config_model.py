# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the keys of a bus.yml become in the model."""

from __future__ import annotations

from dataclasses import fields, MISSING
from operator import attrgetter
from pathlib import Path
from typing import Any

from config_cases import added
from config_samples import (
    BUS,
    DRIVE_ROWS,
    eds_text,
    errors_of,
    load_text,
    Row,
    TWO_AXES_EDS,
    write_bus,
)
import pytest

from arm_canopen import ConfigError, DriveState
from arm_canopen.config import Identity, load_eds, MasterConfig, NodeConfig, PdoConfig
from arm_canopen.config.model.drive import RecoveryPolicy
from arm_canopen.config.sections import DeviceSettings, MasterSettings
from arm_canopen.standard import DataType


@pytest.mark.parametrize(
    ('piece', 'attribute', 'value'),
    [
        ('namespace: left/arm', 'namespace', 'left/arm'),
        ('remappings: {joint_states: js}', 'remappings', {'joint_states': 'js'}),
        ('mandatory: true', 'mandatory', True),
        ('boot: false', 'boot', False),
        ('restore_configuration: 1', 'restore_configuration', 1),
        ('retry_factor: 5', 'retry_factor', 5),
        ('life_time_factor: 4', 'life_time_factor', 4),
        ('heartbeat_producer: 50', 'uses_node_guarding', False),
        ('reset_communication: false', 'reset_communication', False),
        ('sdo_timeout_ms: 50', 'sdo_timeout', 0.05),
        ('boot_timeout_ms: 2500', 'boot_timeout', 2.5),
        ('period: 40', 'poll_period', 0.04),
        ('heartbeat_producer: 50', 'heartbeat_producer', 0.05),
        ('heartbeat_producer: 50', 'heartbeat_timeout', pytest.approx(0.15)),
        ('heartbeat_producer: 50\nheartbeat_multiplier: 2', 'heartbeat_timeout', 0.1),
        ('heartbeat_producer: 0', 'heartbeat_timeout', 0.0),
        ('heartbeat_consumer: false', 'heartbeat_consumer', False),
        ('heartbeat_consumer: true', 'heartbeat_consumer', True),
        ('revision_number: 0', 'identity.revision_number', 0),
        ('revision_number: 0x10002', 'identity.revision_number', 0x10002),
        ('serial_number: 77', 'identity.serial_number', 77),
        ('scale_pos_to_dev: 2\nscale_pos_from_dev: 0.5', 'drive.scale_pos_to_dev', 2.0),
        ('scale_vel_to_dev: 2\nscale_vel_from_dev: 0.5', 'drive.scale_vel_from_dev', 0.5),
        ('scale_eff_from_dev: 0.5\nscale_eff_to_dev: 2', 'drive.scale_eff_from_dev', 0.5),
        ('effort_mode: 4', 'drive.scale_eff_from_dev', 1.0),
        ('scale_eff_to_dev: 8', 'drive.scale_eff_from_dev', 0.125),
        ('offset_pos_from_dev: -1', 'drive.offset_pos_from_dev', -1.0),
        ('switching_state: 2', 'drive.switching_state', DriveState.SWITCH_ON_DISABLED),
        ('homing_timeout_seconds: 30', 'drive.homing_timeout', 30.0),
        ('position_mode: 8', 'drive.position_mode', 8),
        ('velocity_mode: 3', 'drive.velocity_mode', 3),
        ('effort_mode: 10', 'drive.effort_mode', 10),
        ('scale_eff_to_dev: 20', 'drive.scale_eff_to_dev', 20.0),
        ('target_timeout_ms: 50', 'drive.target_timeout', 0.05),
        ('recovery: auto', 'drive.recovery', RecoveryPolicy.AUTO),
        ('quirks: festo_cmmp', 'drive.quirks', 'festo_cmmp'),
        ('offset_pos_to_dev: 1', 'drive.scale_from_factor_group', False),
        ('offset_pos_to_dev: 1', 'drive.scale_pos_to_dev', 1000.0),
        ('scale_from_factor_group: true', 'drive.scale_from_factor_group', True),
    ],
)
def test_keys_of_a_device(tmp_path: Path, piece: str, attribute: str, value: object) -> None:
    """Each key fills its attribute, times in seconds."""
    (node,) = load_text(tmp_path, added('joint1', piece)).nodes
    assert attrgetter(attribute)(node) == value


@pytest.mark.parametrize(
    ('piece', 'attribute', 'value'),
    [
        ('namespace: /cell', 'namespace', '/cell'),
        ('remappings: {a: b}', 'remappings', {'a': 'b'}),
        ('baudrate: 125', 'bitrate', 125_000),
        ('sync_period: 5000', 'sync_period', 0.005),
        ('sync_window: 2000', 'sync_window', 0.002),
        ('start: false', 'start', False),
        ('start_all_nodes: true', 'start_all_nodes', True),
        ('reset_all_nodes: true', 'reset_all_nodes', True),
        ('stop_all_nodes: true', 'stop_all_nodes', True),
        ('boot_time: 2000', 'boot_time', 2.0),
        ('nmt_inhibit_time: 50', 'nmt_inhibit_time', 0.005),
        ('time_cob_id: 0x40000100', 'time_period', 1.0),
        ('time_cob_id: 0x80000100', 'time_period', 0.0),
        ('time_period_ms: 500', 'time_period', 0.5),
        ('time_period_ms: 500', 'time_cob_id', 0x40000100),
        ('sync_period: 5000', 'cycle_period', 0.005),
        ('sync_overflow: 240', 'sync_overflow', 240),
        ('sync_overflow: 0', 'sync_overflow', 0),
        ('start_nodes: false', 'start_nodes', False),
        ('boot_timeout: 500', 'boot_timeout', 0.5),
        ('heartbeat_producer: 0', 'heartbeat_timeout', 0.0),
        ('heartbeat_producer: 100', 'heartbeat_timeout', pytest.approx(0.3)),
        ('heartbeat_producer: 100\nheartbeat_multiplier: 5', 'heartbeat_timeout', 0.5),
    ],
)
def test_keys_of_the_master(tmp_path: Path, piece: str, attribute: str, value: object) -> None:
    """Each key fills its attribute, times in seconds."""
    master = load_text(tmp_path, added('master', piece)).master
    assert attrgetter(attribute)(master) == value


def test_supervision_of_heartbeats(tmp_path: Path) -> None:
    """The options' multiplier counts for all; the master may leave the supervision out."""
    text = added('joint1', 'heartbeat_producer: 100')
    options = 'options: {heartbeat_multiplier: 10}\n'
    assert load_text(tmp_path, options + text).nodes[0].heartbeat_timeout == 1.0
    unwatched = text.replace('  node_id: 1', '  node_id: 1\n  heartbeat_consumer: false')
    (node,) = load_text(tmp_path, unwatched).nodes
    assert (node.heartbeat_producer, node.heartbeat_timeout) == (0.1, 0.0)


def test_the_eds_gives_the_heartbeat_when_bus_yml_does_not(tmp_path: Path) -> None:
    """A producer time in the EDS is supervised, too."""
    name = 'Producer heartbeat time\nDataType=0x0006\nAccessType=rw\nDefaultValue='
    eds = eds_text().replace(f'{name}0', f'{name}250')
    (node,) = load_text(tmp_path, eds=eds).nodes
    assert (node.heartbeat_producer, node.heartbeat_timeout) == (0.25, 0.75)


def test_a_fixed_heartbeat_cannot_be_changed(tmp_path: Path) -> None:
    """A device whose 0x1017 is read-only keeps the period of its EDS, and no other is taken."""
    head = 'Producer heartbeat time\nDataType=0x0006\nAccessType='
    eds = eds_text().replace(f'{head}rw\nDefaultValue=0', f'{head}ro\nDefaultValue=250')
    text = added('joint1', 'heartbeat_producer: 250')
    assert load_text(tmp_path, text, eds=eds).nodes[0].heartbeat_producer == 0.25
    (problem,) = errors_of(write_bus(tmp_path, text.replace('250', '100'), eds=eds))
    assert problem.key == 'nodes.joint1.heartbeat_producer'
    assert 'fixed at 250 ms' in problem.message


def test_devices_watch_the_master_where_they_can(tmp_path: Path) -> None:
    """By default a device with 0x1016 watches, one without does not, none without a heartbeat."""
    assert load_text(tmp_path).nodes[0].heartbeat_consumer
    without = eds_text().replace('[1016', '[2F16')
    assert not load_text(tmp_path, eds=without).nodes[0].heartbeat_consumer
    silent = added('master', 'heartbeat_producer: 0')
    assert not load_text(tmp_path, silent).nodes[0].heartbeat_consumer


def test_the_identity_is_that_of_the_eds(tmp_path: Path) -> None:
    """Type, vendor and product are checked; revision and serial only if bus.yml names them."""
    assert load_text(tmp_path).nodes[0].identity == Identity(0x0002_0192, 0x555, 7)
    unknown = eds_text().replace('DefaultValue=0x555', 'DefaultValue=0')
    assert load_text(tmp_path, eds=unknown).nodes[0].identity.vendor_id == 0


def test_the_node_id_may_come_from_a_dcf(tmp_path: Path) -> None:
    """A DCF gives the node id when bus.yml does not, as with dcfgen; bus.yml wins."""
    dcf = f'{eds_text()}\n[DeviceComissioning]\nNodeID=9\n'
    text = BUS.replace('    node_id: 2', '    mandatory: false')
    (node,) = load_text(tmp_path, text, eds=dcf).nodes
    assert node.node_id == 9
    assert node.tpdos[0].cob_id == 0x189
    assert load_text(tmp_path, eds=dcf).nodes[0].node_id == 2


def test_the_cycle_without_sync_is_the_shortest_period(tmp_path: Path) -> None:
    """Without SYNC the devices' periods decide, 10 ms when none gives one."""
    silent = BUS.replace('  sync_period: 10000\n', '')
    assert load_text(tmp_path, silent).master.cycle_period == 0.01
    text = f'{silent}    period: 20\n  joint2: {{node_id: 3, period: 5}}\n'
    bus = load_text(tmp_path, text)
    assert (bus.master.cycle_period, bus.master.sync_period) == (0.005, 0.0)


def pdos(folder: Path, piece: str) -> tuple[tuple[PdoConfig, ...], tuple[PdoConfig, ...]]:
    """Load the sample with a piece added to its device."""
    (node,) = load_text(folder, added('joint1', piece)).nodes
    return node.tpdos, node.rpdos


TWO_AXES = """
    num_channels: 2
    channel_names: [shoulder, elbow]
    channels: [{scale_pos_to_dev: 2, scale_pos_from_dev: 0.5}, {offset_pos_to_dev: 7}]
    homing_timeout_seconds: 3
"""


def test_a_drive_with_two_axes(tmp_path: Path) -> None:
    """Each channel has its name and its own factors; the rest counts for all of them."""
    eds = TWO_AXES_EDS.read_text()
    (node,) = load_text(tmp_path, added('joint1', TWO_AXES), eds=eds).nodes
    assert [(axis.name, axis.channel) for axis in node.axes] == [('shoulder', 0), ('elbow', 1)]
    assert [axis.scale_pos_to_dev for axis in node.axes] == [2.0, 1000.0]
    assert [axis.scale_from_factor_group for axis in node.axes] == [False, False]
    assert [axis.offset_pos_to_dev for axis in node.axes] == [0.0, 7.0]
    assert {axis.homing_timeout for axis in node.axes} == {3.0}
    unnamed = load_text(tmp_path, added('joint1', 'num_channels: 2'), eds=eds)
    assert unnamed.joints == unnamed.node('joint1').joints == ('joint1_0', 'joint1_1')


@pytest.mark.parametrize('name', ['left arm', '1st', ''])
def test_a_channel_has_a_name_that_a_ros_node_can_have(tmp_path: Path, name: str) -> None:
    """As its device must; each axis gets a node of that name."""
    text = added('joint1', f"num_channels: 2\nchannel_names: [elbow, '{name}']")
    (error,) = errors_of(write_bus(tmp_path, text, eds=TWO_AXES_EDS.read_text()))
    assert 'is no name for a ROS node' in error.message


def test_two_devices_have_no_axis_of_one_name(tmp_path: Path) -> None:
    """Each axis is a joint, with a node of its own."""
    text = added('joint1', 'num_channels: 2\nchannel_names: [joint2, elbow]')
    text += '  joint2: {node_id: 5}\n'
    errors = errors_of(write_bus(tmp_path, text, eds=TWO_AXES_EDS.read_text()))
    assert ["both have an axis 'joint2'" in error.message for error in errors] == [True]


def test_all_pdos_of_the_eds_appear(tmp_path: Path) -> None:
    """PDOs that bus.yml does not name are as the EDS says; those that it names are configured."""
    tpdos, rpdos = pdos(tmp_path, '')
    for group, base in ((tpdos, 0x180), (rpdos, 0x200)):
        assert [pdo.number for pdo in group] == [1, 2, 3, 4, 5, 6]
        assert [pdo.configured for pdo in group] == [True] + [False] * 5
        assert [pdo.enabled for pdo in group] == [True, True] + [False] * 4
        assert [pdo.cob_id for pdo in group[:4]] == [base + 0x100 * n + 2 for n in range(4)]
        assert all(pdo.inhibit_time is pdo.sync_start is None for pdo in group)
    assert [pdo.event_time for pdo in tpdos] == [0.1] + [None] * 5  # state, on change
    assert all(pdo.event_time is None for pdo in rpdos)


def test_parameters_of_a_pdo(tmp_path: Path) -> None:
    """Times are in seconds; what bus.yml does not name stays with the device."""
    piece = """
        tpdo:
          1: {inhibit_time: 15, event_timer: 100, sync_start: 3, transmission: 240}
        rpdo:
          1: {event_deadline: 50, cob_id: 0x333}
    """
    tpdos, rpdos = pdos(tmp_path, piece)
    assert tpdos[0].inhibit_time == 0.0015
    assert tpdos[0].event_time == 0.1
    assert tpdos[0].sync_start == 3
    assert tpdos[0].transmission == 240
    assert rpdos[0].event_time == 0.05
    assert rpdos[0].cob_id == 0x333
    assert rpdos[0].transmission == 255


def test_mappings_have_the_types_of_the_eds(tmp_path: Path) -> None:
    """Bits come from the EDS; RPDOs take gaps."""
    piece = """
        tpdo: {1: {mapping: [{index: 0x2003}, {index: 0x6061}, {index: 0x6041}]}}
        rpdo: {1: {mapping: [{index: 0x0005}, {index: 0x6040}, {index: 0x0004}]}}
    """
    tpdos, rpdos = pdos(tmp_path, piece)
    types = [mapped.data_type for mapped in tpdos[0].mapping]
    assert types == [DataType.BOOLEAN, DataType.INTEGER8, DataType.UNSIGNED16]
    gaps = [(mapped.index, mapped.data_type) for mapped in rpdos[0].mapping]
    assert gaps == [
        (5, DataType.UNSIGNED8),
        (0x6040, DataType.UNSIGNED16),
        (4, DataType.INTEGER32),
    ]


def test_free_identifiers_are_given_to_pdos_from_the_fifth_on(tmp_path: Path) -> None:
    """``auto`` gives PDO 5 and more 0x680 and up, in the order of the file, around taken ones."""
    five = '{cob_id: auto, mapping: [{index: 0x6041}]}'
    piece = f'tpdo: {{5: {five}, 6: {five}}}\nrpdo: {{1: {{cob_id: 0x681}}}}'
    text = added('joint1', piece)
    text += f'  joint2: {{node_id: 3, tpdo: {{5: {five}, 6: {{enabled: false, cob_id: auto}}}}}}\n'
    bus = load_text(tmp_path, text)
    assert [node.tpdos[4].cob_id for node in bus.nodes] == [0x680, 0x683]
    assert bus.nodes[0].tpdos[5].cob_id == 0x682
    assert not bus.nodes[1].tpdos[5].enabled


def fixed_tpdos() -> str:
    """Write an EDS whose TPDOs always carry the statusword."""
    head, mark, tail = eds_text().partition('[1A00]')
    count = 'ParameterName=Number of objects\nDataType=0x0005\nAccessType='
    first = 'ParameterName=Object 1\nDataType=0x0007\nAccessType='
    tail = tail.replace(f'{count}rw\nDefaultValue=0', f'{count}const\nDefaultValue=1')
    tail = tail.replace(f'{first}rw\nDefaultValue=0', f'{first}const\nDefaultValue=0x60410010')
    return head + mark + tail


def test_a_fixed_mapping_is_kept(tmp_path: Path) -> None:
    """A device whose mapping is read-only is used with it, and marked so."""
    (node,) = load_text(tmp_path, eds=fixed_tpdos()).nodes
    assert [pdo.fixed_mapping for pdo in node.tpdos] == [True] * 6
    assert [pdo.fixed_mapping for pdo in node.rpdos] == [False] * 6
    assert {mapped.word for pdo in node.tpdos for mapped in pdo.mapping} == {0x6041_0010}


def test_a_fixed_mapping_cannot_be_changed(tmp_path: Path) -> None:
    """Wanting another one than the device has is refused."""
    text = added('joint1', 'tpdo: {1: {mapping: [{index: 0x6064}]}}')
    (problem,) = errors_of(write_bus(tmp_path, text, eds=fixed_tpdos()))
    assert 'the mapping of TPDO 1 of joint1 is fixed' in problem.message


def test_an_eds_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Seven devices that share an EDS cost one reading."""
    reads: list[Path] = []

    def counted(path: Path) -> object:
        reads.append(path)
        return load_eds(path)

    monkeypatch.setattr('arm_canopen.config.resolve.eds_files.load_eds', counted)
    text = BUS + ''.join(f'  joint{n}: {{node_id: {n + 1}}}\n' for n in range(2, 8))
    assert len(load_text(tmp_path, text).nodes) == 7
    assert len(reads) == 1


def test_the_line_of_a_device_is_that_of_its_name(tmp_path: Path) -> None:
    """Nodes log where they are configured."""
    path = write_bus(tmp_path)
    (node,) = load_text(tmp_path).nodes
    assert isinstance(node, NodeConfig)
    assert path.read_text('utf-8').splitlines()[node.line - 1] == '  joint1:'


def test_a_device_without_heartbeat_is_guarded(tmp_path: Path) -> None:
    """bus.yml says how often, else the EDS does; an EDS without 0x100C refuses it."""
    rows = [*DRIVE_ROWS, Row(0x100C, 0, 'Guard time', 6, 'rw', '50')]
    text = added('joint1', 'heartbeat_producer: 0\nguard_time: 150')
    (node,) = load_text(tmp_path, text, eds=eds_text(rows)).nodes
    assert (node.guard_time, node.uses_node_guarding) == (0.15, True)
    text = added('joint1', 'heartbeat_producer: 0')
    (node,) = load_text(tmp_path, text, eds=eds_text(rows)).nodes
    assert (node.guard_time, node.uses_node_guarding) == (0.05, True)
    with pytest.raises(ConfigError, match='no writable 0x100C'):
        load_text(
            tmp_path, added('joint1', 'heartbeat_producer: 0\nguard_time: 150'), eds=eds_text()
        )


def test_a_heartbeat_replaces_guarding(tmp_path: Path) -> None:
    """Both at a time are forbidden by CiA 301; the heartbeat wins, and it is reported."""
    config = load_text(tmp_path, added('joint1', 'heartbeat_producer: 100\nguard_time: 150'))
    assert (config.nodes[0].guard_time, config.nodes[0].uses_node_guarding) == (0.0, False)
    assert any('sends a heartbeat every 100 ms' in str(warning) for warning in config.warnings)


@pytest.mark.parametrize(
    ('settings', 'model'), [(DeviceSettings, NodeConfig), (MasterSettings, MasterConfig)]
)
def test_a_default_has_one_value(settings: Any, model: Any) -> None:
    """A device that is built by a program has the defaults of one that bus.yml names."""
    read = {field.name: field.default for field in fields(settings)}
    built = {field.name: field.default for field in fields(model)}
    same = {
        name
        for name in read.keys() & built.keys()
        if read[name] not in (None, '') and built[name] is not MISSING
    }
    assert len(same) > 5
    assert {name: read[name] for name in same} == {name: built[name] for name in same}
