# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The board's own gait: its legs are those of the URDF, and it walks as fast as it is told to."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from sim_virtual import VirtualRobot

from quad_description import robot_urdf
from quad_hardware.protocol import Frame, Kind, OLD, Register
from quad_hardware.sim.turning import Turn
from quad_hardware.sim.walking import measure_legs, Walker
from quad_kinematics import link_pose, parse

URDF = robot_urdf('lite')
ROOT = parse(URDF)
LEGS = measure_legs(URDF)


@pytest.mark.parametrize('leg', LEGS, ids=lambda leg: leg.name)
@given(x=st.floats(-0.05, 0.02), y=st.floats(-0.02, 0.02), z=st.floats(-0.11, -0.06))
def test_a_leg_reaches_where_it_is_sent(leg: object, x: float, y: float, z: float) -> None:
    """Forward kinematics of the URDF brings the solution back to the point."""
    assert isinstance(leg, type(LEGS[0]))
    wanted = (x, leg.side * leg.beside + y, z)
    foot, _ = link_pose(ROOT, f'{leg.name}_foot', leg.solve(wanted))
    hip, _ = link_pose(ROOT, f'{leg.name}_hip', {})
    assert foot - hip == pytest.approx(wanted, abs=1e-9)


def test_a_point_too_far_away_is_pointed_at() -> None:
    """The leg is stretched, and no number is missing."""
    for leg in LEGS:
        assert all(map(math.isfinite, leg.solve((0.3, 0.0, -0.3)).values()))


def test_targets_do_not_jump() -> None:
    """From standing into full speed and back no joint moves faster than its servo can."""
    walker = Walker(URDF)
    before = walker.step(0.02)
    fastest = 0.0
    for tick in range(400):
        walker.command = (0.2, 0.05, 0.5) if 20 < tick < 200 else (0.0, 0.0, 0.0)
        now = walker.step(0.02)
        fastest = max(fastest, *(abs(now[name] - before[name]) / 0.02 for name in now))
        before = now
    assert fastest < 12.0
    assert not walker.walking


@pytest.mark.parametrize(
    ('register', 'byte', 'expected'),
    [
        (Register.VX, 230, (0.130, 0, 0)),
        (Register.VX, 25, (-0.130, 0, 0)),
        (Register.VY, 230, (0, 0.094, 0)),
        (Register.VYAW, 200, (0, 0, 0.993)),
    ],
)
def test_it_walks_as_fast_as_the_register_says(
    register: int, byte: int, expected: tuple[float, float, float]
) -> None:
    """Step length over step time is the speed [m/s], degrees a second the rate; no fall."""
    robot = VirtualRobot('--start', 'stand', '--noise', 'none', protocol=OLD)
    robot.send(Frame(Kind.WRITE, register, bytes((byte,))))
    robot.run(2.5)
    plant = robot.simulation.plant
    headings, places = [], []
    for _ in range(150):
        robot.run(0.02)
        places.append(plant.base_pose.position[:2])
        headings.append(plant.base_pose.roll_pitch_yaw[2])
        assert plant.base_pose.tilt < math.radians(6)
    yaw = np.unwrap(headings)
    steps = np.diff(np.array(places), axis=0) / 0.02
    cos, sin = np.cos(yaw[:-1]), np.sin(yaw[:-1])
    ahead = float(np.mean(cos * steps[:, 0] + sin * steps[:, 1]))
    aside = float(np.mean(-sin * steps[:, 0] + cos * steps[:, 1]))
    turning = float(yaw[-1] - yaw[0]) / (0.02 * (len(yaw) - 1))
    assert (ahead, aside) == pytest.approx(expected[:2], abs=0.03)
    assert turning == pytest.approx(expected[2], abs=0.1)


@given(
    angle=st.floats(-8.0, 8.0),
    yaw=st.floats(-math.pi, math.pi),
    grip=st.floats(0.3, 1.1),
)
def test_a_turn_ends_at_its_angle(angle: float, yaw: float, grip: float) -> None:
    """Whatever part of the rate the robot manages, and wherever the heading wraps around."""
    turn, now, turned = Turn(angle, yaw, 0.0), 0.0, 0.0
    while rate := turn.rate(math.remainder(yaw + turned, 2 * math.pi), now):
        turned += grip * rate * 0.02
        now += 0.02
        assert now < 60.0
    given_up = now > 1.0 + 3.0 * abs(angle) / math.radians(60.0)
    assert given_up or turned == pytest.approx(angle, abs=math.radians(2.5))
    assert not given_up or grip < 0.5


def test_a_robot_that_cannot_turn_gives_up() -> None:
    """A turn without any motion ends."""
    turn, now = Turn(1.0, 0.0, 0.0), 0.0
    while turn.rate(0.0, now):
        now += 0.02
    assert 3.0 < now < 5.0


def test_it_turns_by_an_angle_and_says_when_it_is_done() -> None:
    """Register 3F takes whole degrees, the most significant byte first."""
    robot = VirtualRobot('--start', 'stand', '--noise', 'none', protocol=OLD)
    robot.send(Frame(Kind.WRITE, 0x3F, (-90).to_bytes(2, 'big', signed=True)))
    done = Frame(Kind.READ, 0x3F, b'\x01')
    robot.run(1.5)
    (answer,) = robot.ask(done)
    assert answer.payload == b'\x00'
    robot.run(3.0)
    (answer,) = robot.ask(done)
    assert answer.payload == b'\x01'
    yaw = robot.simulation.plant.base_pose.roll_pitch_yaw[2]
    assert yaw == pytest.approx(-math.pi / 2, abs=0.12)
    assert not robot.simulation.board.walker.walking
