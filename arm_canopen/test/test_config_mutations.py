# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged bus.yml files: a model or one ConfigError, never anything else."""

from functools import cache
from pathlib import Path
import random

from config_mutations import mutated
from config_samples import ARTICLE_BUS, BUS, eds_text, outcome
import pytest

from arm_canopen.config import load_bus, load_eds

pytestmark = pytest.mark.slow

SNIPPETS = (
    *('[', ']', '{', '}', ':', ' ', '    ', '- ', '*a', '&a ', '<<: *a', '!!int x', '? ', '|'),
    *('null', 'true', '-1', '0x', '08', '1:2', '.inf', '1e400', '9' * 90, '٣', '\t', '\x85', '~'),
    *('  1:', '  tpdo: 5', '  mapping: {}', '  sdo: [[]]', 'nodes:', 'defaults: 1', '[' * 200),
    *('  dcf: "\\0"', '  dcf: .', '  cob_id: auto', '    transmission: []', '  node_id: {}', '"'),
    *('  namespace: ""', '  remappings: {a: }', '  error_behavior: {1: 0, 2: x}', 'x' * 300),
)


TWO_JOINTS = ARTICLE_BUS.read_text('utf-8').split('  panda_joint3:', maxsplit=1)[0]
"""The bus of the article without the joints that are like the first two."""


@pytest.mark.parametrize('seed', range(8))
def test_damaged_files_are_read_or_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """A mutated bus.yml is a bus, or an error whose problems lie within the files."""
    # the EDS files are whole, and reading them takes longer than all the rest
    monkeypatch.setattr('arm_canopen.config.resolve.eds_files.load_eds', cache(load_eds))
    generator = random.Random(seed)
    original = TWO_JOINTS if seed % 2 else BUS
    for name in ('drive.eds', 'cia402_slave.eds'):
        (tmp_path / name).write_text(eds_text(), encoding='utf-8')
    path = tmp_path / 'bus.yml'
    for _ in range(200):
        text = mutated(original, SNIPPETS, generator)
        path.write_text(text, encoding='utf-8', newline='')
        lines = len(text.splitlines()) + 1
        for problem in outcome(lambda: load_bus(path).warnings):
            assert problem.message
            assert problem.remedy
            assert 0 <= problem.line <= (lines if problem.file == path else 10_000)
