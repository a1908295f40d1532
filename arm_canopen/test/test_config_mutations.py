# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged bus.yml and EDS files: findings with words and places, never another exception."""

from functools import cache
from pathlib import Path
import random

from config_mutations import mutated
from config_samples import ARTICLE_BUS, BUS, outcome, write_bus
from eds_samples import DRIVE_ROWS, eds_text
import pytest

from arm_canopen.config import check_file
from canopen_core.eds import load_eds

pytestmark = pytest.mark.slow

SNIPPETS = (
    *('[', ']', '{', '}', ':', ' ', '    ', '- ', '*a', '&a ', '<<: *a', '!!int x', '? ', '|'),
    *('null', 'true', '-1', '0x', '08', '1:2', '.inf', '1e400', '9' * 90, '٣', '\t', '\x85', '~'),
    *('  1:', '  tpdo: 5', '  mapping: {}', '  sdo: [[]]', 'nodes:', 'defaults: 1', '[' * 200),
    *('  dcf: "\\0"', '  dcf: .', '  cob_id: auto', '    transmission: []', '  node_id: {}', '"'),
    *('  namespace: ""', '  remappings: {a: }', '  error_behavior: {1: 0, 2: x}', 'x' * 300),
    *('transmission: 252', 'sync_start: 9', '- {index: 0x1016, sub_index: 1}', 'mapping: []'),
    *('position_mode: 9', 'sync_period: 500', 'num_channels: 3', 'x: ['),
)
EDS_SNIPPETS = (
    *('[', ']', '=', ';', '0x', '-', '+', '$NODEID+', '\n', '\r', '\0', '\xff', '٣', '9' * 60),
    *('[1A00sub1]', '[2000]', 'CompactSubObj=254', 'CompactSubObj=-1', 'ObjectType=0x8'),
    *('DataType=0x000F', 'DataType=9', 'AccessType=const', 'SubNumber=x', 'SupportedObjects=-1'),
    *('DefaultValue=0xFFFFFFFF', 'DefaultValue=0x60410040', 'ParameterValue=', 'LowLimit=9e99'),
)
SAMPLE = eds_text(
    row for row in DRIVE_ROWS if not 0x1400 <= row.index < 0x1C00 or row.index % 2 == 0
)
"""An EDS with one PDO of each kind: used, with the invalid bit set, and without default COB-ID."""
TWO_JOINTS = ARTICLE_BUS.read_text('utf-8').split('  panda_joint3:', maxsplit=1)[0]
"""The bus of the article without the joints that are like the first two."""


@pytest.mark.parametrize('seed', range(6))
def test_damaged_buses_are_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Each problem has a message, a remedy, and a line within its file."""
    # the EDS files are whole, and reading them takes longer than all the rest
    monkeypatch.setattr('arm_canopen.config.read.document.load_eds', cache(load_eds))
    generator = random.Random(seed)
    path = write_bus(tmp_path)
    (tmp_path / 'cia402_slave.eds').write_text(eds_text(), encoding='utf-8')
    for _ in range(200):
        text = mutated(TWO_JOINTS if seed % 2 else BUS, SNIPPETS, generator)
        path.write_text(text, encoding='utf-8', newline='')
        report = check_file(path)
        for problem in report.errors + report.warnings:
            assert problem.message
            assert problem.remedy
            within = len(text.splitlines()) + 1 if problem.file == path else 10_000
            assert 0 <= problem.line <= within


@pytest.mark.parametrize('seed', range(4))
def test_damaged_eds_files_are_read_or_refused(tmp_path: Path, seed: int) -> None:
    """By themselves, and as those of a bus."""
    generator = random.Random(seed)
    bus, path = write_bus(tmp_path), tmp_path / 'drive.eds'
    for _ in range(130):
        text = mutated(SAMPLE, EDS_SNIPPETS, generator)
        path.write_text(text, encoding='utf-8', newline='')
        lines = text.count('\n') + text.count('\r') + 1
        report = check_file(bus)
        for problem in (*outcome(lambda: load_eds(path).warnings), *report.errors):
            assert 0 <= problem.line <= lines
            assert problem.message
            assert problem.remedy
