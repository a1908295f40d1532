# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Topics and services of an I/O module and an encoder, over DDS and a real bus."""

from __future__ import annotations

from collections.abc import Iterator
import math
from pathlib import Path
import re

from canopen_interfaces.msg import COData
from canopen_interfaces.srv import COTargetDouble
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from isolation import reserve
import pytest
from ros_client import LATCHED
from sensor_msgs.msg import JointState
from simulated_arm import SimulatedArm
from std_msgs.msg import Float64MultiArray, String, UInt8MultiArray
from std_srvs.srv import Trigger

from arm_msgs.srv import InjectFault, WriteObject

pytestmark = pytest.mark.scenario
BUS_YML = Path(__file__).parents[1] / 'arm_canopen' / 'eds' / 'io_bus.yml'
TIMEOUT = 30.0  # [s]


@pytest.fixture(scope='module')
def devices() -> Iterator[SimulatedArm]:
    """Boot both, for all tests of this module."""
    with (
        reserve() as isolation,
        SimulatedArm(isolation, BUS_YML, [], ['-p', 'robot_joint_states:=true']) as started,
    ):
        yield started


def _status(devices: SimulatedArm, name: str, level: bytes, **values: str) -> dict[str, str]:
    """Wait for a level and values of a device in /diagnostics; return all, and its message."""
    arrays = devices.client.listen(DiagnosticArray, '/diagnostics')

    def found() -> list[DiagnosticStatus]:
        newest = arrays[-1].status if arrays else []
        return [
            each
            for each in newest
            if each.name == name
            and each.level == level
            and values.items() <= {value.key: value.value for value in each.values}.items()
        ]

    devices.client.spin_until(lambda: bool(found()), TIMEOUT, name)
    (status,) = found()
    return {'message': status.message} | {value.key: value.value for value in status.values}


def test_outputs_are_written_and_inputs_published(devices: SimulatedArm) -> None:
    """One element for each line; what does not fit is refused, and the outputs stay."""
    client = devices.client
    shown = _status(devices, 'io: device', DiagnosticStatus.OK)
    assert shown['digital_outputs'] == shown['analog_outputs'] == 'not commanded since the boot'
    assert shown['outputs_on_loss'].startswith('0x6200:01 bits 0xFF to those of 0x00, ')
    digital = client.listen(UInt8MultiArray, '/io/digital_inputs', LATCHED)
    analog = client.listen(Float64MultiArray, '/io/analog_inputs', LATCHED)
    client.spin_until(lambda: bool(digital and analog), TIMEOUT, 'the latched inputs')
    assert list(digital[-1].data) == [0] * 16
    assert list(analog[-1].data) == [0.0] * 4
    lines = client.node.create_publisher(UInt8MultiArray, '/io/digital_outputs', 10)
    values = client.node.create_publisher(Float64MultiArray, '/io/analog_outputs', 10)
    ready = lambda: lines.get_subscription_count() and values.get_subscription_count()  # noqa: E731
    client.spin_until(lambda: bool(ready()), TIMEOUT, 'the subscriptions of the master')
    wanted = [1, 0, 1] + [0] * 12 + [1]
    for refused in ([1], [2] + [0] * 15):
        lines.publish(UInt8MultiArray(data=refused))
    lines.publish(UInt8MultiArray(data=wanted))
    for beyond in ([40_000.0, 0.0], [0.5, 0.0], [math.nan, 0.0]):
        values.publish(Float64MultiArray(data=beyond))
    values.publish(Float64MultiArray(data=[-300.0, 7.0]))
    client.spin_until(lambda: list(digital[-1].data) == wanted, TIMEOUT, 'the inputs')
    client.spin_until(lambda: list(analog[-1].data)[:2] == [-300.0, 7.0], TIMEOUT, 'the values')
    assert len(digital) == len(analog) == 2  # nothing between
    for word in (
        '1 values for 16 outputs; write one for each, 0 or 1',
        'output 1 cannot be 2; write 0 or 1',
        '0x6411:01 of io cannot hold 40000.0 (INTEGER16: -32768 to 32767)',
        '0x6411:01 of io cannot hold 0.5',
        '0x6411:01 of io cannot hold nan',
    ):
        devices.master.wait_for(re.escape(word), TIMEOUT)
    assert _status(devices, 'io: device', DiagnosticStatus.OK)['digital_outputs'] == ''.join(
        map(str, wanted)
    )


def test_any_object_is_published_and_received_as_with_ros2_canopen(devices: SimulatedArm) -> None:
    """`~/tpdo` sends an RPDO, `~/rpdo` has each object of a TPDO."""
    client = devices.client
    received = client.listen(COData, '/io/rpdo')
    sender = client.node.create_publisher(COData, '/io/tpdo', 10)
    client.spin_until(lambda: bool(sender.get_subscription_count()), TIMEOUT, 'the master')
    client.spin_for(0.5)  # in which it sees who listens
    sender.publish(COData(index=0x6000, subindex=1, data=1))
    sender.publish(COData(index=0x6200, subindex=1, data=9))
    wanted = (0x6000, 1, 9)
    shown = lambda: [(each.index, each.subindex, each.data) for each in received]  # noqa: E731
    client.spin_until(lambda: wanted in shown(), TIMEOUT, 'the input')
    devices.master.wait_for('~/tpdo: 0x6000:01 is in no RPDO of the device; map it', TIMEOUT)


def test_a_lost_module_is_in_error_and_its_outputs_are_not_written_again(
    devices: SimulatedArm,
) -> None:
    """/diagnostics say what the outputs do; after the boot they wait for a command."""
    states = devices.client.listen(String, '/io/nmt_state', LATCHED)
    fault = InjectFault.Request(device='io', fault='disconnect', duration=4.0)
    assert devices.client.call(InjectFault, '/fake_slaves/fault', fault).success
    lost = _status(devices, 'io: device', DiagnosticStatus.ERROR)
    assert 'its outputs: 0x6200:01 bits 0xFF to those of 0x00' in lost['message']
    back = lambda: bool(states) and states[-1].data == 'START'  # noqa: E731
    devices.client.spin_until(back, TIMEOUT, 'the boot')
    again = _status(devices, 'io: device', DiagnosticStatus.OK)
    assert again['digital_outputs'] == 'not commanded since the boot'
    assert again['digital_inputs'] == '0' * 16


def test_inputs_of_a_tpdo_that_does_not_come_are_named_as_unknown(devices: SimulatedArm) -> None:
    """In /diagnostics and once in the log: the topic is silent, the other one is not."""
    client = devices.client
    fault = InjectFault.Request(device='io', fault='tpdo_loss', settings=['pdo=2'])
    assert client.call(InjectFault, '/fake_slaves/fault', fault).success
    assert client.call(Trigger, '/io/nmt_reset_node', Trigger.Request()).success
    devices.master.wait_for('~/analog_inputs is silent: unknown: TPDO 2 not received', TIMEOUT)
    missing = 'unknown: TPDO 2 not received since the boot'
    shown = _status(devices, 'io: device', DiagnosticStatus.OK, analog_inputs=missing)
    assert shown['digital_inputs'] == '0' * 16
    fault.fault, fault.settings = 'none', []
    assert client.call(InjectFault, '/fake_slaves/fault', fault).success
    assert client.call(Trigger, '/io/nmt_reset_node', Trigger.Request()).success
    _status(devices, 'io: device', DiagnosticStatus.OK, analog_inputs='0 0 0 0')


def test_an_encoder_is_a_joint_and_takes_a_preset(devices: SimulatedArm) -> None:
    """Radians by 0x6001, in its own topic and in that of the robot."""
    client = devices.client
    stop = WriteObject.Request(object='Simulated speed', value='0')
    own = client.listen(JointState, '/encoder/joint_states')
    robot = client.listen(JointState, '/joint_states')
    client.spin_until(lambda: bool(own and robot), TIMEOUT, 'joint states')
    assert list(own[-1].name) == list(robot[-1].name) == ['encoder']
    assert own[-1].velocity[0] == pytest.approx(512 / 4096 * math.tau)
    assert own[-1].header.stamp.sec > 0
    assert client.call(WriteObject, '/encoder/write_object', stop).success
    preset = lambda target: client.call(  # noqa: E731
        COTargetDouble, '/encoder/preset', COTargetDouble.Request(target=target)
    )
    assert preset(1.5).success
    client.spin_until(lambda: abs(own[-1].position[0] - 1.5) < 1e-3, TIMEOUT, 'the preset')
    for refused in (-1.0, 4097 * math.tau, math.nan):
        assert not preset(refused).success
    devices.master.wait_for(r'is -651\.899 measuring units; encoder has 0 to', TIMEOUT)
