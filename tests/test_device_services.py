# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects by name and NMT commands, over DDS and a real bus."""

from __future__ import annotations

from typing import TYPE_CHECKING

from canopen_interfaces.srv import CONmtID
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from simulated_arm import SimulatedArm
from std_msgs.msg import String

from arm_msgs.srv import ReadObject, WriteObject

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario
JOINT = '/panda_joint3'
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def read(arm: SimulatedArm, path: str) -> ReadObject.Response:
    """Read an object of the joint."""
    return arm.client.call(ReadObject, f'{JOINT}/read_object', ReadObject.Request(object=path))


def write(
    arm: SimulatedArm, path: str, value: str = '', data: bytes = b''
) -> WriteObject.Response:
    """Write an object of the joint."""
    request = WriteObject.Request(object=path, value=value, data=data)
    return arm.client.call(WriteObject, f'{JOINT}/write_object', request)


def test_objects_are_read_and_written_by_name(isolation: Isolation) -> None:
    """Any type comes as text and as bytes; what fails says why."""
    with SimulatedArm(isolation) as arm:
        answer = read(arm, 'Profile velocity')
        assert (answer.success, answer.message) == (True, '')
        assert (answer.index, answer.type, answer.value) == (0x6081, 'UNSIGNED32', '1000')
        assert bytes(answer.data) == (1000).to_bytes(4, 'little')
        text = read(arm, '0x1008')
        assert text.type == 'VISIBLE_STRING'
        assert text.value == bytes(text.data).decode()
        assert len(text.value) > 4

        done = write(arm, 'software position limit/min', '-2000')
        assert (done.success, done.index, done.subindex) == (True, 0x607D, 1), done.message
        assert '= -2000' in done.message
        assert read(arm, '0x607D:01').value == '-2000'
        assert write(arm, '0x607D:01', data=(0).to_bytes(4, 'little')).success
        assert read(arm, '0x607D:01').value == '0'

        for refused, words in (
            (read(arm, 'Contrlword'), '0x6040:00 Controlword'),
            (read(arm, str(0x6041)), "object: '0x6041'"),  # what YAML makes of { object: 0x6041 }
            (write(arm, str(0x6081), '1'), "object: '0x6081'"),
            (write(arm, 'Profile velocity', 'fast'), "'fast'"),
            (write(arm, 'Statusword', '1'), 'read'),
            (write(arm, 'Controlword', '15'), 'written by its driver'),
        ):
            assert not refused.success
            assert words in refused.message


def test_nmt_commands_reach_one_device_or_all(isolation: Isolation) -> None:
    """Each service of a device, the master's for any, and a state that says what was received."""
    with SimulatedArm(isolation) as arm:
        states = arm.client.listen(String, f'{JOINT}/nmt_state', LATCHED)

        def expect(state: str) -> None:
            arm.client.spin_until(lambda: bool(states) and states[-1].data == state, 5.0, state)

        expect('START')
        for service, state in (
            ('nmt_stop_node', 'STOP'),
            ('nmt_start_node', 'START'),
            ('nmt_enter_pre_operational', 'PREOP'),
        ):
            assert arm.client.trigger(f'{JOINT}/{service}').success
            expect(state)
        everybody = CONmtID.Request(nmtcommand=1, nodeid=0)
        assert arm.client.call(CONmtID, '/master/set_nmt', everybody).success
        expect('START')
        nonsense = CONmtID.Request(nmtcommand=7, nodeid=0)
        assert not arm.client.call(CONmtID, '/master/set_nmt', nonsense).success
        arm.master.wait_for('nmtcommand 7 is none of 1 START')
        for service in ('nmt_reset_communication', 'nmt_reset_node'):
            count = len([line for line in arm.master.lines if 'panda_joint3: operational' in line])
            assert arm.client.trigger(f'{JOINT}/{service}').success
            arm.master.wait_for('panda_joint3: operational', count=count + 1)
            expect('START')
