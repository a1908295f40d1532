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

from arm_canopen.standard import CobId

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario


def test_slaves_killed_in_motion_come_back(isolation: Isolation) -> None:
    """Each lost drive is named, targets are refused, and a restart boots all again."""
    with SimulatedArm(isolation) as arm:
        arm.init_all()
        for joint in JOINTS:
            assert arm.client.trigger(f'/{joint}/position_mode').success
            request = COTargetDouble.Request(target=2.0)
            assert arm.client.call(COTargetDouble, f'/{joint}/target', request).success
        arm.slaves.signal(signal.SIGKILL)
        arm.slaves.wait()
        for joint in JOINTS:
            arm.master.wait_for(f'{joint}: heartbeat lost', 10.0)
        request = COTargetDouble.Request(target=0.0)
        assert not arm.client.call(COTargetDouble, '/panda_joint1/target', request).success
        arm.master.wait_for('panda_joint1 takes no target.*offline')
        refused = arm.client.trigger('/panda_joint1/enable')
        assert not refused.success
        assert 'offline' in refused.message

        arm.start('fake_slaves')
        arm.master.wait_for('all 7 devices operational', 20.0, count=2)
        arm.init_all()


def test_ctrl_c_leaves_every_drive_disabled(isolation: Isolation) -> None:
    """After Ctrl-C in motion the last statusword of each drive is Switch on disabled."""
    with BusRecorder(isolation.bus) as recorder, SimulatedArm(isolation) as arm:
        arm.init_all()
        for joint in JOINTS:
            assert arm.client.trigger(f'/{joint}/position_mode').success
            request = COTargetDouble.Request(target=5.0)
            assert arm.client.call(COTargetDouble, f'/{joint}/target', request).success
        assert arm.master.stop() == 0, arm.master.output
        states = recorder.last_states()
        assert states == dict.fromkeys(range(2, 9), 'Switch on disabled')


def test_a_second_master_leaves_the_bus_of_the_first_alone(isolation: Isolation) -> None:
    """It ends with words and without a frame; the drives of the first stay enabled."""
    with SimulatedArm(isolation) as arm, BusRecorder(isolation.bus) as recorder:
        arm.init_all()
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
