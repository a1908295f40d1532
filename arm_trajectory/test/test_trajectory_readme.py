# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The example of the README runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from model_robots import ready, robot

README = Path(__file__).parents[1] / 'README.md'


def test_the_example_runs() -> None:
    """A short motion from the pose to start from is planned, and makes no contact."""
    here = ready('panda')
    names: dict[str, Any] = {'model': robot('panda'), 'here': here, 'positions': here + 0.1}
    example = README.read_text(encoding='utf-8').split('```python\n')[1].split('```')[0]
    exec(example, names)  # noqa: S102  our own file
    assert names['contact'] is None
    assert names['made'].path.duration > 0.0
