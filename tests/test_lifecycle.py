# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lifecycle drivers in bus.yml: managed nodes and their manager, over DDS and a real bus."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
from canopen_interfaces.srv import COTargetDouble
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
import pytest
from simulated_arm import JOINTS, panda_bus, SimulatedArm

if TYPE_CHECKING:
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario
NODES = ['master', *JOINTS]


@pytest.fixture
def lifecycle_bus(tmp_path: Path) -> Path:
    """The Panda's bus with lifecycle drivers."""
    text = panda_bus().read_text().replace('"@BUS_CONFIG_PATH@"', f'"{panda_bus().parent}"')
    for name in ('MasterDriver', 'Cia402Driver'):
        text = text.replace(f'::{name}', f'::Lifecycle{name}')
    path = tmp_path / 'bus.yml'
    path.write_text(text)
    return path


def change(arm: SimulatedArm, node: str, label: str) -> bool:
    """Ask for a transition by its label, as ``ros2 lifecycle set`` does."""
    request = ChangeState.Request(transition=Transition(label=label))
    return bool(arm.client.call(ChangeState, f'/{node}/change_state', request).success)


def states(arm: SimulatedArm) -> set[str]:
    """Return the states that occur among master and joints."""
    return {arm.client.call(GetState, f'/{node}/get_state').current_state.label for node in NODES}


def test_the_manager_brings_up_and_deactivation_disables(
    isolation: Isolation, lifecycle_bus: Path
) -> None:
    """Inactive nodes refuse in words; deactivated in motion, every drive stops and is off."""
    with BusRecorder(isolation.bus) as recorder, SimulatedArm(isolation, lifecycle_bus) as arm:
        assert states(arm) == {'unconfigured'}
        assert set(_said(arm, 'nodes')) == {f'/{node}' for node in ['lifecycle_manager', *NODES]}
        _said(arm, 'set', '/panda_joint1', 'configure')
        assert _said(arm, 'get', '/panda_joint1') == ['inactive [2]']
        _said(arm, 'set', '/panda_joint1', 'cleanup')
        refused = arm.client.trigger('/panda_joint1/init')
        assert not refused.success
        assert 'panda_joint1 is unconfigured, not active' in refused.message
        assert not change(arm, 'lifecycle_manager', 'activate')  # not before configure

        assert change(arm, 'lifecycle_manager', 'configure')
        assert change(arm, 'lifecycle_manager', 'activate')
        assert states(arm) == {'active'}
        arm.init_all()
        for joint in JOINTS:
            assert arm.client.trigger(f'/{joint}/position_mode').success
            request = COTargetDouble.Request(target=5.0)
            assert arm.client.call(COTargetDouble, f'/{joint}/target', request).success

        assert change(arm, 'panda_joint2', 'deactivate')
        off = 'Switch on disabled'
        arm.client.spin_until(lambda: recorder.last_states()[3] == off, 20.0, 'the last frame')
        assert recorder.last_states()[2] == 'Operation enabled'
        assert not arm.client.trigger('/panda_joint2/enable').success
        assert change(arm, 'lifecycle_manager', 'deactivate')
        assert states(arm) == {'unconfigured'}
        all_off = dict.fromkeys(range(2, 9), off)
        arm.client.spin_until(lambda: recorder.last_states() == all_off, 20.0, 'the last frames')

        assert change(arm, 'lifecycle_manager', 'activate')
        arm.init_all()


def _said(arm: SimulatedArm, *words: str) -> list[str]:
    """Return what ``ros2 lifecycle`` prints."""
    process = arm.run('ros2', 'lifecycle', *words)
    assert process.wait() == 0, process.output
    return process.lines
