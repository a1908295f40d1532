# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Fixtures: the `ros2` command, and a ROS domain with nodes in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
import sys

from frontend_cli import Ros2, runner, with_frontend
from isolation import reserve
from processes import RunningProcess
import pytest


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run all tests of the zoo in one worker: its nodes publish all the time."""
    for item in items:
        if 'zoo' in getattr(item, 'fixturenames', ()):
            item.add_marker(pytest.mark.xdist_group('zoo'))


@pytest.fixture
def ros2(capsys: pytest.CaptureFixture[str]) -> Ros2:
    """Run a command line in this process."""
    return runner(capsys)


@pytest.fixture(scope='module')
def zoo_env() -> Iterator[Mapping[str, str]]:
    """Yield the environment of a domain in which the zoo runs."""
    with reserve() as isolation:
        env = with_frontend(isolation.env)
        zoo_program = str(Path(__file__).with_name('frontend_zoo.py'))
        with RunningProcess([sys.executable, zoo_program], env) as zoo:
            zoo.wait_for('^ready$')
            yield env


@pytest.fixture
def zoo(zoo_env: Mapping[str, str], monkeypatch: pytest.MonkeyPatch) -> Mapping[str, str]:
    """Put this process into the domain of the zoo."""
    monkeypatch.setenv('ROS_DOMAIN_ID', zoo_env['ROS_DOMAIN_ID'])
    return zoo_env
