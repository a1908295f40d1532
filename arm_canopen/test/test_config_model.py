# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a bus.yml and its EDS files become in the model."""

from __future__ import annotations

from operator import attrgetter
from pathlib import Path
import shutil
from unittest.mock import Mock

from config_samples import added, ARTICLE_BUS, BUS, FLAT_BUS, load_text, TWO_AXES_EDS, write_bus
from eds_samples import DRIVE_ROWS, eds_text, Row
import pytest

from arm_canopen import BusConfig, DriveState, load_bus, NodeConfig
from arm_canopen.config import DEFAULT_DRIVE, Identity, RecoveryPolicy, SdoWrite
from canopen_core.eds import load_eds
from canopen_core.standard import CAN_ID_MASK, DataType

DRIVE_EDS = Path(__file__).parents[1] / 'eds' / 'cia402_drive.eds'


def test_keys(tmp_path: Path) -> None:
    """Each key fills its attribute, times in seconds."""
    for section, piece, attribute, value in (
        ('joint1', 'remappings: {joint_states: js}', 'remappings', {'joint_states': 'js'}),
        ('joint1', 'sdo_timeout_ms: 50', 'sdo_timeout', 0.05),
        ('joint1', 'heartbeat_producer: 50', 'heartbeat_timeout', pytest.approx(0.15)),
        ('joint1', 'heartbeat_producer: 50\nheartbeat_multiplier: 2', 'heartbeat_timeout', 0.1),
        ('joint1', 'heartbeat_producer: 0', 'heartbeat_timeout', 0.0),
        ('joint1', 'period: 5', 'heartbeat_consumer', True),  # it has 0x1016
        ('joint1', 'heartbeat_consumer: false', 'heartbeat_consumer', False),
        ('joint1', 'period: 5', 'identity', Identity(0x0002_0192, 0x555, 7)),  # of the EDS
        ('joint1', 'revision_number: 0x10002', 'identity.revision_number', 0x10002),
        ('joint1', 'scale_eff_to_dev: 8', 'drive.scale_eff_from_dev', 0.125),
        ('joint1', 'switching_state: 2', 'drive.switching_state', DriveState.SWITCH_ON_DISABLED),
        ('joint1', 'switching_state: 8', 'drive.switching_state', DriveState.OPERATION_ENABLED),
        ('joint1', 'recovery: auto', 'drive.recovery', RecoveryPolicy.AUTO),
        ('master', 'remappings: {a: b}', 'remappings', {'a': 'b'}),
        ('master', 'baudrate: 125', 'bitrate', 125_000),
        ('master', 'nmt_inhibit_time: 50', 'nmt_inhibit_time', 0.005),
        ('master', 'time_cob_id: 0x40000100', 'time_period', 1.0),
        ('master', 'time_cob_id: 0x80000100', 'time_period', 0.0),
        ('master', 'time_period_ms: 500', 'time_period', 0.5),
        ('master', 'time_period_ms: 500', 'time_cob_id', 0x40000100),
        ('master', 'sync_period: 5000', 'cycle_period', 0.005),
        ('master', 'heartbeat_producer: 0', 'heartbeat_timeout', 0.0),
        ('master', 'heartbeat_producer: 100\nheartbeat_multiplier: 5', 'heartbeat_timeout', 0.5),
    ):
        bus = load_text(tmp_path, added(section, piece))
        assert attrgetter(attribute)(bus.master if section == 'master' else bus.nodes[0]) == value


def test_supervision_of_heartbeats(tmp_path: Path) -> None:
    """The options' multiplier counts for all; the master may leave the supervision out."""
    text = added('joint1', 'heartbeat_producer: 100')
    options = 'options: {heartbeat_multiplier: 10}\n'
    assert load_text(tmp_path, options + text).nodes[0].heartbeat_timeout == 1.0
    unwatched = added('master', 'heartbeat_consumer: false', text)
    (node,) = load_text(tmp_path, unwatched).nodes
    assert (node.heartbeat_producer, node.heartbeat_timeout) == (0.1, 0.0)
    name = 'Producer heartbeat time\nDataType=0x0006\nAccessType=rw\nDefaultValue='
    (node,) = load_text(tmp_path, eds=eds_text().replace(f'{name}0', f'{name}250')).nodes
    assert (node.heartbeat_producer, node.heartbeat_timeout) == (0.25, 0.75)  # that of the EDS
    # a device without 0x1016 does not watch the master, nor does any one that sends no heartbeat
    without = eds_text().replace('[1016', '[2F16')
    assert not load_text(tmp_path, eds=without).nodes[0].heartbeat_consumer
    silent = added('master', 'heartbeat_producer: 0')
    assert not load_text(tmp_path, silent).nodes[0].heartbeat_consumer
    # bus.yml says how often a device without heartbeat is guarded, else the EDS does
    eds = eds_text([*DRIVE_ROWS, Row(0x100C, 0, 'Guard time', 6, 'rw', '50')])
    for producer, own, guard_time in ((0, 150, 0.15), (0, None, 0.05), (100, 150, 0.0)):
        keys = f'heartbeat_producer: {producer}' + (f'\nguard_time: {own}' if own else '')
        (node,) = load_text(tmp_path, added('joint1', keys), eds=eds).nodes
        assert (node.guard_time, node.uses_node_guarding) == (guard_time, guard_time > 0.0)


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


def test_all_pdos_of_the_eds_appear(tmp_path: Path) -> None:
    """PDOs that bus.yml does not name are as the EDS says; those that it names are configured."""
    (node,) = load_text(tmp_path).nodes
    for group, base in ((node.tpdos, 0x180), (node.rpdos, 0x200)):
        assert [pdo.number for pdo in group] == [1, 2, 3, 4, 5, 6]
        assert [pdo.configured for pdo in group] == [True] + [False] * 5
        assert [pdo.enabled for pdo in group] == [True, True] + [False] * 4
        assert [pdo.cob_id for pdo in group[:4]] == [base + 0x100 * n + 2 for n in range(4)]
        assert not any(pdo.fixed_mapping for pdo in group)
        assert all(pdo.inhibit_time is pdo.sync_start is None for pdo in group)
    assert [pdo.event_time for pdo in node.tpdos] == [0.1] + [None] * 5  # state, on change
    assert all(pdo.event_time is None for pdo in node.rpdos)


PDOS = """
tpdo:
  1: {inhibit_time: 15, event_timer: 100, sync_start: 3, transmission: 240}
  2: {mapping: [{index: 0x2003}, {index: 0x6061}, {index: 0x6041}]}
rpdo:
  1: {event_deadline: 50, cob_id: 0x333}
  2: {mapping: [{index: 0x0005}, {index: 0x6040}, {index: 0x0004}]}
"""


def test_parameters_and_mappings_of_pdos(tmp_path: Path) -> None:
    """Times are in seconds; types come from the EDS, and RPDOs take gaps."""
    (node,) = load_text(tmp_path, added('joint1', PDOS)).nodes
    tpdo, rpdo = node.tpdos[0], node.rpdos[0]
    times = (tpdo.inhibit_time, tpdo.event_time, tpdo.sync_start, tpdo.transmission)
    assert times == (0.0015, 0.1, 3, 240)
    assert (rpdo.event_time, rpdo.cob_id, rpdo.transmission) == (0.05, 0x333, 255)
    types = [mapped.data_type for mapped in node.tpdos[1].mapping]
    assert types == [DataType.BOOLEAN, DataType.INTEGER8, DataType.UNSIGNED16]
    gaps = [(mapped.index, mapped.data_type) for mapped in node.rpdos[1].mapping]
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


def test_an_eds_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Seven devices that share an EDS cost one reading."""
    reading = Mock(wraps=load_eds)
    monkeypatch.setattr('arm_canopen.config.read.document.load_eds', reading)
    text = BUS + ''.join(f'  joint{n}: {{node_id: {n + 1}}}\n' for n in range(2, 8))
    assert len(load_text(tmp_path, text).nodes) == 7
    assert reading.call_count == 1


def test_both_formats_give_the_same_device(tmp_path: Path) -> None:
    """A device is the same in the old flat format and in the new one, but for its line."""
    (old,) = load_text(tmp_path, FLAT_BUS).nodes
    (new,) = load_text(tmp_path).nodes
    names = NodeConfig.__dataclass_fields__.keys() - {'line', 'dictionary'}
    assert [getattr(old, name) for name in names] == [getattr(new, name) for name in names]
    assert list(old.dictionary) == list(new.dictionary)
    assert (old.line, new.line) == (4, 21)  # that of its name


DEFAULTS = """
heartbeat_producer: 100
remappings: {a: b, c: d}
sdo:
  - {index: 0x6081, value: 1}
  - {index: 0x6083, value: 2}
tpdo:
  1: {transmission: 5, mapping: [{index: 0x6041}, {index: 0x6061}]}
  2: {transmission: 6, mapping: [{index: 0x6064}]}
"""
OWN = """
heartbeat_producer: 300
remappings: {c: e}
tpdo:
  1: {mapping: [{index: 0x6061}]}
  2: {transmission: 7}
"""


def test_own_values_beat_the_defaults(tmp_path: Path) -> None:
    """Each key of a device wins; mappings merge key by key, lists of a PDO are replaced."""
    text = added('joint1', OWN, added('defaults', DEFAULTS))
    (node,) = load_text(tmp_path, text).nodes
    assert node.heartbeat_producer == 0.3
    assert node.remappings == {'a': 'b', 'c': 'e'}
    assert [pdo.transmission for pdo in node.tpdos[:2]] == [5, 7]
    assert [mapped.index for mapped in node.tpdos[0].mapping] == [0x6061]
    assert [mapped.index for mapped in node.tpdos[1].mapping] == [0x6064]


def test_lists_of_writes_merge_by_object(tmp_path: Path) -> None:
    """A device adds to the defaults' writes or replaces single ones; an empty list drops all."""
    for own, expected in (
        ('', [(0x6081, 1), (0x6083, 2)]),
        ('sdo: [{index: 0x6084, value: 3}]', [(0x6081, 1), (0x6083, 2), (0x6084, 3)]),
        ('sdo: [{index: 0x6081, value: 9}]', [(0x6083, 2), (0x6081, 9)]),
        ('sdo: []', []),
        ('error_behavior: {1: 2}', [(0x1029, 2), (0x6081, 1), (0x6083, 2)]),
    ):
        text = added('joint1', own, added('defaults', DEFAULTS))
        (node,) = load_text(tmp_path, text).nodes
        writes = [(write.index, int.from_bytes(write.data, 'little')) for write in node.sdo_writes]
        assert writes == expected, own


def test_where_the_eds_is_looked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In dcf_path (the device's, else that of the options), else beside the bus.yml, reported."""
    for name in ('a', 'b'):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'drive.eds').write_text(eds_text(), encoding='utf-8')
    monkeypatch.setenv('EDS_OF_TEST', str(tmp_path / 'b'))
    for options, own, folder in (
        ('', 'dcf: drive.eds', '.'),
        ('options: {dcf_path: "@BUS_CONFIG_PATH@"}', 'dcf: drive.eds', '.'),
        ('options: {dcf_path: "@BUS_CONFIG_PATH@/a"}', 'dcf: drive.eds', 'a'),
        ('options: {dcf_path: a}', 'dcf: drive.eds', 'a'),
        ('options: {dcf_path: nowhere}', 'dcf: drive.eds', '.'),
        ('options: {dcf_path: a}', 'dcf: drive.eds\ndcf_path: b', 'b'),
        ('options: {dcf_path: "$EDS_OF_TEST"}', 'dcf: drive.eds', 'b'),
        ('', 'dcf: ${EDS_OF_TEST}/drive.eds', 'b'),
        ('', 'dcf: "@BUS_CONFIG_PATH@/a/drive.eds"', 'a'),
        ('', 'eds: "@BUS_CONFIG_PATH@/a/drive.eds"', 'a'),
    ):
        bus = load_text(tmp_path, f'{options}\n{added("joint1", own)}')
        found = bus.nodes[0].eds.resolve()
        assert found == (tmp_path / folder / 'drive.eds').resolve(), (options, own)
        assert len([w for w in bus.warnings if 'taken is' in w.message]) == ('nowhere' in options)
    # @BUS_CONFIG_PATH@ may be made to stand for another folder
    path = write_bus(tmp_path, f'options: {{dcf_path: "@BUS_CONFIG_PATH@"}}\n{BUS}')
    (node,) = load_bus(path, bus_config_path=tmp_path / 'b').nodes
    assert node.eds == tmp_path / 'b' / 'drive.eds'


@pytest.fixture(params=['sample EDS', 'shipped EDS'])
def article(request: pytest.FixtureRequest, tmp_path: Path) -> BusConfig:
    """Load the published bus.yml of a seven-joint arm, unchanged."""
    shutil.copy(ARTICLE_BUS, tmp_path / 'bus.yml')
    shipped = DRIVE_EDS.read_text('utf-8')
    text = eds_text() if request.param == 'sample EDS' else shipped
    (tmp_path / 'cia402_slave.eds').write_text(text, encoding='utf-8')
    return load_bus(tmp_path / 'bus.yml')


def test_the_article_loads_without_a_warning(article: BusConfig) -> None:
    """The master sends a heartbeat, so that drives notice its end; the joints are alike."""
    master = article.master
    assert article.warnings == ()
    assert (master.node_id, master.name, master.bitrate) == (1, 'master', 1_000_000)
    assert (master.sync_period, master.cycle_period) == (0.01, 0.01)
    assert (master.heartbeat_producer, master.heartbeat_timeout) == pytest.approx((0.2, 0.6))
    assert master.start_nodes
    assert article.node('panda_joint3').node_id == 4
    with pytest.raises(KeyError, match='panda_joint1, panda_joint2'):
        article.node('panda_joint8')
    for number, node in enumerate(article.nodes, start=1):
        own, drive, identity = number + 1, node.drive, node.identity
        assert (node.name, node.node_id, node.is_drive) == (f'panda_joint{number}', own, True)
        assert node.heartbeat_consumer
        assert (node.heartbeat_producer, node.heartbeat_timeout) == (1.0, 3.0)
        assert (drive.position_mode, drive.velocity_mode) == (1, None)
        assert drive.switching_state is DriveState.OPERATION_ENABLED
        assert identity.device_type != 0 == identity.revision_number == identity.serial_number
        pdos = [pdo for pdo in node.tpdos + node.rpdos if pdo.enabled]
        assert [
            (pdo.number, pdo.cob_id - own, pdo.transmission, [each.index for each in pdo.mapping])
            for pdo in pdos
        ] == [
            (1, 0x180, 1, [0x6041, 0x6061]),
            (2, 0x280, 1, [0x6064, 0x606C]),
            (1, 0x200, 255, [0x6040, 0x6060]),
            (2, 0x300, 255, [0x607A, 0x60FF]),
        ]
        assert [pdo.configured for pdo in node.tpdos[:4] + node.rpdos[:4]] == [True] * 8
        entry = node.dictionary.get(0x1800, 1)  # ``$NODEID``, although they share one file
        assert entry is not None
        assert int(entry.default or 0) & CAN_ID_MASK == 0x180 + own
    assert article.nodes[0].sdo_writes == (
        *(
            SdoWrite(index, 0, value.to_bytes(4, 'little'))
            for index, value in ((0x6081, 1000), *((0x6083 + n, 10000) for n in range(3)))
        ),
        SdoWrite(0x6098, 0, b'\x00'),
        SdoWrite(0x60C2, 1, b'\x32'),
        SdoWrite(0x60C2, 2, b'\xfd'),
    )


def test_the_default_dictionary_knows_what_every_drive_has() -> None:
    """The objects of CiA 402 as the simulated drive has them, without what only a device knows."""
    general, own = (
        {entry.address: entry for entry in load_eds(path).dictionary}
        for path in (DEFAULT_DRIVE, DRIVE_EDS)
    )
    same = attrgetter('name', 'data_type', 'access', 'pdo_mappable')
    profile = {address: same(each) for address, each in general.items() if address[0] >= 0x6000}
    assert profile == {a: same(each) for a, each in own.items() if 0x6000 <= a[0] < 0x7000}
    assert all(general[each].low_limit is general[each].high_limit is None for each in profile)
    assert not any(general[0x1018, subindex].default for subindex in (1, 2, 3, 4))
