# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Imitations of the programs that the set-up runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import json
from pathlib import Path

from workspace.layout import Layout
from workspace.process import Runner


@dataclass(frozen=True)
class FakeRunner(Runner):
    """Notes what it is to run and, like the real programs, leaves the files behind."""

    seen: list[str] = field(default_factory=list)  # what was run so far
    fail_at: int = 0  # number of the run that ends with an exception, 0 for none
    # called with the arguments of each run
    effect: Callable[[list[str]], None] = lambda _arguments: None

    def run(self, what: str, arguments: object, **_options: object) -> None:
        """Note it; raise as a kill would end it, or do what the program does."""
        assert isinstance(arguments, list)
        self.seen.append(what)
        if len(self.seen) == self.fail_at:
            raise KeyboardInterrupt
        self.effect([str(argument) for argument in arguments])


def imitate_builders(layout: Layout, arguments: list[str]) -> None:
    """Make the files of colcon, or of the builder of interfaces, for the packages it builds."""
    if 'colcon' in arguments:
        begin, end = arguments.index('--packages-select') + 1, arguments.index('--cmake-args')
        for name in arguments[begin:end]:
            imitate_package(layout.install / name, name)
            (layout.build / name).mkdir(parents=True, exist_ok=True)
            (layout.build / name / 'colcon_build.rc').write_text('0\n')
        (layout.install / 'local_setup.bash').touch()
    elif arguments[1].endswith('interfaces.py'):
        for name in json.loads(arguments[2])['packages']:
            (layout.build / name).mkdir(parents=True, exist_ok=True)
            imitate_package(layout.install, name)


def imitate_package(prefix: Path, name: str) -> None:
    """Install the mark and the manifest of a package."""
    index = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages'
    for path in (index / name, prefix / 'share' / name / 'package.xml'):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
