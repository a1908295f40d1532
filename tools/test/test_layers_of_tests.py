# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Tests and benchmarks of a package import only packages below it, as its modules do."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
import re

import pytest

pytestmark = pytest.mark.slow

tomllib = pytest.importorskip('tomllib')

ROOT = Path(__file__).parents[2]
SHIPPED_ROBOTS = {
    'arm_model/bench/bench_distances.py',
    'arm_model/test/model_robots.py',
    'arm_planning/bench/bench_planning.py',
    'arm_planning/bench/planning_problems.py',
    'arm_servo/bench/bench_servo.py',
}
"""Files that find the robots of arm_bringup as data."""


def families() -> Iterator[dict[str, int]]:
    """Yield, of arms and of the quadruped, each package with its layer."""
    with (ROOT / 'pyproject.toml').open('rb') as file:
        contracts = tomllib.load(file)['tool']['importlinter']['contracts']
    for contract in contracts[:2]:
        yield {
            name.strip(' ()'): layer
            for layer, names in enumerate(contract['layers'])
            for name in re.split('[|:]', names)
        }


def rooms(package: Path) -> Iterator[Path]:
    """Yield the tests and benchmarks of a package."""
    for room in ('test', 'bench'):
        yield from (package / room).rglob('*.py')


def imported(file: Path) -> set[str]:
    """Return the names of the modules and packages that a file imports."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text('utf-8'))):
        if isinstance(node, ast.ImportFrom):
            found.add((node.module or '').partition('.')[0])
        elif isinstance(node, ast.Import):
            found.update(alias.name.partition('.')[0] for alias in node.names)
    return found


def folders(family: dict[str, int]) -> dict[Path, int]:
    """Return the folders of packages; several in one folder are as high as the highest."""
    found: dict[Path, int] = {}
    for name, layer in family.items():
        (module,) = [
            *ROOT.glob(f'*/{name}/__init__.py'),
            *ROOT.glob(f'libraries/*/{name}/__init__.py'),
        ]
        folder = module.parents[1]
        found[folder] = min(layer, found.get(folder, layer))
    return found


@pytest.mark.parametrize('family', list(families()), ids=['arms', 'quadruped'])
def test_tests_import_nothing_from_above(family: dict[str, int]) -> None:
    """Neither a package nor what its tests share."""
    layers = family | {
        file.stem: layer
        for package, layer in folders(family).items()
        for file in rooms(package)
        if not file.stem.startswith(('test_', 'conftest'))
    }
    assert len(layers) > len(family)
    upward = [
        f'{path} imports {name}'
        for package, layer in folders(family).items()
        for file in rooms(package)
        if (path := file.relative_to(ROOT).as_posix()) not in SHIPPED_ROBOTS
        for name in sorted(imported(file))
        if layers.get(name, layer) < layer
    ]
    assert upward == []
