# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Counts which names of our packages the tests import through front doors.

A front door is a package itself or one of at most three sub-packages that it offers besides; what
is imported from a module behind it keeps that module where it is.
"""

from __future__ import annotations

import argparse
import ast
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
import subprocess
import sys

SUB_PACKAGES = {
    'arm_canopen': ('config',),
    'arm_model': ('ros',),
    'canopen_core': ('can', 'eds', 'standard'),
    'canopen_tools': ('monitor',),
    'node_runner': ('action_goals',),
    'operator_input': ('devices', 'gamepad', 'terminal'),
    'process_supervisor': ('graph_client',),
    'quad_controller': ('policy',),
    'quad_hardware': ('estimation', 'link', 'protocol'),
    'quad_sim': ('env', 'physics'),
}
DOORS = {f'{package}.{name}' for package, names in SUB_PACKAGES.items() for name in names}


def imported(source: str) -> Iterator[str]:
    """Yield the module of each name that a file imports."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (node.module for _ in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def count(root: Path) -> dict[str, Counter[str]]:
    """Return the modules that tests import, by package."""
    listed = subprocess.run(
        ['git', 'ls-files', '*.py'], cwd=root, check=True, capture_output=True, text=True
    )
    files = [Path(line) for line in listed.stdout.splitlines()]
    folders = {path.parent for path in files if path.name == '__init__.py'}
    packages = {folder.name for folder in folders if folder.parent not in folders}
    modules: dict[str, Counter[str]] = defaultdict(Counter)
    for path in files:
        if {'test', 'tests'} & set(path.parts[:-1]) or path.name == 'conftest.py':
            for module in imported((root / path).read_text(encoding='utf-8')):
                package = module.partition('.')[0]
                if package in packages:
                    modules[package][module] += 1
    return modules


def main() -> int:
    """Print a line for each package; return 1 if the share of all is less than wanted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('root', type=Path, nargs='?', default=Path())
    parser.add_argument('--want', type=float, default=0.0, help='least share of all in percent')
    options = parser.parse_args()
    names = through = 0
    for package, modules in sorted(count(options.root).items()):
        every = modules.total()
        inner = Counter({m: n for m, n in modules.items() if m != package and m not in DOORS})
        names, through = names + every, through + every - inner.total()
        most = ' '.join(f'{module} {uses}' for module, uses in inner.most_common(3))
        print(f'{package:20}{every:5}{1 - inner.total() / every:6.0%}  {most}'.rstrip())
    share = 100 * through / names
    print(f'{"all":20}{names:5}{share:5.0f}%')
    return int(share < options.want)


if __name__ == '__main__':
    sys.exit(main())
