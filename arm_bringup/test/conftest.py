# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lets the tests of this package run before it is built."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]


@pytest.fixture(scope='session', autouse=True)
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Make a ROS prefix in which arm_bringup is this source folder, found before any other."""
    prefix = tmp_path_factory.mktemp('prefix')
    marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / 'arm_bringup'
    marker.parent.mkdir(parents=True)
    marker.touch()
    (prefix / 'share' / 'arm_bringup').symlink_to(PACKAGE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('AMENT_PREFIX_PATH', str(prefix), prepend=':')
        yield prefix
