# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Files whose indentation was lost on the way: understood where only one thing can be meant."""

from __future__ import annotations

from pathlib import Path
import shutil

from config_samples import BUS, errors_of, load_text, write_bus
import pytest

from arm_canopen.config import load_bus

DATA = Path(__file__).parent / 'data'
EDS = Path(__file__).parents[1] / 'eds' / 'cia402_drive.eds'


def test_the_prbt_guide_loads_as_printed(tmp_path: Path) -> None:
    """Sections below options, PDOs whose keys are not indented: each slip is reported."""
    shutil.copy(EDS, tmp_path / 'prbt_0_1.dcf')
    path = shutil.copy(DATA / 'prbt_guide.yml', tmp_path / 'bus.yml')
    bus = load_bus(path)
    lines = Path(path).read_text().splitlines()
    assert [node.name for node in bus.nodes] == [f'prbt_joint_{n}' for n in range(1, 7)]
    assert bus.master.sync_period == pytest.approx(0.01)
    for node in bus.nodes:
        assert node.drive.position_mode == 7
        assert [pdo.enabled for pdo in node.tpdos] == [True, True, False, False]
        assert [mapped.index for mapped in node.rpdos[0].mapping] == [0x6040, 0x6060, 0x60C1]
        assert [mapped.index for mapped in node.tpdos[1].mapping] == [0x6064, 0x606C]
    slips = [w for w in bus.warnings if 'indented' in w.message]
    reported = {lines[slip.line - 1].strip() for slip in slips}
    assert reported == {'master:', 'defaults:', 'nodes:', '1:', '2:', '3:', '4:'}
    assert len(slips) == 3 + 4 + 2


def test_a_number_without_keys_is_no_slip(tmp_path: Path) -> None:
    """Nothing follows it that could belong to it, so it is refused as before."""
    path = write_bus(tmp_path, f'{BUS}    tpdo: {{1: }}\n')
    assert any('tpdo.1' in problem.key for problem in errors_of(path))


def test_a_stray_word_after_an_indented_pdo_stays_an_error(tmp_path: Path) -> None:
    """It could belong to either, so nobody guesses."""
    text = f'{BUS}    tpdo:\n      1:\n        enabled: true\n      cob_id: auto\n'
    assert any('cob_id' in problem.key for problem in errors_of(write_bus(tmp_path, text)))


def test_a_section_that_is_there_twice_is_not_lifted(tmp_path: Path) -> None:
    """One below options and one of its own: the former is an unknown key of options."""
    text = f'options:\n  master: {{node_id: 9}}\n{BUS}'
    assert any(problem.key == 'options.master' for problem in errors_of(write_bus(tmp_path, text)))


def test_a_file_without_slips_has_no_warnings(tmp_path: Path) -> None:
    """The sample of the other tests."""
    assert load_text(tmp_path).warnings == ()
