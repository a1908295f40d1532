# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The body over the feet: pose, levelling, soft servos, and what parameters are taken."""

from __future__ import annotations

from collections.abc import Callable
import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from quad_builds import urdf
from quad_controller import (
    BodyPose,
    Gait,
    GaitGenerator,
    GaitParameters,
    ParameterError,
    PolicyOptions,
    ServoModel,
    StateParameters,
    Velocity,
)
from quad_controller.gait.generator import HeadingHold
from quad_controller.gait.parameters import ServoCompensation
from quad_controller.gait.stepping import Stepper
from quad_controller.gait.velocity import BodyLimits, feet_in_body, Leveller, REST, UPRIGHT
from quad_description import quadruped
from quad_description.rotations import Vector

ROBOT = quadruped(urdf())
CENTRE = ROBOT.hip_centre
STILL = (0.0,) * 12
FEET = ROBOT.footprint(0.085, STILL)
poses = st.builds(BodyPose, *[st.floats(-0.03, 0.03)] * 3, *[st.floats(-0.4, 0.4)] * 3)


@given(poses)
def test_moving_the_body_is_rigid(pose: BodyPose) -> None:
    """The feet keep their distances, and the body's motion brings them back where they were."""
    moved = np.array(feet_in_body(FEET, pose, CENTRE))
    feet = np.array(FEET)
    assert np.linalg.norm(moved[0] - moved[3]) == pytest.approx(np.linalg.norm(feet[0] - feet[3]))
    x, y, z = (
        np.array([[1, 0, 0], [0, math.cos(pose.roll), -math.sin(pose.roll)],
                  [0, math.sin(pose.roll), math.cos(pose.roll)]]),
        np.array([[math.cos(pose.pitch), 0, math.sin(pose.pitch)], [0, 1, 0],
                  [-math.sin(pose.pitch), 0, math.cos(pose.pitch)]]),
        np.array([[math.cos(pose.yaw), -math.sin(pose.yaw), 0],
                  [math.sin(pose.yaw), math.cos(pose.yaw), 0], [0, 0, 1]]),
    )  # fmt: skip
    back = (z @ y @ x @ (moved - CENTRE).T).T + CENTRE + [pose.x, pose.y, pose.z]
    assert back == pytest.approx(feet)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_levelling_is_bounded_and_fades(roll: float, pitch: float) -> None:
    """No tilt turns the body further than the bound, and without a tilt it comes back."""
    leveller = Leveller(gain=0.8, most=0.2)
    for _ in range(50):
        pose = leveller.step((roll, pitch, 1.0), UPRIGHT, 0.02)
        assert abs(pose.roll) <= 0.2
        assert abs(pose.pitch) <= 0.2
    for _ in range(200):
        pose = leveller.step(None, UPRIGHT, 0.02)
    assert pose == pytest.approx(UPRIGHT, abs=1e-6)
    asked = BodyPose(roll=roll, pitch=pitch)
    level = Leveller(gain=0.8, most=0.2)
    assert level.step((roll, pitch, 1.0), asked, 0.02) == asked, 'a tilt that was asked for'


@given(poses, poses)
def test_body_moves_slowly_and_within_limits(present: BodyPose, target: BodyPose) -> None:
    """The body approaches a pose within its limits at no more than its speed."""
    limits = BodyLimits()
    goal = limits.clamp(target)
    after = limits.approach(present, goal, 0.02)
    change = np.abs(np.subtract(after, present))
    assert (change[:3] <= limits.speed * 0.02 + 1e-12).all()
    assert (change[3:] <= limits.turn_speed * 0.02 + 1e-12).all()
    assert limits.clamp(goal) == goal


@given(st.floats(-3.1, 3.1), st.floats(-1.0, 1.0))
def test_a_course_is_kept_across_the_seam(heading: float, yaw: float) -> None:
    """A robot that turns a tenth too fast ends where the commands add up to, on any heading."""
    hold, start, dt = HeadingHold(2.0), heading, 0.02
    for _ in range(300):
        velocity = hold.step(Velocity(0.1, 0.0, yaw), math.remainder(heading, math.tau), dt)
        assert velocity.x == 0.1
        assert abs(velocity.yaw - yaw) <= 0.4 + 1e-12
        heading += 1.1 * velocity.yaw * dt
    assert heading - start == pytest.approx(300 * yaw * dt, abs=0.1 * abs(yaw) + 0.02)


def test_a_course_is_none_at_rest_or_blind() -> None:
    """A robot at rest does not turn back, nor does one that does not know its heading."""
    hold = HeadingHold(2.0)
    hold.step(Velocity(0.1), 0.0, 0.02)
    assert hold.step(Velocity(0.1), 0.1, 0.02).yaw == pytest.approx(-0.2)
    assert hold.step(REST, 0.1, 0.02) == REST
    assert hold.step(Velocity(0.1), 0.1, 0.02).yaw == 0.0
    assert hold.step(Velocity(0.1), None, 0.02).yaw == 0.0
    assert hold.step(Velocity(0.1), 1.0, 0.02).yaw == 0.0
    # turned by hand: it does not turn back further than the bound
    assert hold.step(Velocity(0.1), -2.0, 0.02).yaw == pytest.approx(0.4)
    assert hold.step(Velocity(0.1), -1.8, 0.02).yaw == pytest.approx(0.2)


@pytest.mark.parametrize('gait', list(Gait))
@pytest.mark.parametrize('asked', [Velocity(0.3), Velocity(0.05), Velocity(yaw=-1.5)], ids=str)
@pytest.mark.parametrize('most', [0.1, 1.5])
def test_a_course_is_kept_within_what_the_gait_can(
    gait: Gait, asked: Velocity, most: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A robot that is held off its course turns back no faster than limits and gait allow."""
    walked: list[Velocity] = []
    plain = Stepper.step

    def record(stepper: Stepper, velocity: Velocity, dt: float) -> list[Vector]:
        walked.append(velocity)
        return plain(stepper, velocity, dt)

    monkeypatch.setattr(Stepper, 'step', record)
    parameters = GaitParameters(max_angular_velocity_z=most)
    generator = GaitGenerator(ROBOT, parameters)
    generator.choose(gait)
    for count in range(150):
        heading = 0.3 * min(max(count - 50, 0) / 25, 1.0)
        generator.step(asked, UPRIGHT, (0.0, 0.0, heading), 0.02)
    assert walked[-1].yaw < 0.0
    for velocity in walked:
        assert abs(velocity.yaw) <= most
        for x, y, _ in FEET:
            speed = math.hypot(velocity.x - velocity.yaw * y, velocity.y + velocity.yaw * x)
            assert speed <= parameters.schedule(gait).speed + 1e-9


def test_a_body_that_looks_elsewhere_keeps_its_course() -> None:
    """The yaw of the body's pose is no turn of the robot."""
    generator = GaitGenerator(ROBOT, GaitParameters())
    for _ in range(100):
        yaw = generator.pose.yaw
        generator.step(Velocity(0.1), BodyPose(yaw=0.2), (0.0, 0.0, yaw), 0.02)
    turned = generator.step(Velocity(0.1), BodyPose(yaw=0.2), (0.0, 0.0, 0.2), 0.02)
    straight = GaitGenerator(ROBOT, GaitParameters(heading_gain=0.0))
    for _ in range(101):
        expected = straight.step(Velocity(0.1), BodyPose(yaw=0.2), (0.0, 0.0, 0.2), 0.02)
    assert turned.targets == pytest.approx(expected.targets, abs=0.01)


def test_a_soft_servo_is_pushed_against_the_weight() -> None:
    """Standing, the springs of the compensated set-points carry the robot's weight."""
    servo = ServoModel(kp=2.0)
    compensation = ServoCompensation(ROBOT, servo)
    stand = GaitGenerator(ROBOT, GaitParameters()).stand_targets
    sent = compensation.step(stand, (True,) * 4, 0.02)
    step, lifted = 1e-6, 0.0
    for leg in range(4):
        for joint in ROBOT.leg_indices[leg]:
            moved = list(stand)
            moved[joint] += step
            rise = (ROBOT.feet(moved)[leg][2] - ROBOT.feet(stand)[leg][2]) / step
            # virtual work: what the spring's torque would lift, were the foot free
            torque = servo.kp * (sent[joint] - stand[joint])
            share = ROBOT.mass * 9.81 / 4
            assert torque == pytest.approx(-rise * share, abs=1e-4)
            lifted += abs(torque)
    assert lifted > 0.1


def test_a_wide_stance_has_its_feet_outwards() -> None:
    """By as much as it says, on both sides; what no leg reaches is refused."""
    usual = GaitParameters().stance(ROBOT, STILL)
    wide = GaitParameters(stance_widening=0.02).stance(ROBOT, STILL)
    for one, other in zip(usual, wide, strict=True):
        assert abs(other[1]) == pytest.approx(abs(one[1]) + 0.02)
        assert other[::2] == pytest.approx(one[::2])
    with pytest.raises(ParameterError, match=r'stance_widening 0\.2, .*: the legs do not reach'):
        GaitGenerator(ROBOT, GaitParameters(stance_widening=0.2))


@pytest.mark.parametrize(
    ('kind', 'values', 'reason'),
    [
        (GaitParameters, {'max_linear_velocity_x': math.nan}, 'max_linear_velocity_x nan'),
        (GaitParameters, {'duty': 0.4}, 'duty 0.4 is below 0.5'),
        (GaitParameters, {'swing_height': -0.01}, 'swing_height -0.01 is not within'),
        (GaitParameters, {'servo': ServoModel(kp=0.0)}, 'kp 0.0 is not a stiffness'),
        (StateParameters, {'period': 0.0}, 'period'),
        (StateParameters, {'max_tilt': math.nan}, 'max_tilt'),
        (StateParameters, {'warn_age': 0.4}, 'warn_age'),
        (StateParameters, {'hold_age': 0.6}, 'hold_age'),
        (PolicyOptions, {'phase_period': math.nan}, 'phase_period'),
        (PolicyOptions, {'soft_limits': 0.0}, 'soft_limits'),
    ],
)
def test_odd_parameters_are_refused(
    kind: Callable[..., object], values: dict[str, object], reason: str
) -> None:
    """A parameter that makes no sense is named, one of a gait with its range."""
    with pytest.raises(ParameterError, match=reason):
        kind(**values)
