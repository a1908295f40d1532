# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Leg odometry: exact for legs that roll; the tests of quad_sim compare it with physics."""

from __future__ import annotations

from collections.abc import Iterable
import math
import random

import numpy as np
from numpy.typing import NDArray
import pytest

from quad_description import FootPose, movable_joints, OdometryState, quadruped, robot_urdf
from quad_description.rotations import from_rpy, IDENTITY, Quaternion, yaw_of
from quad_hardware import CommandError
from quad_hardware.estimation import (
    Estimator,
    EstimatorSettings,
    ground_normal,
    LegOdometry,
    OdometrySettings,
)
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.protocol import LEG_MOTORS
from quad_hardware.report import Report

Array = NDArray[np.float64]

URDF = robot_urdf('lite')
ROBOT = quadruped(URDF)
PERIOD = 0.02  # [s]


def stand(
    odometry: LegOdometry, begin: float, end: float, attitude: Quaternion = IDENTITY
) -> OdometryState:
    """Stand with noisy joints from one time to another [s]."""
    rng = random.Random(1)
    for tick in range(round(begin / PERIOD), round(end / PERIOD)):
        angles = [rng.gauss(0.0, math.radians(0.1)) for _ in ROBOT.names]
        state = odometry.update(tick * PERIOD, ROBOT.foot_poses(angles), attitude)
    return state


@pytest.mark.parametrize('step', [0.0, math.radians(0.6)], ids=['noise', 'bytes of v1'])
def test_ten_minutes_of_standing_make_the_place_no_less_sure(step: float) -> None:
    """Noise is no way, nor are bytes that change; the heading drifts meanwhile."""
    odometry, rng = LegOdometry(OdometrySettings(), 0.01), random.Random(1)
    for tick in range(15_000):  # 25 a second
        angles = [rng.gauss(0.002, math.radians(0.1)) for _ in ROBOT.names]
        angles = [step * round(angle / step) if step else angle for angle in angles]
        state = odometry.update(0.04 * tick, ROBOT.foot_poses(angles), IDENTITY)
    assert math.hypot(state.x, state.y) < 0.002
    assert math.sqrt(state.position_variance) < 0.02
    assert math.radians(1.0) < math.sqrt(state.yaw_variance) < math.radians(20.0)


def test_a_gap_is_no_way_and_makes_the_place_less_sure() -> None:
    """The robot may have been carried, or have gone on, while nothing was reported."""
    odometry = LegOdometry(OdometrySettings(), 0.01)
    before = stand(odometry, 0.0, 1.0)
    assert before.standing == (True,) * 4
    after = odometry.update(3.0, ROBOT.foot_poses([0.2] * 12), IDENTITY)
    assert (after.x, after.y, after.velocity_x) == (before.x, before.y, 0.0)
    assert math.sqrt(after.position_variance) > 0.3


@pytest.mark.parametrize(
    ('attitude', 'lying_height'), [(from_rpy(2.5, 0.0, 0.0), 0.0), (IDENTITY, 0.2)]
)
def test_legs_that_carry_nothing_move_no_body(attitude: Quaternion, lying_height: float) -> None:
    """Of a robot that rolls, or lies on its belly.

    In a gap it may have been carried elsewhere, though; without another gap nothing is added.
    """
    odometry = LegOdometry(OdometrySettings(), 0.01, lying_height)
    for tick in range(100):
        poses = ROBOT.foot_poses([0.005 * tick] * 12)
        before = odometry.update(tick * PERIOD, poses, attitude)
    assert (before.x, before.y, before.velocity_x, before.velocity_y) == (0.0, 0.0, 0.0, 0.0)
    assert (math.sqrt(before.position_variance) > 0.09) is (lying_height == 0.0)
    gap = 2.0
    begin = 99 * PERIOD + gap
    after = stand(odometry, begin, begin + 0.1, attitude)
    assert (after.x, after.y) == (before.x, before.y)
    added = after.position_variance - before.position_variance
    assert added == pytest.approx((0.3 * gap) ** 2, rel=0.03)
    again = stand(odometry, begin + 0.1, begin + 1.0, attitude)
    assert again.position_variance == after.position_variance


@pytest.mark.parametrize('yaw', [0.0, 1.0, 3.1])
def test_a_rolling_foot_counts(yaw: float) -> None:
    """A wheel that turns by an angle goes by angle times radius, in the heading of the start."""
    odometry = LegOdometry(OdometrySettings(), 0.01)
    places = [(0.1, 0.1, -0.1), (0.1, -0.1, -0.1), (-0.1, 0.1, -0.1), (-0.1, -0.1, -0.1)]
    for tick in range(51):
        turned = from_rpy(0.0, tick * 0.01, 0.0)
        poses = [FootPose(place, turned) for place in places]
        state = odometry.update(tick * PERIOD, poses, from_rpy(0.0, 0.0, yaw))
    assert state.x == pytest.approx(0.5 * 0.01, rel=1e-3)
    assert state.y == pytest.approx(0.0, abs=1e-9)
    assert state.height == pytest.approx(0.11)


@pytest.mark.parametrize('degrees', [0.0, 8.0, -15.0])
def test_both_feet_of_a_diagonal_stand_on_a_slope(degrees: float) -> None:
    """Though one of them is the lower one, seen from the horizon."""
    odometry, pitched = LegOdometry(OdometrySettings(), 0.0), math.radians(-degrees)
    for tick in range(60):
        lifted = {0, 3} if tick // 10 % 2 else {1, 2}
        feet = [
            (x, y, -0.1 + 0.02 * (leg in lifted))
            for leg, (x, y) in enumerate(((0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)))
        ]
        attitude = from_rpy(0.0, pitched, 0.0)
        poses = [FootPose(foot, IDENTITY) for foot in feet]
        state = odometry.update(tick * PERIOD, poses, attitude)
        if tick > 20 and tick % 10 == 5:
            assert state.standing == tuple(leg not in lifted for leg in range(4))


def test_a_foot_that_is_held_up_does_not_tilt_the_ground() -> None:
    """Where the feet are in no plane, up is where the attitude has it."""
    flat = ((0.1, 0.1, -0.1), (0.1, -0.1, -0.1), (-0.1, 0.1, -0.1), (-0.1, -0.1, -0.1))
    assert ground_normal([flat], 0.002) == pytest.approx((0.0, 0.0, 1.0))
    assert ground_normal([((0.1, 0.1, -0.05), *flat[1:])], 0.002) is None
    odometry = LegOdometry(OdometrySettings(), 0.0)
    feet = ((0.1, 0.1, -0.05), *flat[1:])
    for tick in range(60):
        poses = [FootPose(foot, IDENTITY) for foot in feet]
        state = odometry.update(tick * PERIOD, poses, IDENTITY)
    assert state.standing == (False, True, True, True)


def yaws(reports: Iterable[tuple[float, float | None, float]]) -> list[float]:
    """Headings of /odom for reports of arrival [s], clock of the board [s] and yaw [deg]."""
    joints = JointMap(servo_of(joint) for joint in movable_joints(URDF))
    estimator = Estimator(URDF, joints, EstimatorSettings())
    headings = []
    for arrival, device_time, yaw in reports:
        report = Report(
            arrival=arrival, wire_time=0.001, attitude=(0.0, 0.0, yaw), acceleration=None,
            positions=dict.fromkeys(LEG_MOTORS, 0.0), velocities={}, device_time=device_time,
        )  # fmt: skip
        state = estimator.step(report)
        assert state is not None, estimator.refusal
        assert state.odometry is not None
        headings.append(yaw_of(state.odometry.rotation))
    return headings


@pytest.mark.parametrize('clock', [True, False], ids=['board with a clock', 'board without'])
def test_a_board_that_begins_anew_turns_nobody(clock: bool) -> None:
    """Its yaw begins at zero again; that of /odom goes on from where it was (REP 105).

    A clock that went on shows that a robot was turned while its cable was out.
    """
    before = [(tick * PERIOD, 30.0 + tick * PERIOD, 50.0 + tick) for tick in range(20)]
    after = [(2.0 + tick * PERIOD, 0.1 + tick * PERIOD, float(tick)) for tick in range(20)]
    found = yaws((at, device if clock else None, yaw) for at, device, yaw in (*before, *after))
    assert np.degrees(found) == pytest.approx([*range(20), *range(19, 39)], abs=1e-6)
    found = yaws([(0.0, 10.0, 0.0), (0.02, 10.02, 0.0), (3.0, 13.0, 90.0), (3.02, 13.02, 90.0)])
    assert np.degrees(found) == pytest.approx([0.0, 0.0, 90.0, 90.0])


def test_a_leg_that_is_missing_is_named() -> None:
    """A URDF whose foot hangs on nothing."""
    joints = JointMap(servo_of(joint) for joint in movable_joints(URDF))
    urdf = URDF.replace('<child link="fl_foot"', '<child link="other"')
    with pytest.raises(CommandError, match="no link 'other'"):
        Estimator(urdf, joints, EstimatorSettings())
