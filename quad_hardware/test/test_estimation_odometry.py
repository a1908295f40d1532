# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Leg odometry: exact for legs that roll, within limits for a robot that trots in physics."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
import math
import random
import threading

import numpy as np
from numpy.typing import NDArray
import pytest

from quad_description import movable_joints, Pose, pose_positions, robot_urdf
from quad_hardware.estimation import Estimator, EstimatorSettings
from quad_hardware.estimation.feet import Feet, FootPose, FootPoses
from quad_hardware.estimation.odometry import LegOdometry, OdometrySettings, OdometryState
from quad_hardware.estimation.rotation import from_roll_pitch_yaw, IDENTITY, rotate, yaw_of
from quad_hardware.exceptions import CommandError
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.link import RobotState
from quad_hardware.protocol import LEG_MOTORS
from quad_hardware.sim.physics import Robot

Array = NDArray[np.float64]

URDF = robot_urdf('lite')
NAMES = [joint.name for joint in movable_joints(URDF)]
PERIOD = 0.02  # [s]
GAIT_PERIOD, DUTY, LIFT, HEIGHT = 0.28, 0.55, 0.02, 0.085  # a trot that is known to walk


@cache
def feet_of(urdf: str) -> Feet:
    """The legs of a robot, read once."""
    return Feet(urdf, NAMES)


def places(feet: FootPoses) -> Array:
    """Centres of the feet [m], (4, 3)."""
    return np.array([foot.position for foot in feet], dtype=np.float64)


def feet_at(angles: Array) -> FootPoses:
    """Where the feet are for joint angles [rad]."""
    return feet_of(URDF).poses(angles.tolist())


def solve(wanted: Array, angles: Array) -> Array:
    """Joint angles that put the feet somewhere, by Newton's method."""
    for _ in range(12):
        error = wanted - places(feet_at(angles))
        if np.abs(error).max() < 1e-7:
            break
        columns = []
        for joint in range(3):
            moved = angles.copy()
            moved[joint::3] += 1e-6
            columns.append((places(feet_at(moved)) - places(feet_at(angles))) / 1e-6)
        jacobian = np.stack(columns, axis=2)
        angles = angles + np.linalg.solve(jacobian, error[..., None])[..., 0].ravel()
    return angles


def trot(phase: float, velocity: tuple[float, float], neutral: Array) -> Array:
    """Feet of a trot at a phase, in base_link [m]."""
    feet: Array = neutral.copy()
    for leg, offset in enumerate((0.0, 0.5, 0.5, 0.0)):
        at = (phase + offset) % 1.0
        if at < DUTY:
            share = 0.5 - at / DUTY
        else:
            swing = (at - DUTY) / (1 - DUTY)
            share = -0.5 + swing * swing * (3 - 2 * swing)
            feet[leg, 2] += LIFT * 0.5 * (1 - math.cos(2 * math.pi * swing))
        feet[leg, :2] += np.array(velocity) * share * DUTY * GAIT_PERIOD
    return feet


def walk(velocity: tuple[float, float], duration: float) -> tuple[Array, OdometryState, float]:
    """Trot in physics; return the true way in the first heading, the estimate, the height."""
    robot, legs, rng = Robot(URDF), feet_of(URDF), random.Random(1)
    odometry = LegOdometry(OdometrySettings(), legs.radius)
    stand = pose_positions(Pose.STAND)
    angles = np.array([stand[name] for name in NAMES])
    neutral = places(feet_at(angles))
    neutral[:, 0] = [0.025, 0.025, -0.125, -0.125]
    neutral[:, 2] = -0.022 - HEIGHT
    angles = solve(neutral, angles)
    robot.set_targets(list(angles))
    robot.step(1.0)
    start, yaw = np.array(robot.base_pose.position), robot.imu.roll_pitch_yaw[2]
    state = None
    for tick in range(round(duration / PERIOD)):
        time = tick * PERIOD
        measured = robot.joint_positions + [rng.gauss(0, math.radians(0.1)) for _ in NAMES]
        attitude = [angle + rng.gauss(0, math.radians(0.1)) for angle in robot.imu.roll_pitch_yaw]
        state = odometry.update(time, feet_at(measured), from_roll_pitch_yaw(*attitude))
        ramp = min(time / 0.5, 1.0)
        speed = velocity[0] * ramp, velocity[1] * ramp
        angles = solve(trot(time / GAIT_PERIOD, speed, neutral), angles)
        robot.set_targets(list(angles))
        odometry.command(time, feet_at(angles))
        robot.step(PERIOD)
    assert state is not None
    x, y, _ = np.array(robot.base_pose.position) - start
    true = np.array(
        [math.cos(yaw) * x + math.sin(yaw) * y, -math.sin(yaw) * x + math.cos(yaw) * y]
    )
    return true, state, robot.base_pose.position[2]


@pytest.mark.parametrize('velocity', [(0.2, 0.0), (-0.15, 0.0), (0.0, 0.1)])
def test_a_trot_is_followed(velocity: tuple[float, float]) -> None:
    """Within 10 % of the way, with noise on joints and attitude; height within 5 mm."""
    true, state, height = walk(velocity, 4.0)
    way = float(np.hypot(*true))
    assert way > 0.2
    assert math.hypot(state.x - true[0], state.y - true[1]) < 0.1 * way
    assert state.height == pytest.approx(height, abs=0.005)
    assert state.position_variance > (0.05 * way) ** 2


def test_standing_goes_nowhere() -> None:
    """Noise on the joints does not add up to a way worth the name."""
    odometry, rng = LegOdometry(OdometrySettings(), 0.01), random.Random(1)
    feet = feet_of(URDF)
    for tick in range(500):
        angles = [rng.gauss(0.0, math.radians(0.1)) for _ in NAMES]
        state = odometry.update(tick * PERIOD, feet.poses(angles), IDENTITY)
    assert math.hypot(state.x, state.y) < 0.01


@pytest.mark.parametrize('yaw', [0.0, 1.0, 3.1])
def test_a_rolling_foot_counts(yaw: float) -> None:
    """A wheel that turns by an angle goes by angle times radius, in the heading of the start."""
    odometry = LegOdometry(OdometrySettings(), 0.01)
    places = [(0.1, 0.1, -0.1), (0.1, -0.1, -0.1), (-0.1, 0.1, -0.1), (-0.1, -0.1, -0.1)]
    for tick in range(51):
        turned = from_roll_pitch_yaw(0.0, tick * 0.01, 0.0)
        poses = [FootPose(place, turned) for place in places]
        state = odometry.update(tick * PERIOD, poses, from_roll_pitch_yaw(0.0, 0.0, yaw))
    assert state.x == pytest.approx(0.5 * 0.01, rel=1e-3)
    assert state.y == pytest.approx(0.0, abs=1e-9)
    assert state.height == pytest.approx(0.11)


def test_commands_may_come_from_another_thread() -> None:
    """Any number of them while a measurement is taken."""
    odometry, feet = LegOdometry(OdometrySettings(), 0.01), feet_of(URDF).poses([0.0] * 12)
    stop = threading.Event()

    def send() -> None:
        time = 0.0
        while not stop.is_set():
            time += 1e-4
            odometry.command(time, feet)

    sender = threading.Thread(target=send)
    sender.start()
    try:
        for tick in range(2000):
            odometry.update(tick * PERIOD, feet, IDENTITY)
    finally:
        stop.set()
        sender.join()


def test_a_gap_is_no_way() -> None:
    """A robot that was carried to another stance while it was silent has not walked."""
    odometry = LegOdometry(OdometrySettings(), 0.01)
    feet = feet_of(URDF)
    odometry.update(0.0, feet.poses([0.0] * 12), IDENTITY)
    state = odometry.update(2.0, feet.poses([0.2] * 12), IDENTITY)
    assert (state.x, state.y, state.velocity_x) == (0.0, 0.0, 0.0)


def yaws(reports: Iterable[tuple[float, float | None, float]]) -> list[float]:
    """Headings of /odom for reports of arrival [s], clock of the board [s] and yaw [deg]."""
    joints = JointMap(servo_of(joint) for joint in movable_joints(URDF))
    estimator = Estimator(URDF, joints, EstimatorSettings())
    headings = []
    for arrival, device_time, yaw in reports:
        state = RobotState(
            arrival=arrival, wire_time=0.001, attitude=(0.0, 0.0, yaw), acceleration=None,
            positions=dict.fromkeys(LEG_MOTORS, 0.0), velocities={}, device_time=device_time,
        )  # fmt: skip
        estimate = estimator.update(state)
        assert estimate is not None, estimator.refusal
        place = estimator.walk(estimate)
        assert place is not None
        headings.append(yaw_of(place.rotation))
    return headings


@pytest.mark.parametrize('clock', [True, False], ids=['board with a clock', 'board without'])
def test_a_board_that_begins_anew_turns_nobody(clock: bool) -> None:
    """Its yaw begins at zero again; that of /odom goes on from where it was (REP 105)."""
    before = [(tick * PERIOD, 30.0 + tick * PERIOD, 50.0 + tick) for tick in range(20)]
    after = [(2.0 + tick * PERIOD, 0.1 + tick * PERIOD, float(tick)) for tick in range(20)]
    found = yaws((at, device if clock else None, yaw) for at, device, yaw in (*before, *after))
    assert np.degrees(found) == pytest.approx([*range(20), *range(19, 39)], abs=1e-6)


def test_a_robot_that_was_turned_while_its_cable_was_out_is_turned() -> None:
    """The clock of the board tells that its yaw still counts from the same heading."""
    found = yaws([(0.0, 10.0, 0.0), (0.02, 10.02, 0.0), (3.0, 13.0, 90.0), (3.02, 13.02, 90.0)])
    assert np.degrees(found) == pytest.approx([0.0, 0.0, 90.0, 90.0])


def test_feet_are_where_physics_has_them() -> None:
    """The chains of the URDF agree with the simulator's, in a pose without symmetry."""
    pose = {name: 0.1 * math.sin(3 * index) for index, name in enumerate(NAMES)}
    robot = Robot(URDF, pose=pose)
    (x, y, z), rotation = robot.base_pose.position, robot.base_pose.orientation
    found = places(feet_of(URDF).poses([pose[name] for name in NAMES]))
    for leg, foot in enumerate(robot.feet):
        place = rotate(rotation, (found[leg, 0], found[leg, 1], found[leg, 2]))
        wanted = np.array(robot.link_position(foot)) - (x, y, z)
        assert place == pytest.approx(wanted, abs=1e-6)


def test_a_leg_that_is_missing_is_named() -> None:
    """A URDF whose foot hangs on nothing."""
    with pytest.raises(CommandError, match='no chain from base_link to fl_foot'):
        Feet(URDF.replace('<child link="fl_foot"', '<child link="other"'), NAMES)
