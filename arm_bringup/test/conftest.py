# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lets the tests of this package run before it is built."""

from __future__ import annotations

from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]


@pytest.fixture(scope='session')
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a ROS prefix in which arm_bringup is this source folder."""
    prefix = tmp_path_factory.mktemp('prefix')
    marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / 'arm_bringup'
    marker.parent.mkdir(parents=True)
    marker.touch()
    (prefix / 'share' / 'arm_bringup').symlink_to(PACKAGE)
    return prefix


@pytest.fixture(autouse=True)
def find_own_package(prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Find it there before any other, for one test: others need the built packages."""
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix), prepend=':')
