# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The board's own gait as a client of the register protocol sees it, in physics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from sim_serial import VirtualRobot

from quad_description import movable_joints, robot_urdf
from quad_hardware.protocol import Frame, Kind, Register, V1

pytestmark = pytest.mark.slow

NEUTRAL = 128
MAX_TILT = math.radians(8.0)  # [rad]
DONE = Frame(Kind.READ, 0x3F, b'\x01')
JOINTS = movable_joints(robot_urdf('lite'))


def standing(*arguments: str) -> VirtualRobot:
    """A robot of protocol v1 on its feet."""
    still = '--start', 'stand', '--noise', 'none', '--servo', 'firm'
    return VirtualRobot(*still, *arguments, protocol=V1)


def write(robot: VirtualRobot, register: int, byte: int) -> None:
    """Write a byte."""
    robot.send(Frame(Kind.WRITE, register, bytes((byte,))))


def travel(robot: VirtualRobot, duration: float) -> tuple[float, float, float]:
    """Speeds ahead and to the left [m/s] and turn rate [rad/s]; the robot stays upright."""
    pose = robot.simulation.plant.base_pose
    headings, places = [pose.roll_pitch_yaw[2]], [pose.position[:2]]
    for _ in range(round(duration / 0.02)):
        robot.run(0.02)
        pose = robot.simulation.plant.base_pose
        places.append(pose.position[:2])
        headings.append(pose.roll_pitch_yaw[2])
        assert pose.tilt < MAX_TILT
    yaw = np.unwrap(headings)
    steps = np.diff(np.array(places), axis=0)
    cos, sin = np.cos(yaw[:-1]), np.sin(yaw[:-1])
    ahead = float(np.sum(cos * steps[:, 0] + sin * steps[:, 1]))
    aside = float(np.sum(-sin * steps[:, 0] + cos * steps[:, 1]))
    return ahead / duration, aside / duration, float(yaw[-1] - yaw[0]) / duration


@pytest.mark.parametrize('axis', [0, 1, 2], ids=['VX', 'VY', 'VYAW'])
def test_more_is_faster_and_the_other_way_is_back(axis: int) -> None:
    """Half of the byte is half of the speed, below the middle is backwards; others stay still."""
    register = (Register.VX, Register.VY, Register.VYAW)[axis]
    robot, speeds = standing(), []
    for byte in (NEUTRAL + 90, NEUTRAL + 45, NEUTRAL - 90):
        write(robot, register, byte)
        robot.run(1.2)
        went = travel(robot, 2.24)  # eight strides
        still = [abs(speed) for place, speed in enumerate(went) if place != axis]
        assert max(still) < 0.2 * max(abs(went[axis]), 0.1)
        speeds.append(went[axis])
    full, half, back = speeds
    assert full > (0.06, 0.06, 0.5)[axis]
    assert half == pytest.approx(full / 2, rel=0.25)
    assert back == pytest.approx(-full, rel=0.25)


@pytest.mark.parametrize('byte', [127, 128])
def test_both_middles_are_rest(byte: int) -> None:
    """From a walk the robot comes to rest on its feet, and goes nowhere."""
    robot = standing()
    write(robot, Register.VX, 230)
    robot.run(1.0)
    write(robot, Register.VX, byte)
    robot.run(1.0)
    assert max(map(abs, travel(robot, 0.5))) < 0.01
    assert robot.simulation.plant.base_pose.position[2] > 0.09


def test_no_servo_is_asked_for_more_than_it_can() -> None:
    """From standing into full speed and back, the joints that move stay below their speeds."""
    robot = standing()
    fastest = np.zeros(len(JOINTS))
    for vx, vyaw in ((230, 200), (25, 60), (NEUTRAL, NEUTRAL)):
        write(robot, Register.VX, vx)
        robot.run(0.01)
        write(robot, Register.VYAW, vyaw)
        for _ in range(100):
            robot.run(0.01)
            fastest = np.maximum(fastest, np.abs(robot.simulation.plant.measure().velocities))
    assert fastest.max() > 1.0
    assert all(fastest < 1.2 * np.array([joint.limits.velocity for joint in JOINTS]))


@pytest.mark.parametrize('degrees', [-90, 200])
def test_it_turns_by_an_angle_and_says_when_it_is_done(degrees: int) -> None:
    """Register 3F takes whole degrees, most significant byte first; also more than half round."""
    robot = standing()
    robot.send(Frame(Kind.WRITE, 0x3F, degrees.to_bytes(2, 'big', signed=True)))
    turned, heading = 0.0, 0.0
    answers: list[bytes] = []
    while not answers or answers[-1] == b'\x00':
        for _ in range(20):
            robot.run(0.02)
            yaw = robot.simulation.plant.base_pose.roll_pitch_yaw[2]
            turned, heading = turned + math.remainder(yaw - heading, math.tau), yaw
        (answer,) = robot.ask(DONE)
        answers.append(answer.payload)
        assert robot.now < 20.0
    assert answers[0] == b'\x00'
    assert turned == pytest.approx(math.radians(degrees), abs=0.15)
    robot.run(1.0)
    assert max(map(abs, travel(robot, 0.5))) < 0.02


def test_a_robot_that_cannot_turn_gives_up() -> None:
    """One that hangs in the air moves its legs and turns nowhere; it says that it is done."""
    robot = standing('--physics', 'none')
    robot.send(Frame(Kind.WRITE, 0x3F, (60).to_bytes(2, 'big', signed=True)))
    robot.run(1.0)
    assert robot.ask(DONE)[0].payload == b'\x00'
    robot.run(5.0)
    assert robot.ask(DONE)[0].payload == b'\x01'
