# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What happens when processes die, on a real bus and over DDS."""

from __future__ import annotations

import signal
import time
from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
from canopen_interfaces.srv import COTargetDouble
import pytest
from simulated_arm import JOINTS, SimulatedArm

from canopen_core.standard import CobId

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario


def test_an_arm_survives_its_processes(isolation: Isolation) -> None:
    """A second master, drives that are killed in motion, and Ctrl-C of the master."""
    with BusRecorder(isolation.bus) as recorder, SimulatedArm(isolation) as arm:
        arm.init_all()
        _leaves_the_bus_to_the_first_master(arm, recorder)
        _boots_drives_again_that_were_killed(arm)
        arm.init_all()
        _start_all(arm, 5.0)
        assert arm.master.stop() == 0, arm.master.output
        assert recorder.last_states() == dict.fromkeys(range(2, 9), 'Switch on disabled')


def _start_all(arm: SimulatedArm, target: float) -> None:
    for joint in JOINTS:
        assert arm.client.trigger(f'/{joint}/position_mode').success
        assert _send(arm, joint, target).success


def _send(arm: SimulatedArm, joint: str, target: float) -> COTargetDouble.Response:
    request = COTargetDouble.Request(target=target)
    return arm.client.call(COTargetDouble, f'/{joint}/target', request)


def _leaves_the_bus_to_the_first_master(arm: SimulatedArm, recorder: BusRecorder) -> None:
    """The second one ends with words and without a frame; the drives stay enabled."""
    begin = time.monotonic()
    second = arm.start('master')
    second.wait_for('another master is on .*SYNC.*beside_master:=true')
    assert second.wait() == 1, second.output
    assert 'Traceback' not in second.output
    assert arm.client.trigger('/panda_joint1/position_mode').success
    after = [frame for frame in recorder.frames if frame.timestamp >= begin]
    assert not [frame for frame in after if frame.can_id == CobId.NMT]
    assert set(recorder.last_states().values()) == {'Operation enabled'}
    assert 'ERROR' not in arm.master.output


def _boots_drives_again_that_were_killed(arm: SimulatedArm) -> None:
    """Each lost drive is named, targets are refused, and a restart boots all again."""
    _start_all(arm, 2.0)
    arm.slaves.signal(signal.SIGKILL)
    arm.slaves.wait()
    for joint in JOINTS:
        arm.master.wait_for(f'{joint}: heartbeat lost', 10.0)
    assert not _send(arm, 'panda_joint1', 0.0).success
    arm.master.wait_for('panda_joint1 takes no target.*offline')
    refused = arm.client.trigger('/panda_joint1/enable')
    assert not refused.success
    assert 'offline' in refused.message
    arm.start('fake_slaves')
    arm.master.wait_for('all 7 devices operational', 20.0, count=2)
