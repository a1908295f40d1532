# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All checks run, and one that fails is in the exit code."""

from __future__ import annotations

from pathlib import Path

from grimp import ImportGraph
from importlinter.api import read_configuration
import pytest

from workspace.layout import Layout, this_checkout
from workspace.lint import lint
from workspace.packages import find_packages
from workspace.public_api import PublicApiContract


def test_a_check_that_fails_is_reported_and_the_others_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exit code is 1, and what both said is shown; the checkout has no packages."""
    layout = Layout(tmp_path)
    folder = layout.venv / 'bin'
    folder.mkdir(parents=True)
    quiet = ['lint-imports', 'vulture', 'codespell', 'hadolint', 'check-jsonschema']
    quiet += ['mkdocs', 'python']
    ruff = '#!/bin/sh\necho "ran $1"\n[ "$1" = format ]\n'
    for name, script in {'ruff': ruff, **dict.fromkeys(quiet, '#!/bin/sh\n')}.items():
        (folder / name).write_text(script, encoding='ascii')
        (folder / name).chmod(0o755)
    assert lint(layout, {'PATH': '/usr/bin:/bin'}) == 1
    shown = capsys.readouterr().out
    assert 'ran check' in shown
    assert 'ran format' in shown


def test_every_package_is_in_the_contracts() -> None:
    """import-linter looks only at packages that are listed."""
    root = this_checkout().root
    configuration = read_configuration(str(root / 'pyproject.toml'))
    named = configuration['session_options']['root_packages']
    contracts = {each['type']: each for each in configuration['contracts_options']}
    assert contracts['acyclic_siblings']['ancestors'] == named
    packages = find_packages(root).values()
    python = [module.name for package in packages for module in package.modules]
    assert sorted(named) == sorted([*python, 'ros2_frontend', 'workspace'])


@pytest.mark.parametrize(
    ('imported', 'problems'),
    [
        ('arm', []),
        ('arm.rooms', []),
        ('arm.tables.units', []),
        ('arm.inner', ['leg imports arm.inner']),
        ('arm.rooms.one', ['leg imports arm.rooms.one']),
    ],
)
def test_packages_meet_through_what_they_name(imported: str, problems: list[str]) -> None:
    """A package itself, the families that it offers, and nothing below."""
    graph = ImportGraph()
    for module in ('arm', 'arm.inner', 'arm.rooms', 'arm.rooms.one', 'arm.tables', 'leg'):
        graph.add_module(module)
    graph.add_import(importer='leg', imported=imported)
    graph.add_import(importer='arm', imported='arm.inner')
    families = {'families': ['arm.rooms', 'arm.tables.*']}
    check = PublicApiContract('borders', {}, families).check(graph, verbose=False)
    assert check.metadata['problems'] == problems
    assert check.kept == (not problems)
