# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The example of the README runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from model_robots import FOLDER, texts
import pytest

README = Path(__file__).parents[1] / 'README.md'


def test_the_example_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm is free in the pose to start from."""
    monkeypatch.chdir(FOLDER / 'panda')
    urdf, srdf = texts('panda')
    names: dict[str, Any] = {'urdf': urdf, 'srdf': srdf}
    example = README.read_text(encoding='utf-8').split('```python\n')[1].split('```')[0]
    exec(example, names)  # noqa: S102  our own file
    assert names['jacobian'].shape == (6, 7)
    assert names['distance'] > 0.0
