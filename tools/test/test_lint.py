# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All checks run, side by side, and one that fails is in the exit code."""

from __future__ import annotations

from pathlib import Path

from grimp import ImportGraph
from importlinter.api import read_configuration
import pytest

from workspace.layout import Layout, this_checkout
from workspace.lint import lint
from workspace.packages import find_packages
from workspace.public_api import PublicApiContract

# each run of it waits until the other one has begun, and gives up after a while
WAITS_FOR_THE_OTHER = """#!/bin/sh
touch "$0.$1"
tries=0
until [ -e "$0.check" ] && [ -e "$0.format" ]; do
  tries=$((tries + 1))
  [ $tries -lt 600 ] || exit 1
  sleep 0.1
done
echo "seen by $1"
"""

QUIET = (
    *('lint-imports', 'vulture', 'codespell', 'hadolint', 'check-jsonschema', 'mkdocs'),
    'python',
)


def install(root: Path, script: str) -> Layout:
    """Make a checkout without packages, with a ruff that is a script."""
    layout = Layout(root)
    folder = layout.venv / 'bin'
    folder.mkdir(parents=True)
    programs = {
        'ruff': script,
        **dict.fromkeys(QUIET, '#!/bin/sh\n'),
    }
    for name, source in programs.items():
        (folder / name).write_text(source, encoding='ascii')
        (folder / name).chmod(0o755)
    return layout


def test_checks_run_side_by_side(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two checks of which each waits for the other end; their output comes one after another."""
    assert lint(install(tmp_path, WAITS_FOR_THE_OTHER), {'PATH': '/usr/bin:/bin'}) == 0
    shown = capsys.readouterr().out
    assert shown.index('seen by check') < shown.index('seen by format')


def test_a_check_that_fails_is_reported_and_the_others_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exit code is 1, and what both said is shown."""
    script = '#!/bin/sh\necho "ran $1"\n[ "$1" = format ]\n'
    assert lint(install(tmp_path, script), {'PATH': '/usr/bin:/bin'}) == 1
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
