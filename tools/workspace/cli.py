# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The commands behind the Makefile."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
import signal
import sys

from .build import default_jobs
from .environment import choose_python, DOCS, Environment
from .errors import WorkspaceError
from .layout import this_checkout
from .lint import build_manual, lint
from .pins import renew
from .plan import carry_out, plan, Target
from .process import exclusive, Runner
from .state import read_state
from .system import missing_packages, probe
from .underlay import find_underlay


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
