# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Programs of other packages that are started by their names in this one."""

from __future__ import annotations

from functools import partial
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


def _refuse(package: str, name: str, *_: object) -> None:
    """Find no module of a package."""
    if name.partition('.')[0] == package:
        raise ModuleNotFoundError(f'No module named {name!r}', name=name)


@pytest.mark.parametrize(('name', 'module'), PROGRAMS.items())
def test_a_missing_package_is_named_with_its_remedy(
    name: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line instead of a traceback."""
    package = module.partition('.')[0]
    for known in [known for known in sys.modules if known.partition('.')[0] == package]:
        monkeypatch.delitem(sys.modules, known)
    finder = SimpleNamespace(find_spec=partial(_refuse, package))
    monkeypatch.setattr(sys, 'meta_path', [finder, *sys.meta_path])
    with pytest.raises(SystemExit) as ended:
        getattr(aliases, name)()
    (line,) = str(ended.value).splitlines()
    assert package in line
    assert f'colcon build --packages-up-to {package}' in line


@pytest.mark.parametrize(('name', 'module'), PROGRAMS.items())
def test_an_alias_runs_the_program(
    name: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its exit code."""
    program = ModuleType(module)
    program.main = lambda: 3  # type: ignore[attr-defined]
    package = module.partition('.')[0]
    monkeypatch.setitem(sys.modules, package, ModuleType(package))
    monkeypatch.setitem(sys.modules, module, program)
    with pytest.raises(SystemExit) as ended:
        getattr(aliases, name)()
    assert ended.value.code == 3


def test_each_alias_is_installed() -> None:
    """The names are those of the package's executables."""
    installed = {entry.name for entry in entry_points(group='console_scripts')}
    assert installed >= set(PROGRAMS) or not installed
