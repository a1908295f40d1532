# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints and servos: radians and degrees, signs and offsets, and what is missing."""

from __future__ import annotations

from dataclasses import replace
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_description import movable_joints, robot_urdf
from quad_hardware import CommandError
from quad_hardware.joints import JointMap, JointServo, servo_of
from quad_hardware.link.dialects import V1Dialect, V2Dialect
from quad_hardware.protocol import LEG_MOTORS, Model

ARM = movable_joints(robot_urdf('lite', arm=True))
LEGS = movable_joints(robot_urdf('lite'))


@given(
    st.sampled_from([1, -1]),
    st.floats(-3, 3),
    st.floats(-3, 3),
)
def test_position_and_angle_are_inverse(sign: int, offset: float, position: float) -> None:
    """There and back gives the position, whatever sign and offset."""
    servo = JointServo('joint', 11, sign, offset)
    assert servo.position(servo.angle(position)) == pytest.approx(position, abs=1e-12)


def test_sign_and_offset_mean_what_they_say() -> None:
    """The offset is where the servo reads zero; the sign turns it round."""
    servo = JointServo('joint', 11, -1, 0.5)
    assert servo.position(0.0) == 0.5
    assert servo.position(90.0) == pytest.approx(0.5 - math.pi / 2)
    assert servo.velocity(90.0) == pytest.approx(-math.pi / 2)


def test_every_joint_of_the_robot_has_its_motor() -> None:
    """In the order of the URDF, legs first; zero is zero, but for the gripper."""
    joints = JointMap(servo_of(joint) for joint in ARM)
    assert joints.names == tuple(joint.name for joint in ARM)
    motors = [servo.motor for servo in joints.servos]
    assert motors == [13, 12, 11, 23, 22, 21, 43, 42, 41, 33, 32, 31, 54, 53, 52, 51]
    assert joints.angles([0.0] * 12) == dict.fromkeys(motors[:12], 0.0)
    gripper = joints.servos[-1]
    assert [gripper.angle(p) for p in (0.0, 0.02)] == pytest.approx([-65.0, 65.0])


def test_servos_that_are_not_reported_are_left_out() -> None:
    """Protocol v1 does not read motor 54; nothing is made up for its joint."""
    joints = JointMap(servo_of(joint) for joint in ARM)
    angles = dict.fromkeys(LEG_MOTORS, 90.0)
    assert joints.positions(angles) == dict.fromkeys(joints.names[:12], pytest.approx(math.pi / 2))


def test_a_missing_leg_joint_is_named() -> None:
    """A URDF without a knee is refused before a port is opened."""
    servos = [servo_of(joint) for joint in LEGS if joint.name != 'bl_calf_joint']
    with pytest.raises(
        CommandError, match=r'no joint for motors 41; .* bl_calf_joint; correct robot_description'
    ):
        JointMap(servos)


def test_a_joint_without_motor_is_named() -> None:
    """A renamed joint needs its motor; two joints on one motor are one too many."""
    renamed = replace(LEGS[2], name='front_left_knee')
    with pytest.raises(CommandError, match=r'front_left_knee.*joints\.front_left_knee\.motor'):
        servo_of(renamed)
    servos = [servo_of(joint) for joint in LEGS]
    assert servo_of(renamed, 11).lower == LEGS[2].limits.lower
    with pytest.raises(CommandError, match='motor 11 moves two joints'):
        JointMap([*servos, servo_of(renamed, 11)])


def test_the_legs_come_first() -> None:
    """Twelve positions are those of the legs: another order is refused, and so are strange ids."""
    servos = [servo_of(joint) for joint in ARM]
    with pytest.raises(CommandError, match='has arm_yaw_joint before joints of the legs'):
        JointMap([servos[12], *servos[:12], *servos[13:]])
    assert JointMap([*reversed(servos[:12]), *servos[12:]]).leg_count == 12
    tail = replace(LEGS[2], name='tail_joint')
    with pytest.raises(
        CommandError, match=r'tail_joint: unknown motor 61; give joints\.tail_joint\.motor'
    ):
        JointMap([*servos, servo_of(tail, 61)])


@given(
    st.floats(-7, 7), st.sampled_from([1, -1]), st.floats(-math.inf, 7), st.floats(-7, math.inf)
)
def test_every_target_fits_into_a_frame(
    offset: float, sign: int, lower: float, upper: float
) -> None:
    """Whatever a parameter file says: it is refused by name, or both limits can be sent."""
    lower, upper = min(lower, upper), max(lower, upper)
    hip = replace(servo_of(LEGS[0]), offset=offset, sign=sign, lower=lower, upper=upper)
    try:
        joints = JointMap([hip, *(servo_of(joint) for joint in LEGS[1:])])
    except CommandError as error:
        assert 'correct joints.fl_hip_joint.offset' in str(error)  # noqa: PT017  or none
        return
    servo = joints.servos[0]
    assert lower <= servo.lower <= servo.upper <= upper
    for model in Model:
        for position in (servo.lower, servo.upper):
            angles = {**dict.fromkeys(LEG_MOTORS, 0.0), servo.motor: servo.angle(position)}
            for dialect in (V2Dialect(0.0), V1Dialect(0.0, model)):
                dialect.command(angles)


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        ({'sign': 0}, 'sign 0 is neither'),
        ({'offset': math.nan}, 'offset nan'),
        ({'lower': 1.0, 'upper': 0.5}, 'lower 1.0 is above upper 0.5'),
        ({'lower': math.nan}, 'lower nan'),
    ],
)
def test_settings_that_move_a_servo_wrongly_are_refused(
    change: dict[str, float], reason: str
) -> None:
    """The message names the joint and the value."""
    with pytest.raises(CommandError, match=f'knee: {reason}'):
        replace(JointServo('knee', 11), **change)  # type: ignore[arg-type]
