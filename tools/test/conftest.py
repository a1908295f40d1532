# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A small checkout with fake programs, in which the set-up can be tried without a network."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import os
from pathlib import Path
import sys

from fake_programs import FakeRunner, imitate_builders
import pytest

from workspace.environment import Environment
from workspace.layout import Layout
from workspace.process import exclusive, Runner
from workspace.underlay import Underlay, UnderlayKind

MANIFEST = """<package format="3">
  <name>{name}</name>
  {depends}
  {tests}
  {group}
  <export><build_type>{build_type}</build_type></export>
</package>
"""
SETUP = """from setuptools import find_packages, setup

setup(
    name='{name}',
    version='1.2',
    packages=find_packages(include=['{name}', '{name}.*']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/{name}']),
        ('share/{name}', ['package.xml']),
    ],
    entry_points={{'console_scripts': ['run = {name}:main']}},
)
"""


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
def environment(layout: Layout, monkeypatch: pytest.MonkeyPatch) -> Environment:
    """The environment of that checkout, on wheels, on a system that lacks nothing."""
    monkeypatch.setattr('workspace.environment.check', lambda *_: None)
    return Environment(layout, Underlay(UnderlayKind.WHEELS, layout.venv), sys.executable)


@pytest.fixture
def add_package(layout: Layout) -> Callable[..., Path]:
    """A function that adds a package to the checkout."""

    def add(
        name: str,
        *depends: str,
        folder: str = '',
        build_type: str = 'ament_python',
        tests: str = '',
    ) -> Path:
        where = layout.root / folder / name
        where.mkdir(parents=True)
        group = '<member_of_group>rosidl_interface_packages</member_of_group>'
        (where / 'package.xml').write_text(
            MANIFEST.format(
                name=name,
                depends=''.join(f'<depend>{other}</depend>' for other in depends),
                tests=f'<test_depend>{tests}</test_depend>' if tests else '',
                group=group if build_type == 'ament_cmake' else '',
                build_type=build_type,
            )
        )
        if build_type == 'ament_python':
            (where / 'setup.py').write_text(SETUP.format(name=name))
            for file in (f'{name}/__init__.py', f'resource/{name}'):
                (where / file).parent.mkdir(parents=True, exist_ok=True)
                (where / file).touch()
        return where

    return add


@pytest.fixture
def fake(layout: Layout, lock: int) -> Callable[..., FakeRunner]:
    """A function that makes a runner of imitated programs."""

    def make(fail_at: int = 0) -> FakeRunner:
        def effect(arguments: list[str]) -> None:
            imitate_builders(layout, arguments)
            if 'venv' in arguments:
                layout.venv_python.parent.mkdir()
                layout.venv_python.touch()
            if arguments[-1].endswith('.paths.json'):
                Path(arguments[-1]).write_text(f'["{layout.venv}/lib", "/include", "/numpy"]')

        return FakeRunner({}, layout.root, lock, fail_at=fail_at, effect=effect)

    return make
