# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The published bus.yml of a seven-joint arm, read unchanged."""

from pathlib import Path
import shutil

from config_samples import ARTICLE_BUS, eds_text
import pytest

from arm_canopen import DriveState
from arm_canopen.config import BusConfig, load_bus, PdoConfig, SdoWrite
from arm_canopen.standard import CAN_ID_MASK

SHIPPED_EDS = Path(__file__).parents[1] / 'eds' / 'cia402_drive.eds'


@pytest.fixture(params=['sample EDS', 'shipped EDS'])
def bus(request: pytest.FixtureRequest, tmp_path: Path) -> BusConfig:
    """Load it, with the tests' EDS and with that of the simulated drive."""
    shutil.copy(ARTICLE_BUS, tmp_path / 'bus.yml')
    text = eds_text() if request.param == 'sample EDS' else SHIPPED_EDS.read_text('utf-8')
    (tmp_path / 'cia402_slave.eds').write_text(text, encoding='utf-8')
    return load_bus(tmp_path / 'bus.yml')


def test_it_is_taken_without_complaint(bus: BusConfig) -> None:
    """There is not even a warning."""
    assert bus.warnings == ()


def test_the_master(bus: BusConfig) -> None:
    """Times are in seconds; the master sends a heartbeat, so that drives notice its end."""
    master = bus.master
    assert master.node_id == 1
    assert master.name == 'master'
    assert master.driver == 'ros2_canopen::MasterDriver'
    assert master.bitrate == 1_000_000
    assert master.sync_period == master.cycle_period == 0.01
    assert master.heartbeat_producer == 0.2
    assert master.heartbeat_timeout == pytest.approx(0.6)
    assert master.start_nodes


def test_the_joints(bus: BusConfig) -> None:
    """Seven joints in the order of the file, alike but for name, node id and COB-IDs."""
    assert [(node.name, node.node_id) for node in bus.nodes] == [
        (f'panda_joint{number}', number + 1) for number in range(1, 8)
    ]
    for node in bus.nodes:
        assert node.is_drive
        assert node.heartbeat_producer == 1.0
        assert node.heartbeat_timeout == 3.0
        assert node.heartbeat_consumer
        assert node.drive.position_mode == 1
        assert node.drive.velocity_mode is None
        assert node.drive.switching_state is DriveState.OPERATION_ENABLED
        assert node.drive.scale_pos_to_dev == 1000.0
        assert node.sdo_timeout == 0.2
        assert node.identity.device_type != 0
        assert node.identity.revision_number == node.identity.serial_number == 0


def test_the_pdos(bus: BusConfig) -> None:
    """PDOs have the pre-defined identifiers, the mappings and the types that the file gives."""

    def summary(pdo: PdoConfig) -> tuple[int, bool, int, int, list[int]]:
        objects = [mapped.index for mapped in pdo.mapping]
        return pdo.number, pdo.enabled, pdo.cob_id, pdo.transmission, objects

    for node in bus.nodes:
        own = node.node_id
        tpdos, rpdos = ([pdo for pdo in pdos if pdo.enabled] for pdos in (node.tpdos, node.rpdos))
        assert [summary(pdo) for pdo in tpdos] == [
            (1, True, 0x180 + own, 1, [0x6041, 0x6061]),
            (2, True, 0x280 + own, 1, [0x6064, 0x606C]),
        ]
        assert [summary(pdo) for pdo in rpdos] == [
            (1, True, 0x200 + own, 255, [0x6040, 0x6060]),
            (2, True, 0x300 + own, 255, [0x607A, 0x60FF]),
        ]
        assert [pdo.configured for pdo in node.tpdos[:4] + node.rpdos[:4]] == [True] * 8


def test_the_writes(bus: BusConfig) -> None:
    """Values are encoded with the types of the EDS: -3 of an INTEGER8 is 0xFD."""
    assert bus.nodes[0].sdo_writes == (
        SdoWrite(0x6081, 0, (1000).to_bytes(4, 'little')),
        SdoWrite(0x6083, 0, (10000).to_bytes(4, 'little')),
        SdoWrite(0x6084, 0, (10000).to_bytes(4, 'little')),
        SdoWrite(0x6085, 0, (10000).to_bytes(4, 'little')),
        SdoWrite(0x6098, 0, b'\x00'),
        SdoWrite(0x60C2, 1, b'\x32'),
        SdoWrite(0x60C2, 2, b'\xfd'),
    )


def test_a_device_by_name(bus: BusConfig) -> None:
    """Devices are found by name; an unknown name lists those that exist."""
    assert bus.node('panda_joint3').node_id == 4
    with pytest.raises(KeyError, match='panda_joint1, panda_joint2'):
        bus.node('panda_joint8')


def test_each_device_has_its_own_defaults(bus: BusConfig) -> None:
    """``$NODEID`` is resolved for each device although they share one file."""
    for node in bus.nodes:
        entry = node.dictionary.get(0x1800, 1)
        assert entry is not None
        assert int(entry.default or 0) & CAN_ID_MASK == 0x180 + node.node_id
