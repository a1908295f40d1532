# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One move_group of the Panda for all tests."""

from __future__ import annotations

from collections.abc import Iterator

from isolation import reserve
from move_group_rig import MoveGroupRig, panda_parameters
import pytest


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run all tests of a move_group in one worker: others would start one of their own."""
    for item in items:
        for shared in {'running_rig', 'panda'}.intersection(getattr(item, 'fixturenames', ())):
            item.add_marker(pytest.mark.xdist_group(shared))


@pytest.fixture(name='running_rig', scope='session')
def start_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MoveGroupRig]:
    """Start move_group and a trajectory controller."""
    path = panda_parameters(tmp_path_factory.mktemp('robot'))
    with (
        reserve() as isolation,
        MoveGroupRig(isolation, '--ros-args', '--params-file', str(path)) as rig,
    ):
        rig.serve_arm('panda_arm_controller')
        yield rig


@pytest.fixture(name='rig')
def reset_rig(running_rig: MoveGroupRig) -> MoveGroupRig:
    """Return move_group with the robot at ready and an empty scene."""
    running_rig.reset()
    return running_rig
