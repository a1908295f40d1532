# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The examples of the README run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from model_robots import FOLDER, texts
import pytest

import arm_model

ARRAYS = {'Array', 'ArmNames', 'Mask', 'Native', 'Places', 'Shape', 'checked', 'frozen'}

README = Path(__file__).parents[1] / 'README.md'


def test_the_examples_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm is free in the pose to start from, also with the box in its hand."""
    monkeypatch.chdir(FOLDER / 'panda')
    urdf, srdf = texts('panda')
    names: dict[str, Any] = {'urdf': urdf, 'srdf': srdf}
    for part in README.read_text(encoding='utf-8').split('```python\n')[1:]:
        exec(part.split('```')[0], names)  # noqa: S102  our own file
    assert names['jacobian'].shape == (6, 7)
    assert names['distance'] > 0.0
    assert len(names['distances']) == len(names['clearances'].pairs)
    assert names['contacts'] == []
    assert not names['later'].attached_bodies


def test_the_public_names_are_in_the_table() -> None:
    """All but those of arrays."""
    table = README.read_text(encoding='utf-8').partition('## Public API')[2].partition('\n## ')[0]
    missing = {name for name in arm_model.__all__ if f'`{name}`' not in table}
    assert missing == ARRAYS
