# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen dbc`` against cantools, which reads each frame as the master does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cantools
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import load_bus, NodeConfig
from arm_canopen.cia402.units import Units
from canopen_core.standard import Index, PdoCodec
from canopen_tools.cli.main import main

ROBOTS = Path(__file__).parents[2] / 'arm_bringup' / 'robots'
FILES = [
    *sorted(ROBOTS.glob('*/bus.yml')),
    *sorted((ROBOTS.parents[1] / 'tests' / 'drives').glob('*/bus.yml')),
]


def database(file: Path, folder: Path, *options: str) -> Any:  # a union of what it may load
    """Write the DBC of a bus and load it."""
    out = folder / 'bus.dbc'
    assert main(['dbc', str(file), '--out', str(out), *options]) == 0
    return cantools.database.load_file(out)


def expected(node: NodeConfig, index: int, value: float, *, is_sent: bool) -> float:
    """Return what the master takes for the value of an object, in user units."""
    units = Units(node.drive)
    scale = {
        Index.POSITION_ACTUAL: units.position,
        Index.TARGET_POSITION: units.position,
        Index.VELOCITY_ACTUAL: units.velocity,
        Index.TARGET_VELOCITY: units.velocity,
        Index.VELOCITY_OFFSET: units.velocity,
        Index.TORQUE_ACTUAL: units.effort,
        Index.TARGET_TORQUE: units.effort,
    }.get(Index(index) if index in set(Index) else Index.DEVICE_TYPE)
    if scale is None:
        return value
    return scale.from_device(value) if is_sent else scale.commanded(value)


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.parent.name)
def test_every_frame_is_read_as_by_the_master(
    file: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Every PDO is there, and each of its values equals ours, for any payload."""
    tables = database(file, tmp_path_factory.mktemp('dbc'))
    config = load_bus(file)
    pdos = [
        (node, is_sent, pdo)
        for node in config.nodes
        for is_sent, several in ((True, node.tpdos), (False, node.rpdos))
        for pdo in several
        if pdo.enabled and pdo.mapping
    ]
    assert pdos

    @given(st.sampled_from(pdos), st.binary(min_size=8, max_size=8))
    def read(chosen: tuple[NodeConfig, bool, object], data: bytes) -> None:
        node, is_sent, pdo = chosen
        codec = PdoCodec(pdo.mapping)  # type: ignore[attr-defined]
        found = tables.decode_message(pdo.cob_id, data[: codec.size])  # type: ignore[attr-defined]
        values = [
            expected(node, entry.index, value, is_sent=is_sent)
            for entry, value in zip(codec.objects, codec.unpack(data), strict=True)
            if entry.index >= Index.DEVICE_TYPE
        ]
        assert list(found.values()) == pytest.approx(values, rel=1e-9, nan_ok=True)

    read()
    for node in config.nodes:
        assert tables.decode_message(0x700 + node.node_id, b'\5') == {'NMT_state': 'OPERATIONAL'}
        assert tables.decode_message(node.emergency_id, bytes(8))['Error_code'] == 0


def test_offsets_axes_and_units_are_those_of_bus_yml(tmp_path: Path) -> None:
    """The drive counts from elsewhere, and turns the other way; a joint slides."""
    text = (ROBOTS / 'panda' / 'bus.yml').read_text().partition('nodes:')[0]
    text = text.replace('"@BUS_CONFIG_PATH@"', f'"{ROBOTS / "panda"}"')
    text += (
        'nodes:\n  lift_of_the_left_arm_at_the_back:\n    node_id: 5\n'
        '    scale_pos_to_dev: -2000.0\n    scale_pos_from_dev: -0.0005\n'
        '    offset_pos_to_dev: 100.0\n    offset_pos_from_dev: 0.05\n'
    )
    (tmp_path / 'bus.yml').write_text(text)
    tables = database(
        tmp_path / 'bus.yml', tmp_path, '--metre', 'lift_of_the_left_arm_at_the_back'
    )
    name = 'lift_of_the_left_a_5'
    sent = tables.get_message_by_name(f'{name}_TPDO2')
    assert sent.decode((-300).to_bytes(4, 'little', signed=True) + bytes(4))[
        'Position_actual_value'
    ] == pytest.approx(0.2)
    assert sent.get_signal_by_name('Velocity_actual_value').unit == 'm/s'
    target = tables.get_message_by_name(f'{name}_RPDO1')
    assert target.decode(bytes(3) + (-300).to_bytes(4, 'little', signed=True))[
        'Target_position'
    ] == pytest.approx(0.2)


def test_what_is_no_joint_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is written."""
    out = tmp_path / 'bus.dbc'
    file = str(ROBOTS / 'panda' / 'bus.yml')
    assert main(['dbc', file, '--out', str(out), '--metre', 'leg']) == 2
    assert '--metre: no joint leg; joints: panda_joint1' in capsys.readouterr().err
    assert not out.exists()
