# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged EDS files: warnings or one ConfigError, never anything else."""

from pathlib import Path
import random

from config_mutations import mutated
from config_samples import DRIVE_ROWS, eds_text, outcome, write_bus
import pytest

from arm_canopen.config import load_bus, load_eds

pytestmark = pytest.mark.slow

SNIPPETS = (
    *('[', ']', '=', ';', '0x', '-', '+', '$NODEID+', '\n', '\r', '\0', '\xff', '٣', '9' * 60),
    *('[1A00sub1]', '[2000]', 'CompactSubObj=254', 'CompactSubObj=-1', 'ObjectType=0x8'),
    *('DataType=0x000F', 'DataType=9', 'AccessType=const', 'SubNumber=x', 'SupportedObjects=-1'),
    *('DefaultValue=0xFFFFFFFF', 'DefaultValue=0x60410040', 'ParameterValue=', 'LowLimit=9e99'),
)

SAMPLE = eds_text(
    row for row in DRIVE_ROWS if not 0x1400 <= row.index < 0x1C00 or row.index % 2 == 0
)
"""An EDS with one PDO of each kind: used, with the invalid bit set, and without default COB-ID."""


@pytest.mark.parametrize('seed', range(4))
def test_damaged_files_are_read_or_refused(tmp_path: Path, seed: int) -> None:
    """A mutated EDS is read, each warning within the file, or refused with a remedy."""
    generator = random.Random(seed)
    path = tmp_path / 'x.eds'
    for _ in range(150):
        text = mutated(SAMPLE, SNIPPETS, generator)
        path.write_text(text, encoding='utf-8', newline='')
        lines = text.count('\n') + text.count('\r') + 1
        for problem in outcome(lambda: load_eds(path).warnings):
            assert 0 <= problem.line <= lines
            assert problem.message
            assert problem.remedy


@pytest.mark.parametrize('seed', range(4))
def test_a_bus_with_a_damaged_eds_is_read_or_refused(tmp_path: Path, seed: int) -> None:
    """Whatever an EDS says of PDOs, identity or heartbeat, the bus is a model or one error."""
    generator = random.Random(seed)
    path = write_bus(tmp_path)
    for _ in range(100):
        text = mutated(SAMPLE, SNIPPETS, generator)
        (tmp_path / 'drive.eds').write_text(text, encoding='utf-8', newline='')
        for problem in outcome(lambda: load_bus(path).warnings):
            assert problem.message
            assert problem.remedy
