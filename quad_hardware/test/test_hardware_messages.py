# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages and diagnostics: frames that hang together, covariances that mean something."""

from __future__ import annotations

from dataclasses import replace
import math
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Transform
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from quad_description import (
    ImuSample,
    JointSample,
    movable_joints,
    OdometryState,
    robot_urdf,
    RobotState,
)
from quad_description.rotations import from_rpy, IDENTITY, multiply, rotate, Vector, yaw_of
from quad_description.rotations import Quaternion as Rotation
from quad_hardware.commander import CommandCounters
from quad_hardware.estimation import Estimator, EstimatorSettings, UNCHECKED_DEVIATION
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.link import LinkState, LinkStatus
from quad_hardware.nodes import robot_topics
from quad_hardware.nodes.diagnostics import command_diagnostic, LinkDiagnostic, robot_diagnostic
from quad_hardware.nodes.parameters import Deviations, FootprintMode, Frames
from quad_hardware.protocol import Fault, LEG_MOTORS, ParserCounters
from quad_hardware.report import Report

STAMP = Time(sec=1)
FRAMES = Frames()
PARENT = replace(FRAMES, footprint_mode=FootprintMode.PARENT)
DEVIATIONS = Deviations(angular_velocity_stddev=0.15)
PLACE = OdometryState(1.0, 2.0, 0.11, IDENTITY, 0.2, 0.05, 3.0, (True,) * 4)
IMU = ImuSample(IDENTITY, (0.1, 0.2, 0.3), (0.0, 0.0, 9.8), rate_differentiated=True)
ROTATIONS = st.builds(from_rpy, *[st.floats(-1.2, 1.2)] * 3)


@given(ROTATIONS, st.sampled_from([FRAMES, PARENT]))
def test_both_trees_put_frames_at_the_same_place(rotation: Rotation, frames: Frames) -> None:
    """base_link where odometry has it; base_footprint below it on the ground, level."""
    template, numbers = robot_topics.transforms(replace(PLACE, rotation=rotation), frames)
    first, second = template.message(STAMP, numbers).transforms
    chain = {first.child_frame_id: pose(first.transform)}
    (x, y, z), turn = pose(first.transform)
    offset, further = pose(second.transform)
    moved = rotate(turn, offset)
    chain[second.child_frame_id] = (
        (x + moved[0], y + moved[1], z + moved[2]),
        multiply(turn, further),
    )
    assert second.header.frame_id == first.child_frame_id
    place, attitude = chain['base_link']
    assert place == pytest.approx((1.0, 2.0, 0.11))
    assert rotate(attitude, (1.0, 2.0, 3.0)) == pytest.approx(rotate(rotation, (1.0, 2.0, 3.0)))
    below, level = chain['base_footprint']
    assert below == pytest.approx((1.0, 2.0, 0.0))
    assert rotate(level, (0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, 1.0))
    assert yaw_of(level) == pytest.approx(yaw_of(rotation))


def test_joints_keep_their_order() -> None:
    """Each velocity stands beside its name; efforts, and joints not measured, are left out."""
    joints = JointSample((0.1, 0.5, 0.2), (1.0, 0.0, 2.0), unmeasured=(1,))
    template, numbers = robot_topics.joint_states(('b', 'arm', 'a'), joints)
    message = template.message(STAMP, numbers)
    found = (message.name, *map(list, (message.position, message.velocity, message.effort)))
    assert found == (['b', 'a'], [0.1, 0.2], [1.0, 2.0], [])


def pose(transform: Transform) -> tuple[Vector, Rotation]:
    """Translation and rotation as tuples."""
    t, r = transform.translation, transform.rotation
    return (t.x, t.y, t.z), (r.x, r.y, r.z, r.w)


def imu(sample: ImuSample) -> Imu:
    """The message of a sample."""
    template, numbers = robot_topics.imu(sample, DEVIATIONS, 'imu_link', IDENTITY)
    message: Imu = template.message(STAMP, numbers)
    return message


def odometry(state: OdometryState, frames: Frames) -> Odometry:
    """The message of a place."""
    template, numbers = robot_topics.odometry(IMU, state, DEVIATIONS, frames)
    message: Odometry = template.message(STAMP, numbers)
    return message


def test_joints_are_stamped_when_they_were_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Protocol v1 asks for them 8 ms before the IMU; who differentiates must know."""
    urdf = robot_urdf('lite')
    joints = JointMap(servo_of(joint) for joint in movable_joints(urdf))
    angles = dict.fromkeys(LEG_MOTORS, 0.0)
    state = Report(5.0, 0.0, (0.0, 0.0, 0.0), None, angles, {}, joints_age=0.008)
    stamps: dict[str, float] = {}

    def create_publisher(kind: Any, topic: str, _: Any) -> Any:
        def publish(data: Any) -> None:
            if kind is String:
                return
            message = deserialize_message(data, kind)
            header = message.transforms[0].header if kind is TFMessage else message.header
            stamps[topic] = header.stamp.sec + header.stamp.nanosec * 1e-9

        return SimpleNamespace(publish=publish)

    clock = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=100_000_000_000))
    node: Any = SimpleNamespace(create_publisher=create_publisher, get_clock=lambda: clock)
    estimator = Estimator(urdf, joints, EstimatorSettings())
    robot: Any = SimpleNamespace(names=joints.names, rotation_of=lambda _: IDENTITY)
    monkeypatch.setattr(robot_topics, 'time', SimpleNamespace(monotonic=lambda: 5.5))
    measured = estimator.step(state)
    assert measured is not None
    robot_topics.RobotTopics(node, robot, FRAMES, DEVIATIONS).publish(measured)
    assert stamps.pop('joint_states') == pytest.approx(99.492)
    assert stamps == dict.fromkeys(('imu', 'odom', 'foot_contacts', '/tf'), 99.5)


def test_a_differentiated_rate_says_so_by_its_covariance() -> None:
    """Larger than a gyro's; and minus one when there is none (REP 145)."""
    differentiated = imu(IMU)
    gyro = imu(replace(IMU, rate_differentiated=False))
    none = imu(replace(IMU, angular_velocity=None))
    assert differentiated.angular_velocity_covariance[0] == pytest.approx(0.15**2)
    assert gyro.angular_velocity_covariance[8] == pytest.approx(0.02**2)
    assert none.angular_velocity_covariance[0] == -1.0
    assert differentiated.linear_acceleration.z == 9.8


@given(ROTATIONS)
def test_both_children_turn_and_go_the_same_way(rotation: Rotation) -> None:
    """Turn rate and velocity of base_link and of base_footprint are one vector of the world."""
    found: list[Vector] = []
    for frames in (FRAMES, PARENT):
        message = odometry(replace(PLACE, rotation=rotation), frames)
        turn, twist = message.pose.pose.orientation, message.twist.twist
        child = (turn.x, turn.y, turn.z, turn.w)
        found.extend(
            rotate(child, (part.x, part.y, part.z)) for part in (twist.linear, twist.angular)
        )
    assert found[:2] == [pytest.approx(vector, abs=1e-9) for vector in found[2:]]
    assert found[1] == pytest.approx(rotate(rotation, (0.1, 0.2, 0.3)), abs=1e-9)


def test_odometry_is_less_sure_the_farther_it_went() -> None:
    """No covariance is all zeros; what nobody measures has a huge one."""
    near, far = (
        odometry(replace(PLACE, position_variance=place, yaw_variance=yaw), FRAMES)
        for place, yaw in ((1e-4, 0.0), (4.0, 0.01))
    )
    assert 0.0 < near.pose.covariance[0] < far.pose.covariance[0] == 4.0
    assert far.pose.covariance[35] == pytest.approx(near.pose.covariance[35] + 0.01)
    assert near.twist.covariance[14] == robot_topics.UNUSED
    assert all(near.pose.covariance[::7] > 0.0)
    level = odometry(PLACE, PARENT)
    assert (level.child_frame_id, level.pose.pose.position.z) == ('base_footprint', 0.0)


def test_an_unknown_charge_is_nan() -> None:
    """As the message wants it; a known one is a share."""
    assert math.isnan(robot_topics.battery(RobotState(), STAMP).percentage)
    known = robot_topics.battery(RobotState(battery=0.8, voltage=7.4), STAMP)
    assert known.percentage == pytest.approx(0.8)
    assert known.voltage == pytest.approx(7.4)


RUNNING = LinkStatus(LinkState.RUNNING, 'reports arrive', 'v2', parser=ParserCounters(frames=1000))
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


@pytest.mark.parametrize(
    ('changes', 'level'),
    [
        ({}, OK),
        ({'state': LinkState.STALE}, DiagnosticStatus.STALE),
        ({'state': LinkState.CONNECTING}, ERROR),
        ({'state': LinkState.REFUSED}, ERROR),
        ({'state': LinkState.FAILED}, ERROR),
        ({'latency': 0.001}, OK),
        ({'latency': 0.016}, WARN),
    ],
)
def test_the_level_of_the_link(changes: dict[str, Any], level: bytes) -> None:
    """A slow adapter is a warning, a silent robot stale, none an error."""
    status = LinkDiagnostic().describe('node', '/dev/x', replace(RUNNING, **changes))
    assert status.level == level


def test_damage_is_reported_as_long_as_it_lasts() -> None:
    """A cable that was put right is no warning, and one that breaks late is one at once."""
    link = LinkDiagnostic()
    levels = []
    for frames, damaged in [(5000, 0), (5050, 20), (5100, 20), (10, 0), (60, 30)]:
        counters = ParserCounters(frames=frames, bad_checksum=damaged)
        status = link.describe('node', '/dev/x', replace(RUNNING, parser=counters))
        levels.append(status.level)
    assert levels == [OK, WARN, OK, OK, WARN]
    assert '30 damaged and 50 good frames lately' in status.message


@pytest.mark.parametrize(
    ('change', 'error', 'level', 'words'),
    [
        ({}, 0.01, OK, 'no faults'),
        ({'battery': 0.15}, 0.01, WARN, 'battery at 15 %'),
        ({'battery': 0.05}, 0.01, ERROR, 'battery at 5 %'),
        ({'temperatures': {11: 80.0, 12: 30.0}}, 0.01, WARN, 'hot servos: 11'),
        ({'battery': None}, 0.5, WARN, 'disagree by 29 degrees'),
        ({'faults': Fault.IMU | Fault.OVERLOAD}, 0.01, ERROR, 'let it lie down; IMU'),
        ({'faults': 0x8000}, 0.01, OK, 'no faults'),
    ],
)
def test_the_level_of_the_robot(
    change: dict[str, Any], error: float, level: bytes, words: str
) -> None:
    """Battery, heat, an IMU that is mounted otherwise, and faults that the robot reports."""
    state = RobotState(**{'imu': IMU, 'battery': 0.8, **change})
    status = robot_diagnostic('node', '/dev/x', state, LinkStatus(), gravity_error=error)
    assert status.level == level
    assert words in status.message


@pytest.mark.parametrize('checked', [True, False])
def test_an_orientation_whose_signs_nobody_checked_is_uncertain(checked: bool) -> None:
    """In /imu and /odom, so that nobody levels by it, and in the diagnostics."""
    sample = replace(IMU, deviation=0.0 if checked else UNCHECKED_DEVIATION)
    expected = DEVIATIONS.orientation_stddev if checked else math.pi / 2
    template, numbers = robot_topics.odometry(sample, PLACE, DEVIATIONS, FRAMES)
    pose_covariance = template.message(STAMP, numbers).pose.covariance
    assert pose_covariance[21] == pytest.approx(expected**2)
    assert imu(sample).orientation_covariance[0] == pytest.approx(expected**2)
    state = RobotState(imu=sample, battery=0.8)
    status = robot_diagnostic('node', '/dev/x', state, LinkStatus(), gravity_error=0.0)
    assert ('calibrate imu' in status.message) is not checked


def test_a_trouble_is_shown_once() -> None:
    """The next look is fine again, the counters stay."""
    counters = CommandCounters(received=3, refused=1, reason='no', troubled=True)
    first = command_diagnostic('hardware_node', '/dev/x', counters)
    second = command_diagnostic('hardware_node', '/dev/x', counters)
    assert (first.level, first.message, second.level) == (WARN, 'no', OK)
    assert {pair.key: pair.value for pair in second.values}['refused'] == '1'
