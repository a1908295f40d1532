# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scenario and the commands of README.md are right."""

from __future__ import annotations

from pathlib import Path
import re

import yaml

from canopen_sim.faults.scenario_file import load_scenario

PACKAGE = Path(__file__).parents[1]
BLOCK = re.compile(r'^```(\w+)\n(.*?)^```$', re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[str]:
    """Return the blocks of a language."""
    text = (PACKAGE / 'README.md').read_text('utf-8')
    return [content for kind, content in BLOCK.findall(text) if kind == language]


def test_the_scenario_is_accepted(tmp_path: Path) -> None:
    """It has as many steps as it shows."""
    (scenario,) = blocks('yaml')
    path = tmp_path / 'scenario.yaml'
    path.write_text(scenario)
    steps = load_scenario(path, {'joint1': 2, 'joint2': 3, 'joint3': 4}, frozenset({2, 3, 4}))
    assert len(steps) == len(yaml.safe_load(scenario)['steps'])


def test_files_that_commands_name_are_there() -> None:
    """A command that is copied finds its files."""
    named = re.findall(r':=([\w/]+\.(?:yml|yaml|eds))', '\n'.join(blocks('console')))
    assert named
    assert [name for name in named if not (PACKAGE.parent / name).is_file()] == []
