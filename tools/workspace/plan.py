# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Decides what has to be done, and does it with a word on each step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import time

from .build import Builder, default_jobs
from .environment import DEV, DOCS, Environment, Step
from .errors import WorkspaceError
from .packages import find_packages, needed_packages
from .process import Runner
from .state import read_state


@dataclass(frozen=True, slots=True)
class Target:
    """What a target needs.

    Attributes:
        dev: Whether the tools for testing, and all that any package imports.
        build: Whether any package.
        packages: Which ones; none means all.
        extras: Requirements files besides, which no package needs by itself.
        jobs: Greatest number of compilers at the same time.
    """

    dev: bool = False
    build: bool = True
    packages: tuple[str, ...] = ()
    extras: tuple[str, ...] = ()
    jobs: int = field(default_factory=default_jobs)


def plan(environment: Environment, target: Target) -> list[Step]:
    """List the steps from what is there to what is wanted.

    Raises:
        WorkspaceError: The workspace does not have a package or an extra that is wanted.
    """
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
    """Do the steps, each announced and timed.

    Raises:
        WorkspaceError: A step failed; those before it stay done.
    """
    begin = time.monotonic()
    for number, step in enumerate(steps, 1):
        head = f'[{number}/{len(steps)}] {step.title}'
        print(f'{head} ...', flush=True)
        start = time.monotonic()
        step.run(runner)
        print(f'      {time.monotonic() - start:.1f} s', flush=True)
    if steps:
        print(f'Ready after {time.monotonic() - begin:.0f} s.', flush=True)
