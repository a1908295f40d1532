# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A small checkout with fake programs, in which the set-up can be tried without a network."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
import os
from pathlib import Path
import sys

import pytest

from workspace.environment import Environment
from workspace.layout import Layout
from workspace.lock import exclusive
from workspace.process import Runner
from workspace.underlay import Underlay, UnderlayKind

MANIFEST = """<package format="3">
  <name>{name}</name>
  {depends}
  {group}
  <export><build_type>{build_type}</build_type></export>
</package>
"""


@dataclass(frozen=True)
class FakeRunner(Runner):
    """Notes what it is asked to run and, like the real programs, leaves the files behind.

    Attributes:
        seen: What was run so far.
        fail_at: Number of the run that ends with an exception, 0 for none.
        effect: Called with the arguments of each run.
    """

    seen: list[str] = field(default_factory=list)
    fail_at: int = 0
    effect: Callable[[list[str]], None] = lambda _arguments: None

    def run(self, what: str, arguments: object, **_options: object) -> None:
        """Note it; raise as a kill would end it, or do what the program does."""
        assert isinstance(arguments, list)
        self.seen.append(what)
        if len(self.seen) == self.fail_at:
            raise KeyboardInterrupt
        self.effect([str(argument) for argument in arguments])


@pytest.fixture
def lock(tmp_path: Path) -> Iterator[int]:
    """A lock that is held."""
    with exclusive(tmp_path / 'lock') as descriptor:
        yield descriptor


@pytest.fixture
def runner(tmp_path: Path, lock: int) -> Runner:
    """A runner of real programs."""
    return Runner(os.environ, tmp_path, lock)


@pytest.fixture
def layout(tmp_path: Path) -> Layout:
    """A checkout with requirements and no packages."""
    made = Layout(tmp_path / 'checkout')
    made.requirements.mkdir(parents=True)
    for name in ('uv', 'ros-wheels', 'apt', 'dev'):
        (made.requirements / f'{name}.txt').write_text(f'{name}==1\n')
    return made


@pytest.fixture
def environment(layout: Layout) -> Environment:
    """The environment of that checkout, on wheels."""
    return Environment(layout, Underlay(UnderlayKind.WHEELS, layout.venv), sys.executable)


@pytest.fixture
def add_package(layout: Layout) -> Callable[..., Path]:
    """A function that adds a package to the checkout."""

    def add(name: str, *depends: str, folder: str = '', build_type: str = 'ament_python') -> Path:
        where = layout.root / folder / name
        where.mkdir(parents=True)
        group = '<member_of_group>rosidl_interface_packages</member_of_group>'
        (where / 'package.xml').write_text(
            MANIFEST.format(
                name=name,
                depends=''.join(f'<depend>{other}</depend>' for other in depends),
                group=group if build_type == 'ament_cmake' else '',
                build_type=build_type,
            )
        )
        return where

    return add


def imitate_colcon(layout: Layout, arguments: list[str]) -> None:
    """Leave behind what colcon does for the packages that it is told to build."""
    if 'colcon' not in arguments:
        return
    begin, end = arguments.index('--packages-select') + 1, arguments.index('--cmake-args')
    for name in arguments[begin:end]:
        share = layout.install / name / 'share'
        for path in (share / name / 'package.xml', share / 'colcon-core' / 'packages' / name):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        (layout.build / name).mkdir(parents=True, exist_ok=True)
        (layout.build / name / 'colcon_build.rc').write_text('0\n')
    (layout.install / 'local_setup.bash').touch()


@pytest.fixture
def fake(layout: Layout, lock: int) -> Callable[..., FakeRunner]:
    """A function that makes a runner of imitated programs."""

    def make(fail_at: int = 0) -> FakeRunner:
        def effect(arguments: list[str]) -> None:
            imitate_colcon(layout, arguments)
            if arguments[-1].endswith('.paths.json'):
                Path(arguments[-1]).write_text(f'["{layout.venv}/lib", "/include", "/numpy"]')

        return FakeRunner({}, layout.root, lock, fail_at=fail_at, effect=effect)

    return make
