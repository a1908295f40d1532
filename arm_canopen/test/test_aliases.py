# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Programs of other packages that are started by their names in this one."""

from __future__ import annotations

from importlib.metadata import entry_points
import sys
from types import ModuleType, SimpleNamespace

import pytest

from arm_canopen import aliases

PROGRAMS = {
    'candump': 'canopen_tools.candump',
    'canopen': 'canopen_tools.cli.main',
    'fake_slave': 'canopen_sim.nodes.fake_slave',
    'fake_slaves': 'canopen_sim.nodes.fake_slaves',
}


@pytest.mark.parametrize(('name', 'module'), PROGRAMS.items())
def test_an_alias_runs_the_program(
    name: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its exit code; a missing package is one line with its remedy, and no traceback."""
    package = module.partition('.')[0]
    program = ModuleType(module)
    program.main = lambda: 3  # type: ignore[attr-defined]
    for known in [known for known in sys.modules if known.partition('.')[0] == package]:
        monkeypatch.delitem(sys.modules, known)
    with monkeypatch.context() as there:
        there.setitem(sys.modules, package, ModuleType(package))
        there.setitem(sys.modules, module, program)
        with pytest.raises(SystemExit) as ended:
            getattr(aliases, name)()
        assert ended.value.code == 3

    def refuse(wanted: str, *_: object) -> None:
        if wanted.partition('.')[0] == package:
            raise ModuleNotFoundError(f'No module named {wanted!r}', name=wanted)

    monkeypatch.setattr(sys, 'meta_path', [SimpleNamespace(find_spec=refuse), *sys.meta_path])
    with pytest.raises(SystemExit, match=f'^[^\n]*{package}[^\n]*--packages-up-to {package}'):
        getattr(aliases, name)()
    installed = {entry.name for entry in entry_points(group='console_scripts')}
    assert name in installed or not installed
