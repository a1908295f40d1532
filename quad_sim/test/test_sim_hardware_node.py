# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""hardware_node and the simulated robot: it stands up in physics, in each protocol."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
import math
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from isolation import Isolation, reserve
from processes import executable, RunningProcess
import pytest
from std_msgs.msg import Float64

from node_runner import LATCHED
from quad_description import movable_joints, Pose, pose_positions, robot_urdf
from quad_msgs.msg import FootContacts
from quad_node_rig import Rig, TIMEOUT

pytestmark = [pytest.mark.scenario, pytest.mark.xdist_group('sim_hardware_node')]

NAMES = [joint.name for joint in movable_joints(robot_urdf('lite'))]
STAND = [pose_positions(Pose.STAND)[name] for name in NAMES]


class XgoRig(Rig):
    """The node with the simulated robot, each a process."""

    arguments: tuple[str, ...] = ()  # of the simulated robot

    def _add_robot(self, stack: ExitStack, port: Path) -> None:
        xgo = [executable('quad_sim', 'fake_xgo'), '--link', str(port), *self.arguments]
        process = stack.enter_context(RunningProcess(xgo, self._env))
        process.wait_for(str(port))


@pytest.fixture(scope='module')
def shared_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[XgoRig]:
    """The node with a simulated robot, started once."""
    port = tmp_path_factory.mktemp('xgo') / 'x'
    with reserve() as isolation, XgoRig(isolation, port, '-p', 'protocol:=v2') as rig:
        yield rig


@pytest.fixture
def rig(shared_rig: XgoRig) -> XgoRig:
    """The robot, standing."""
    shared_rig.stream(STAND, 1.2)
    shared_rig.received['/joint_states'].clear()
    return shared_rig


def test_it_stands_up(rig: XgoRig) -> None:
    """Joints where they were sent, the height that physics has, the footprint on the ground."""
    rig.stream(STAND, 0.5)
    joints = rig.receive('/joint_states', 2)
    assert list(joints.position) == pytest.approx(STAND, abs=0.1)
    odom = rig.receive('/odom')
    truth = rig.receive('/fake_xgo/ground_truth')
    height = truth.pose.pose.position.z
    assert height > 0.07
    assert odom.pose.pose.position.z == pytest.approx(height, abs=0.01)
    to_base, to_footprint = rig.receive('/tf').transforms
    below = to_footprint.transform.translation
    assert math.hypot(below.x, below.y, below.z) == pytest.approx(
        to_base.transform.translation.z, abs=1e-6
    )
    for topic, source in (
        ('/foot_contacts', FootContacts.MEASURED_HEIGHT),
        ('/fake_xgo/foot_contacts', FootContacts.PHYSICS),
    ):
        contacts = rig.receive(topic)
        assert (list(contacts.contact), contacts.source) == ([True] * 4, source)
    assert rig.receive('/imu').linear_acceleration.z == pytest.approx(9.8, abs=0.6)


def test_the_old_protocol_does_as_well(rig: XgoRig) -> None:
    """The same robot, asked in protocol v1: the gyro is measured, joints are coarser."""
    rig.restart('-p', 'protocol:=v1')
    rig.stream(STAND, 1.2)
    assert list(rig.receive('/joint_states', 3).position) == pytest.approx(STAND, abs=0.1)
    covariance = rig.receive('/imu').angular_velocity_covariance
    assert covariance[0] == pytest.approx(0.02**2)
    errors = rig.client.listen(Float64, '/joint_velocity_error', LATCHED)
    rig.client.spin_until(lambda: bool(errors), TIMEOUT, 'the error of joint velocities')
    assert errors[-1].data >= 0.5


class DeveloperRig(XgoRig):
    """The same with a mini and the vendor's developer firmware."""

    arguments = ('--protocol', 'developer', '--preset', 'mini')


def test_the_developer_firmware_does_as_well(isolation: Isolation, tmp_path: Path) -> None:
    """It is found by itself; what it does not measure is said, and what it measures seldom."""
    with DeveloperRig(isolation, tmp_path / 'x', '-p', 'preset:=mini') as rig:
        rig.stream(STAND, 1.2)
        assert list(rig.receive('/joint_states', 3).position) == pytest.approx(STAND, abs=0.1)
        imu = rig.receive('/imu')
        assert imu.linear_acceleration_covariance[0] == -1.0
        assert imu.angular_velocity_covariance[0] == pytest.approx(0.2**2)
        link = rig.wait_for_status('serial link', DiagnosticStatus.OK, '')
        values = {value.key: value.value for value in link.values}
        assert (values['protocol'], values['firmware']) == ('developer', 'M developer')
        errors = rig.client.listen(Float64, '/joint_velocity_error', LATCHED)
        seldom = 1.2  # [rad/s] 26 times a second; the first few reports know no rate
        rig.client.spin_until(lambda: bool(errors) and errors[-1].data > seldom, TIMEOUT, 'error')
