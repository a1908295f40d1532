# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics follows the laws that its users rely on."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path

import numpy as np
import pytest

from quad_description import (
    movable_joints,
    Pose,
    pose_positions,
    quadruped,
    raised_feet,
    robot_urdf,
)
from quad_description.rotations import rotate
from quad_sim import ServoModel, ServoParameters, SetupError, SimulationError, TargetError, Terrain
from quad_sim.physics import PhysicsBackend, Robot, Variation
from quad_sim.state import BOARD, ENCODER_STEP

URDF = robot_urdf('mini')
GRAVITY = 9.81  # [m/s2]
STAND = pose_positions(Pose.STAND)


def settled(robot: Robot) -> Robot:
    """Run until the robot has come to rest."""
    robot.step(1.0)
    return robot


def test_a_standing_robot_stands() -> None:
    """After two seconds it is level, where it was, and the ground carries its weight."""
    robot = Robot(URDF, ServoModel.FIRM)
    robot.step(2.0)
    assert robot.base_pose.tilt < math.radians(0.5)
    assert np.linalg.norm(robot.base_pose.position[:2]) < 2e-3
    assert 0.125 < robot.base_pose.position[2] < 0.130
    assert robot.foot_contacts == (True,) * 4
    assert robot.foot_forces.sum() == pytest.approx(robot.mass * GRAVITY, rel=0.01)
    assert np.abs(robot.joint_positions - list(STAND.values())).max() < 0.02


@pytest.mark.parametrize(
    ('direction', 'roll', 'pitch'), [(0.0, 0, -0.15), (math.pi / 2, 0.15, 0), (math.pi, 0, 0.15)]
)
def test_a_slope_tilts_the_robot_and_its_imu(direction: float, roll: float, pitch: float) -> None:
    """Uphill ahead is nose up; gravity in the body is what the attitude says."""
    robot = settled(Robot(URDF, terrain=Terrain.slope(0.15, direction)))
    attitude = robot.base_pose.roll_pitch_yaw
    assert attitude == pytest.approx((roll, pitch, 0), abs=0.02)
    r, p, _ = robot.imu.roll_pitch_yaw
    gravity = np.array([math.sin(p), -math.sin(r) * math.cos(p), -math.cos(r) * math.cos(p)])
    force = np.array(robot.imu.specific_force)
    assert -force / np.linalg.norm(force) == pytest.approx(gravity, abs=0.01)
    assert robot.foot_contacts == (True,) * 4


def test_feet_are_where_the_kinematics_have_them() -> None:
    """The chains of the URDF agree with the simulator's, in a pose without symmetry."""
    robot_model = quadruped(URDF)
    pose = {name: 0.1 * math.sin(3 * index) for index, name in enumerate(robot_model.names)}
    robot = Robot(URDF, pose=pose)
    (x, y, z), rotation = robot.base_pose.position, robot.base_pose.orientation
    found = robot_model.feet([pose[name] for name in robot_model.names])
    for centre, foot in zip(found, robot.feet, strict=True):
        wanted = np.array(robot.link_position(foot)) - (x, y, z)
        assert rotate(rotation, centre) == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize('legs', [(), ('fl',), ('fr', 'bl'), ('fl', 'bl'), ('bl', 'br')])
def test_physics_agrees_about_feet_in_the_air(legs: tuple[str, ...]) -> None:
    """A robot whose legs of one side are lifted, as in a pace, leans and stands on all feet."""
    held = {**STAND, **{f'{leg}_thigh_joint': STAND[f'{leg}_thigh_joint'] + 0.3 for leg in legs}}
    robot = Robot(robot_urdf('lite'), ServoModel.FIRM, seed=1)
    for pose in (STAND, held):
        robot.set_targets(pose)
        robot.step(1.0)
    raised = raised_feet(quadruped(robot_urdf('lite')).feet(list(held.values())))
    assert bool(raised) is not all(robot.foot_contacts)


def test_a_falling_robot_weighs_nothing() -> None:
    """Kicked upwards it leaves the ground, and the accelerometer goes to zero."""
    robot = settled(Robot(URDF))
    robot.kick((0, 0, 1.5))
    robot.step(0.12)
    assert robot.foot_contacts == (False,) * 4
    # moving legs and the chip's low-pass leave a rest
    assert np.linalg.norm(robot.imu.specific_force) < 2.0


def test_a_robot_may_begin_on_any_side_and_in_the_air() -> None:
    """Its lowest point is as high as it is to be; on its back it stays there."""
    robot = Robot(URDF)
    robot.reset(orientation=(1.0, 0.0, 0.0, 0.0), drop=0.1)
    assert robot.base_pose.tilt == pytest.approx(math.pi)
    in_the_air = robot.base_pose.position[2]
    robot.reset(orientation=(2.0 * 0.9, 0.0, 0.0, 0.0))
    assert robot.base_pose.position[2] == pytest.approx(in_the_air - 0.1)
    settled(robot)
    assert robot.base_pose.tilt > 3.0
    robot.reset()
    assert robot.base_pose.tilt == 0.0
    with pytest.raises(SetupError, match='unit quaternion'):
        robot.reset(orientation=(0.0, 0.0, 0.0, 0.0))
    with pytest.raises(SetupError, match='0 to 10'):
        robot.reset(drop=-0.1)


def test_pose_and_velocity_agree() -> None:
    """The position's difference is the velocity, turned from the body into the world."""
    robot = settled(Robot(URDF))
    robot.kick((0.3, 0.2, 0))
    robot.step(0.05)
    before = np.array(robot.base_pose.position)
    velocity = robot.base_velocity.linear
    roll, pitch, yaw = robot.base_pose.roll_pitch_yaw
    robot.step(0.002)
    moved = (np.array(robot.base_pose.position) - before) / 0.002
    cy, sy = math.cos(yaw), math.sin(yaw)
    assert moved[0] == pytest.approx(cy * velocity[0] - sy * velocity[1], abs=0.04)
    assert moved[1] == pytest.approx(sy * velocity[0] + cy * velocity[1], abs=0.04)
    assert abs(roll) + abs(pitch) < 0.3


def test_a_push_is_an_impulse_in_the_robots_heading() -> None:
    """On ice, force times duration over mass is the change of speed."""
    robot = settled(Robot(URDF, terrain=Terrain(friction=1e-3)))
    robot.push((0, 3.0, 0), 0.1)
    robot.step(0.1)
    before = robot.centre_of_mass[1]
    robot.step(0.1)
    speed = (robot.centre_of_mass[1] - before) / 0.1
    assert speed == pytest.approx(3.0 * 0.1 / robot.mass, rel=0.02)


def test_a_reset_robot_is_a_new_one() -> None:
    """After a reset nothing is left of what happened before, nor of how the robot differed."""
    used, new = Robot(URDF, noise=BOARD), Robot(URDF, noise=BOARD, seed=5)
    used.reset(variation=Variation(0.2, 1.5, 0.6, 1.5))
    used.set_targets(pose_positions(Pose.LIE))
    used.push((5, 0, 0), 10.0)
    used.set_torque(False, ['fl_hip_joint'])
    used.step(0.301)
    used.reset(seed=5)
    for robot in (used, new):
        robot.set_targets({'fl_calf_joint': 0.1})
        robot.step(0.5)
    assert used.base_pose == new.base_pose
    assert used.measure().positions.tobytes() == new.measure().positions.tobytes()


def test_time_adds_up_whatever_its_pieces() -> None:
    """What a step leaves over comes with the next one."""
    one, other = Robot(URDF), Robot(URDF)
    for _ in range(100):
        one.step(0.0035)
    other.step(0.35)
    assert one.time == pytest.approx(0.35)
    assert one.base_pose == other.base_pose


def test_set_points_go_straight_to_the_target() -> None:
    """Firm servos interpolate over 20 ms; a duration makes it longer; then they stay."""
    robot = Robot(URDF, ServoModel.FIRM)
    robot.set_targets({'fl_thigh_joint': 1.2})
    seen = []
    for _ in range(12):
        robot.step(0.002)
        seen.append(robot.joint_targets[1])
    assert seen == pytest.approx([min(1.0 + 0.02 * k, 1.2) for k in range(1, 13)])
    robot.set_targets({'fl_thigh_joint': 1.0}, duration=1.0)
    robot.step(0.5)
    assert robot.joint_targets[1] == pytest.approx(1.1)
    # another joint's command does not disturb it
    robot.set_targets({'fr_thigh_joint': 1.1})
    robot.step(0.5)
    assert robot.joint_targets[[1, 4]] == pytest.approx([1.0, 1.1])


def test_targets_are_kept_within_the_limits() -> None:
    """What lies beyond a limit of the URDF is taken to it."""
    robot = Robot(URDF)
    robot.set_targets([10.0] * 12)
    robot.step(0.5)
    assert robot.joint_targets == pytest.approx([j.limits.upper for j in movable_joints(URDF)])


@pytest.mark.parametrize(
    ('targets', 'message'),
    [
        ({'tail_joint': 0.0}, 'no joint is named tail_joint; there are fl_hip_joint'),
        ({'fl_hip_joint': math.nan, 'fr_hip_joint': 0.1}, 'fl_hip_joint are not finite'),
        ([0.0] * 11, '12 joints'),
        ([0.0] * 11 + [math.inf], 'br_calf_joint are not finite'),
    ],
)
def test_a_target_that_is_none_is_refused(
    targets: dict[str, float] | list[float], message: str
) -> None:
    """The message names the joint, and no set-point has moved."""
    robot = Robot(URDF)
    before = robot.joint_targets
    with pytest.raises(TargetError, match=message):
        robot.set_targets(targets)
    robot.step(0.1)
    assert (robot.joint_targets == before).all()


def test_a_robot_without_torque_sinks_and_is_caught_where_it_is() -> None:
    """Off it goes down; on again it holds the position that it has then."""
    robot = settled(Robot(URDF))
    height = robot.base_pose.position[2]
    robot.set_torque(False)
    robot.step(1.5)
    assert robot.base_pose.position[2] < height - 0.02
    assert (robot.joint_torques == 0).all()
    low = robot.joint_positions
    robot.set_torque(True)
    robot.step(0.5)
    assert np.abs(robot.joint_positions - low).max() < 0.05
    robot.set_targets(STAND, duration=1.0)
    robot.step(1.5)
    assert robot.base_pose.position[2] == pytest.approx(height, abs=5e-3)


def test_servos_are_as_strong_and_fast_as_the_urdf_and_the_motor_line_allow() -> None:
    """No torque above the stall torque, and a free leg stays below the no-load speed."""
    lifted = Robot(URDF, ServoParameters(stiffness=100.0))
    efforts = np.array([joint.limits.effort for joint in movable_joints(URDF)])
    lifted.push((0, 0, 1.02 * lifted.mass * GRAVITY), 2.0)
    lifted.step(0.5)
    fastest = 0.0
    for _ in range(100):
        lifted.set_targets({'fl_calf_joint': 1.0})
        lifted.step(0.002)
        fastest = max(fastest, float(lifted.joint_velocities[2]))
        assert (np.abs(lifted.joint_torques) <= efforts + 1e-9).all()
    assert 4.0 < fastest < 9.2 + 0.5


def test_the_second_jaw_goes_with_the_first() -> None:
    """The gripper's mimic joint follows, and the arm's joints are driven."""
    robot = Robot(robot_urdf('mini', arm=True), pose={'hand_right_joint': 0.01})
    robot.set_targets({'hand_right_joint': 0.02, 'arm_yaw_joint': 0.5})
    robot.step(1.0)
    at = dict(zip(robot.joint_names, robot.joint_positions, strict=True))
    assert at['hand_right_joint'] == pytest.approx(0.02, abs=1e-3)
    assert at['arm_yaw_joint'] == pytest.approx(0.5, abs=0.02)
    right, left = (np.array(robot.link_position(f'hand_{side}')) for side in ('right', 'left'))
    assert np.linalg.norm(right - left) == pytest.approx(0.04, abs=2e-3)


def test_measurements_are_noisy_and_in_steps_of_the_encoder() -> None:
    """Noise has the size that was asked for, and positions are multiples of the encoder's step."""
    robot = settled(Robot(URDF, noise=BOARD))
    rolls = []
    for _ in range(300):
        measured = robot.measure()
        rolls.append(measured.imu.roll_pitch_yaw[0] - robot.imu.roll_pitch_yaw[0])
        steps = measured.positions / ENCODER_STEP
        assert np.abs(steps - np.round(steps)).max() < 1e-6
    assert np.std(rolls) == pytest.approx(BOARD.attitude, rel=0.2)


@pytest.mark.slow
def test_physics_that_blows_up_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A servo that is no servo ends in an error with the remedy, and leaves no file behind."""
    monkeypatch.chdir(tmp_path)
    wild = ServoParameters(stiffness=1e9, damping=0.0, armature=0.0)
    heavy = robot_urdf('mini').replace('effort="0.46"', 'effort="1e12"')
    robot = Robot(heavy, wild)
    robot.set_targets([0.3] * 12)
    with pytest.raises(SimulationError, match='softer servo'):
        robot.step(1.0)
    assert not list(tmp_path.iterdir())


def test_an_imu_has_one_of_two_names() -> None:
    """A robot with links of both is measured where the documented one is."""
    fixed = '<joint name="x" type="fixed"><parent link="base_link"/><child link="imu"/></joint>'
    both = URDF.replace('</robot>', f'<link name="imu"/>{fixed}</robot>')
    assert Robot(both).imu.specific_force == pytest.approx(Robot(URDF).imu.specific_force)


@pytest.mark.parametrize(
    ('urdf', 'message'),
    [
        ('<robot name="a"><link name="x"/></robot>', 'the foot of leg fl is one link'),
        ('<robot', 'cannot be simulated|no XML'),
        (URDF.replace('imu_link', 'gyro_link'), 'no link imu_link'),
    ],
)
def test_a_description_that_is_no_quadruped_is_refused(urdf: str, message: str) -> None:
    """The message says what is missing."""
    with pytest.raises(SetupError, match=message):
        Robot(urdf)


@pytest.mark.parametrize(('step', 'torque'), [(0.028, 0.0), (-0.028, 0.0), (0.1, 0.14)])
def test_a_servo_does_not_pull_within_its_free_width(step: float, torque: float) -> None:
    """Dead band and half the backlash to either side; beyond it, by the rest of the error."""
    robot = Robot(URDF, ServoParameters(stiffness=2.0, deadband=0.01, backlash=0.04))
    robot.reset(drop=5.0)  # in the air nothing loads it
    calf = robot.joint_names.index('fl_calf_joint')
    robot.set_targets({'fl_calf_joint': STAND['fl_calf_joint'] + step})
    robot.step(0.004)
    assert robot.joint_torques[calf] == pytest.approx(torque, abs=0.005)


def test_a_leg_stops_at_another_one() -> None:
    """A hind leg that is sent through the front one stays behind it; alone it gets there."""
    hind = {'bl_thigh_joint': -0.9, 'bl_calf_joint': -0.4}
    front = {'fl_thigh_joint': 1.4, 'fl_calf_joint': -0.8}
    short = []
    for goal in (hind, hind | front):
        robot = Robot(URDF, ServoModel.FIRM, held=True)
        robot.set_targets(goal, 0.5)
        robot.step(2.0)
        thigh = robot.joint_positions[robot.joint_names.index('bl_thigh_joint')]
        short.append(thigh - goal['bl_thigh_joint'])
    alone, behind = short
    assert alone < 0.02
    assert behind > 0.3


@pytest.mark.parametrize(
    ('delay', 'refresh', 'came'),
    [
        (0.0, 0.0, [1, 2, 3, 4, 5, 6, 7, 8]),
        (0.008, 0.0, [1, 2, 3, 4, 5, 6, 7, 8]),
        (0.02, 0.0, [0, 1, 2, 3, 4, 5, 6, 7]),
        (0.05, 0.0, [0, 0, 1, 2, 3, 4, 5, 6]),
        (0.02, 0.08, [0, 0, 0, 0, 4, 4, 4, 4]),
    ],
)
def test_targets_come_in_their_order_with_the_next_refresh_after_their_delay(
    delay: float, refresh: float, came: list[int]
) -> None:
    """Also when several are on the way; one that makes no sense is refused at once."""
    servo = replace(ServoModel.FIRM.parameters, delay=delay, refresh=refresh)
    backend = PhysicsBackend(Robot(URDF, servo))
    backend.reset()
    robot, stand = backend.robot, list(backend.robot.joint_positions)
    seen = []
    for step in range(len(came)):
        backend.step([q + 0.01 * (step + 1) for q in stand])
        seen.append(round(100.0 * float(robot._ramp.goal[0] - stand[0]), 6))
    assert seen == came
    with pytest.raises(TargetError):
        robot.set_targets({'tail_joint': 0.0})
    backend.reset()
    backend.step(None)
    assert robot._ramp.goal == pytest.approx(stand), 'what was on the way before a reset is gone'


def test_targets_of_before_the_torque_count_with_it() -> None:
    """A servo that wakes goes where it was sent before, though that target is on the way."""
    robot = Robot(URDF, ServoParameters(stiffness=5.0, delay=0.02))
    robot.set_torque(False)
    robot.step(0.5)
    held = robot.joint_positions
    robot.set_targets(held)
    robot.set_torque(True, hold=False)
    robot.step(0.5)
    assert robot.joint_positions == pytest.approx(held, abs=0.03)


def test_a_held_trunk_stays_where_it_is() -> None:
    """Its legs do not pull it down, however long a person takes with them."""
    robot = Robot(robot_urdf('lite'), held=True)
    height = robot.base_pose.position[2]
    robot.step(40.0)
    assert robot.base_pose.position[2] == pytest.approx(height, abs=0.01)
