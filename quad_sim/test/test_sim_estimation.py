# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the bridge concludes from joints and attitude, beside what physics knows."""

from __future__ import annotations

import math
import operator
import random

import numpy as np
from numpy.typing import NDArray
import pytest

from quad_description import (
    OdometryState,
    Pose,
    pose_positions,
    quadruped,
    raised_feet,
    robot_urdf,
)
from quad_description.rotations import from_rpy, rotate
from quad_hardware.estimation import LegOdometry, OdometrySettings
from quad_sim import ServoModel, Terrain
from quad_sim.physics import Robot
from quad_sim.state import FLAT

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]

URDF = robot_urdf('lite')
ROBOT = quadruped(URDF)
NAMES = ROBOT.names
STAND = pose_positions(Pose.STAND)
PERIOD = 0.02  # [s]
GAIT_PERIOD, DUTY, LIFT, HEIGHT = 0.28, 0.55, 0.02, 0.085  # a trot that is known to walk


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


def walk(
    velocity: tuple[float, float], duration: float, terrain: Terrain = FLAT
) -> tuple[Array, OdometryState, float, float]:
    """Trot in physics.

    Returns:
        The true way in the first heading, the estimate, the height, and the share of contacts of
        feet that were right.
    """
    robot, rng = Robot(URDF, ServoModel.FIRM, terrain), random.Random(1)
    odometry = LegOdometry(OdometrySettings(), ROBOT.foot_radius)
    standing = [STAND[name] for name in NAMES]
    neutral = np.array(ROBOT.feet(standing))
    neutral[:, 0] = [0.025, 0.025, -0.125, -0.125]
    neutral[:, 2] = -0.022 - HEIGHT
    robot.set_targets(ROBOT.place(ROBOT.solve(neutral.tolist()), standing))
    robot.step(1.0)
    start, yaw = np.array(robot.base_pose.position), robot.imu.roll_pitch_yaw[2]
    state, right = None, 0
    for tick in range(round(duration / PERIOD)):
        time = tick * PERIOD
        measured = [q + rng.gauss(0, math.radians(0.1)) for q in robot.joint_positions.tolist()]
        attitude = [angle + rng.gauss(0, math.radians(0.1)) for angle in robot.imu.roll_pitch_yaw]
        state = odometry.update(time, ROBOT.foot_poses(measured), from_rpy(*attitude))
        right += sum(map(operator.eq, state.standing, robot.foot_contacts))
        ramp = min(time / 0.5, 1.0)
        speed = velocity[0] * ramp, velocity[1] * ramp
        feet = trot(time / GAIT_PERIOD, speed, neutral).tolist()
        robot.set_targets(ROBOT.place(ROBOT.solve(feet), standing))
        robot.step(PERIOD)
    assert state is not None
    x, y, _ = np.array(robot.base_pose.position) - start
    true = np.array(
        [math.cos(yaw) * x + math.sin(yaw) * y, -math.sin(yaw) * x + math.cos(yaw) * y]
    )
    return true, state, robot.base_pose.position[2], right / (4 * round(duration / PERIOD))


def test_a_trot_is_followed() -> None:
    """Within 10 % of the way, with noise; height within 5 mm; most contacts of feet."""
    true, state, height, right = walk((0.2, 0.0), 4.0)
    way = float(np.hypot(*true))
    assert way > 0.2
    assert math.hypot(state.x - true[0], state.y - true[1]) < 0.1 * way
    assert state.height == pytest.approx(height, abs=0.005)
    assert right > 0.85
    assert state.position_variance > (0.05 * way) ** 2


@pytest.mark.parametrize('degrees', [8.0, -8.0])
def test_a_trot_is_followed_up_and_down_a_slope(degrees: float) -> None:
    """Feet stand on the ground and not on the horizon; they creep downhill, which no leg feels."""
    true, state, *_ = walk((0.2, 0.0), 4.0, Terrain.slope(math.radians(degrees)))
    assert true[0] > 0.4
    assert state.x == pytest.approx(true[0], rel=0.2)


def test_feet_are_where_physics_has_them() -> None:
    """The chains of the URDF agree with the simulator's, in a pose without symmetry."""
    pose = {name: 0.1 * math.sin(3 * index) for index, name in enumerate(NAMES)}
    robot = Robot(URDF, pose=pose)
    (x, y, z), rotation = robot.base_pose.position, robot.base_pose.orientation
    found = ROBOT.feet([pose[name] for name in NAMES])
    for centre, foot in zip(found, robot.feet, strict=True):
        place = rotate(rotation, centre)
        wanted = np.array(robot.link_position(foot)) - (x, y, z)
        assert place == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize('legs', [(), ('fl',), ('fr', 'bl'), ('fl', 'bl'), ('bl', 'br')])
def test_physics_agrees_about_feet_in_the_air(legs: tuple[str, ...]) -> None:
    """A robot whose legs of one side are lifted, as in a pace, leans and stands on all feet."""
    held = {**STAND, **{f'{leg}_thigh_joint': STAND[f'{leg}_thigh_joint'] + 0.3 for leg in legs}}
    robot = Robot(robot_urdf('lite'), ServoModel.FIRM, seed=1)
    for pose in (STAND, held):
        robot.set_targets(pose)
        robot.step(1.0)
    raised = raised_feet(ROBOT.feet([held[name] for name in NAMES]))
    assert bool(raised) is not all(robot.foot_contacts)
