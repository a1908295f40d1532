# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated board is started by its name in this package, too."""

from __future__ import annotations

from functools import partial
import sys
from types import SimpleNamespace

import pytest

from quad_hardware.aliases import fake_xgo


def _refuse(package: str, name: str, *_: object) -> None:
    """Find no module of a package."""
    if name.partition('.')[0] == package:
        raise ModuleNotFoundError(f'No module named {name!r}', name=name)


def test_a_missing_package_is_named_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line instead of a traceback."""
    for name in [name for name in sys.modules if name.partition('.')[0] == 'quad_sim']:
        monkeypatch.delitem(sys.modules, name)
    finder = SimpleNamespace(find_spec=partial(_refuse, 'quad_sim'))
    monkeypatch.setattr(sys, 'meta_path', [finder, *sys.meta_path])
    with pytest.raises(SystemExit) as ended:
        fake_xgo()
    (line,) = str(ended.value).splitlines()
    assert 'colcon build --packages-up-to quad_sim' in line
