# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs all static checks: style, types, layers, dead code, spelling, containers, manual."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
import os
from pathlib import Path
import subprocess

from .layout import Layout
from .packages import find_packages
from .process import clean_environment

BESIDE = ('test', 'bench', 'training')  # folders of a package beside its modules
COMPOSE_SCHEMA = ('--builtin-schema', 'vendor.compose-spec')  # of the Compose Specification


def mkdocs_command(layout: Layout) -> list[str | Path]:
    """Return the command that builds the site in build/site; warnings are errors."""
    mkdocs, settings = layout.venv / 'bin' / 'mkdocs', layout.root / 'mkdocs.yml'
    return [mkdocs, 'build', '--quiet', '--strict', '--config-file', settings]


def build_manual(layout: Layout, environ: Mapping[str, str]) -> int:
    """Build the site and print its first page; return 0, or 1 if it fails."""
    environment = clean_environment(environ)
    done = subprocess.run(mkdocs_command(layout), cwd=layout.root, env=environment, check=False)
    if done.returncode:
        return 1
    site = layout.build / 'site'
    print(f'The manual: {site / "index.html"}')
    print(f'With a search field: python3 -m http.server --bind 127.0.0.1 --directory {site}')
    return 0


def type_check_units(root: Path) -> dict[str, list[Path]]:
    """Group the folders that mypy checks together: modules of two units may have one name."""
    candidates = {
        package.name: [*package.modules, *(package.folder / part for part in BESIDE)]
        for package in find_packages(root).values()
        if package.build_type == 'ament_python'
    }
    tools = root / 'tools'
    candidates['tools'] = [tools / 'workspace', tools / 'test', tools / 'manual']
    front_end = tools / 'ros2_frontend'
    candidates['ros2_frontend'] = [front_end / 'ros2_frontend', front_end / 'test']
    candidates['tests'] = [root / 'tests']
    present = {
        name: [folder for folder in folders if any(folder.rglob('*.py'))]
        for name, folders in candidates.items()
    }
    return {name: folders for name, folders in present.items() if folders}


def lint(layout: Layout, environ: Mapping[str, str]) -> int:
    """Run all checks in parallel, even after a failure; return 0 if all passed."""
    bin_folder = layout.venv / 'bin'
    packages = [
        package.folder
        for package in find_packages(layout.root).values()
        if package.build_type == 'ament_python'
    ]
    tools, tests, docker = (layout.root / name for name in ('tools', 'tests', 'docker'))
    commands: list[list[str | Path]] = [
        [bin_folder / 'ruff', 'check', '.'],
        [bin_folder / 'ruff', 'format', '--check', '.'],
        [bin_folder / 'lint-imports', '--no-cache'],
        [bin_folder / 'vulture', *packages, tools, tests, layout.root / 'conftest.py'],
        [bin_folder / 'codespell'],
        [bin_folder / 'codespell', '--toml', layout.root / 'tools' / 'words.toml'],
        [bin_folder / 'hadolint', '--config', docker / 'hadolint.yaml', docker / 'Dockerfile'],
        [bin_folder / 'check-jsonschema', *COMPOSE_SCHEMA, layout.root / 'compose.yaml'],
        mkdocs_command(layout),
        [bin_folder / 'python', '-m', 'workspace.front_doors', '--want', '60'],
    ]
    for name, folders in type_check_units(layout.root).items():
        cache = layout.root / '.mypy_cache' / name
        commands.append([bin_folder / 'mypy', '--cache-dir', cache, *folders])
    environment = clean_environment(environ)
    checked = [*packages, tools, tools / 'ros2_frontend']
    environment['PYTHONPATH'] = os.pathsep.join(map(str, checked))  # for lint-imports

    def run(command: list[str | Path]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command,
            cwd=layout.root,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )

    failed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for command, done in zip(commands, pool.map(run, commands), strict=True):
            print('==', ' '.join(_shown(layout.root, part) for part in command))
            print(done.stdout, end='', flush=True)
            failed += bool(done.returncode)
    print(f'{failed} of {len(commands)} checks failed' if failed else 'All checks passed')
    return int(failed > 0)


def _shown(root: Path, part: str | Path) -> str:
    return os.path.relpath(part, root) if isinstance(part, Path) else part
