# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The commands behind the Makefile.

Set-up commands plan the steps from the present to the wanted state, and announce each.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
import os
from pathlib import Path
import signal
import sys
import time

from .build import Builder, default_jobs
from .environment import choose_python, DEV, DOCS, Environment, Step
from .layout import Layout, read_state, this_checkout, WorkspaceError
from .lint import build_manual, lint
from .packages import find_packages, needed_packages
from .process import Argument, exclusive, Runner
from .system import missing_packages, probe, PYTHON_OLDEST
from .underlay import find_underlay


@dataclass(frozen=True, slots=True)
class Target:
    """Requirements of a target."""

    dev: bool = False  # whether the tools for testing, and all that any package imports
    build: bool = True  # whether any package
    packages: tuple[str, ...] = ()  # which ones; none means all
    extras: tuple[str, ...] = ()  # requirements files besides, which no package needs by itself
    # greatest number of compilers at the same time
    jobs: int = field(default_factory=default_jobs)


def plan(environment: Environment, target: Target) -> list[Step]:
    """List the steps from the present state to that of the target."""
    layout = environment.layout
    found = find_packages(layout.root)
    packages = needed_packages(found, target.packages, environment.underlay, tests=target.dev)
    names = [DEV, *sorted(found)] if target.dev else sorted(packages) if target.build else []
    if target.dev:
        names.append(DOCS)
    for extra in target.extras:
        if not (layout.requirements / f'{extra}.txt').is_file():
            raise WorkspaceError(
                f'There is no {extra}.txt in {layout.requirements}.',
                f'`make pins` makes it from {extra}.in.',
            )
    steps = environment.steps(read_state(layout.state), [*names, *target.extras])
    if not target.build:
        return steps
    builder = Builder(layout, environment.base, environment.underlay.kind, target.jobs)
    stale = builder.stale(builder.fingerprints(packages))
    wanted = needed_packages(found, (), environment.underlay)
    gone = [name for name in builder.leftovers(wanted) if name not in stale]
    if gone:
        steps.append(Step(f'Removing {", ".join(gone)}', lambda _runner: builder.remove(gone)))
    if stale:
        title = f'Building {", ".join(stale)}'
        steps.append(Step(title, lambda runner: builder.build(runner, packages, stale)))
    return steps


def carry_out(steps: Sequence[Step], runner: Runner) -> None:
    """Execute the steps; announce and time each."""
    begin = time.monotonic()
    for number, step in enumerate(steps, 1):
        head = f'[{number}/{len(steps)}] {step.title}'
        print(f'{head} ...', flush=True)
        start = time.monotonic()
        step.run(runner)
        print(f'      {time.monotonic() - start:.1f} s', flush=True)
    if steps:
        print(f'Ready after {time.monotonic() - begin:.0f} s.', flush=True)


COMMON = 'common'  # only included by others
BASE = ('uv', 'ros-wheels', 'apt')


def pinned_names(requirements: Path) -> list[str]:
    """List the files to pin: the base first, then those that its versions constrain."""
    found = sorted(path.stem for path in requirements.glob('*.in'))
    return [*BASE, *(name for name in found if name not in {*BASE, COMMON})]


def renew(layout: Layout, runner: Runner) -> None:
    """Pin the newest versions that fit, with their hashes, for every supported Python."""
    for name in pinned_names(layout.requirements):
        print(f'Pinning {name}.in', flush=True)
        command: list[Argument] = [
            layout.venv / 'bin' / 'uv',
            'pip',
            'compile',
            '--universal',
            '--upgrade',
        ]
        options = ['--python-version', '.'.join(map(str, PYTHON_OLDEST)), '--generate-hashes']
        options += ['--no-annotate', '--no-emit-index-url', '--quiet']
        if name not in BASE:
            # the message extensions of each ROS need the numpy that they were built for
            options += ['--no-emit-package', 'numpy']
        options += ['--custom-compile-command', 'make pins', '--output-file', f'{name}.txt']
        where = Runner(runner.environ, layout.requirements, runner.lock)
        where.run(f'Pinning {name}.in', [*command, *options, f'{name}.in'])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog='workspace', description=__doc__)
    parser.add_argument('--python', default='', help='interpreter to make .venv from')
    commands = parser.add_subparsers(dest='command', required=True)
    setup = commands.add_parser('setup', help='make the environment')
    setup.add_argument('--dev', action='store_true', help='with the tools for testing')
    build = commands.add_parser('build', help='make the environment and build packages')
    build.add_argument('--dev', action='store_true', help='with the tools for testing')
    build.add_argument(
        '--with',
        dest='extras',
        action='append',
        default=[],
        metavar='NAME',
        help='what requirements/NAME.txt pins, too',
    )
    build.add_argument(
        '--jobs', type=int, default=default_jobs(), help='compilers at the same time (%(default)s)'
    )
    build.add_argument('packages', nargs='*', help='with what they need; none means all')
    commands.add_parser('lint', help='make the environment and check the code')
    commands.add_parser('docs', help='make the environment and build the manual')
    commands.add_parser('pins', help='renew the pinned requirements')
    commands.add_parser('missing', help='name the system packages that are missing')
    return parser


def _target(options: argparse.Namespace) -> Target:
    if options.command == 'build':
        return Target(
            dev=options.dev,
            packages=tuple(options.packages),
            extras=tuple(options.extras),
            jobs=max(1, options.jobs),
        )
    if options.command == 'docs':
        return Target(build=False, extras=(DOCS,))
    return Target(dev=options.command in {'lint', 'pins'} or options.dev, build=False)


def _run(options: argparse.Namespace) -> int:
    layout = this_checkout()
    underlay = find_underlay(os.environ, layout.venv)
    python = choose_python(options.python, underlay, read_state(layout.state), sys.executable)
    environment = Environment(layout, underlay, python)
    if options.command == 'missing':
        print(*missing_packages(underlay, probe(python)), sep='\n')
        return 0
    with exclusive(layout.lock) as lock:
        runner = Runner(os.environ, layout.root, lock)
        steps = plan(environment, _target(options))
        carry_out(steps, runner)
        if not steps and options.command in {'setup', 'build'}:
            print('All is up to date.')
        if options.command == 'pins':
            renew(layout, runner)
    if options.command == 'docs':
        return build_manual(layout, os.environ)
    return lint(layout, os.environ) if options.command == 'lint' else 0


def main(arguments: Sequence[str]) -> int:
    """Run a command; return 0 done, 1 failed with the reason, 130 interrupted."""
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return _run(_parser().parse_args(arguments))
    except (WorkspaceError, OSError) as error:  # the latter: disk full, read-only, ...
        print(f'error: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print('Interrupted; run again to go on.', file=sys.stderr)
        return 130
