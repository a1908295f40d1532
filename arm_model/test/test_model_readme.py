# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The README has a line for every public name; its examples are run in tests/."""

from __future__ import annotations

from pathlib import Path

import arm_model

ARRAYS = {'Array', 'ArmNames', 'Mask', 'Native', 'Places', 'Shape', 'checked', 'frozen'}

README = Path(__file__).parents[1] / 'README.md'


def test_the_public_names_are_in_the_table() -> None:
    """All but those of arrays."""
    table = README.read_text(encoding='utf-8').partition('## Public API')[2].partition('\n## ')[0]
    missing = {name for name in arm_model.__all__ if f'`{name}`' not in table}
    assert missing == ARRAYS
