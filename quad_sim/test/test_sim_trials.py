# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What trials of a controller need of the simulation: bumps, delays, meter, real time."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
import time

import numpy as np
import pytest
from sim_serial import VirtualRobot

from quad_description import robot_urdf
from quad_hardware.protocol import Code, Frame, Kind
from quad_sim import CommandTiming, ServedRobot, ServoModel, SimulationError, Terrain
from quad_sim.env import WalkingEnv
from quad_sim.options import build, parse_arguments
from quad_sim.physics import Meter, Robot, Variation
from quad_sim.robot_line import CommandTimes

URDF = robot_urdf()
DEADLINE = 60.0  # [s]


def heights(robot: Robot, places: list[tuple[float, float]]) -> list[float]:
    """How high the trunk comes to rest where it is put down."""
    found = []
    for x, y in places:
        robot.reset()
        robot._data.qpos[:3] += (x, y, 0.1)
        robot.step(1.0)
        found.append(robot.base_pose.position[2])
    return found


PLACES = [(0.0, 0.0), (1.0, 0.5), (-1.5, 1.0), (2.0, -2.0), (100.0, 0.0)]


def test_rough_ground_has_bumps_but_where_the_robot_begins() -> None:
    """They are as high as asked for at most, the same for a seed, and end somewhere."""
    plain, rough, again = (
        heights(Robot(URDF, ServoModel.FIRM, Terrain(roughness=roughness, seed=seed)), PLACES)
        for roughness, seed in ((0.0, 1), (0.02, 1), (0.02, 1))
    )
    other = heights(Robot(URDF, ServoModel.FIRM, Terrain(roughness=0.02, seed=2)), PLACES)
    assert rough == again
    assert rough[0] == pytest.approx(plain[0], abs=1e-4)
    assert rough[-1] == pytest.approx(plain[-1], abs=1e-4)
    rises = np.array(rough[1:-1]) - plain[1:-1]
    assert (rises > 0.002).all()
    assert (rises < 0.021).all()
    assert not np.allclose(rough[1:-1], other[1:-1], atol=1e-3)


def test_the_environment_and_the_served_robot_have_bumps_too() -> None:
    """Their ground is that of a robot that was made with it."""
    rough = Terrain(roughness=0.02, seed=1)
    wanted = heights(Robot(URDF, terrain=rough), PLACES)
    assert heights(WalkingEnv(terrain=rough).robot, PLACES) == wanted
    robot = build(parse_arguments(['--roughness', '0.02', '--seed', '1', '--noise', 'none'])).plant
    assert isinstance(robot, Robot)
    served = heights(robot, PLACES)
    assert served == pytest.approx(wanted, abs=1e-4)


def test_the_friction_of_bumps_varies_too() -> None:
    """A robot that is kicked on smooth bumps slides on."""
    ways = []
    for friction in (0.8, 0.01):
        robot = Robot(URDF, terrain=Terrain(roughness=0.001, seed=1))
        robot.reset(variation=Variation(friction=friction))
        robot._data.qpos[0] += 1.0
        robot.step(0.3)
        start = robot.base_pose.position[0]
        robot.kick((0.5, 0.0, 0.0))
        robot.step(0.5)
        ways.append(robot.base_pose.position[0] - start)
    assert ways[1] > 2.0 * ways[0]


def test_the_meter_adds_up_way_work_and_limits() -> None:
    """Of a robot that slides to its left on ice, and of one whose servos are pulled apart."""
    robot = Robot(URDF, terrain=Terrain(friction=1e-3))
    meter = Meter(robot, URDF)

    def go(duration: float, act: Callable[[], None] = lambda: None) -> None:
        meter.begin()
        act()
        for _ in range(round(duration / 0.02)):
            robot.step(0.02)
            meter.sample()

    go(0.5)
    at_rest = meter.read()
    assert at_rest.time == pytest.approx(0.5)
    assert at_rest.path < 0.01
    assert at_rest.weight == pytest.approx(9.81 * robot.mass)
    go(0.4, lambda: robot.kick((0.0, 0.5, 0.0)))
    slid = meter.read()
    assert slid.y == pytest.approx(0.2, abs=0.05)
    assert abs(slid.x) < 0.02
    assert slid.path >= abs(slid.y)
    targets = {name: -2.0 for name in robot.joint_names if 'calf' in name}
    go(0.3, lambda: robot.set_targets(targets, 0.0))
    pulled = meter.read()
    assert pulled.energy > 5.0 * at_rest.energy
    assert pulled.torque_saturation > at_rest.torque_saturation
    assert 0.0 < pulled.torque_saturation + pulled.speed_saturation < 1.0
    assert pulled.tilt > 0.0


def test_commands_are_timed_on_the_wire() -> None:
    """From the end of a state to the begin of the next command; a second one is no answer."""
    times = CommandTimes()
    for step in range(100):
        now = 0.02 * step + (0.004 if step == 50 else 0.0)
        times.sent(now)
        times.commanded(now + 0.003)
        times.commanded(now + 0.0101)
    timing = times.timing()
    assert len(timing.latencies) == 100
    assert timing.latency(0.5) == pytest.approx(0.003)
    assert timing.jitter(0.0) == pytest.approx(0.0, abs=2e-3)
    both = timing + CommandTiming((0.5,), (0.5,))
    assert both.latency(1.0) == both.jitter(1.0) == 0.5
    times.clear()
    assert math.isnan(times.timing().latency(0.5))


def test_a_command_on_the_line_is_timed() -> None:
    """One of the joints, and no other frame."""
    robot = VirtualRobot('--start', 'stand', '--protocol', 'v2')
    robot.send(Frame(Kind.WRITE, Code.FEEDBACK, b'\x01'))
    robot.run(0.05)
    robot.send(Frame(Kind.READ, Code.BATTERY, b''))
    robot.run(0.0005)
    assert robot.line.command_times.timing().latencies == ()
    robot.run(0.05)
    angle = np.float32(0.0).tobytes()
    robot.send(Frame(Kind.WRITE, Code.SERVO, bytes((11,)) + angle))
    robot.run(0.01)
    (latency,) = robot.line.command_times.timing().latencies
    assert 0.0 <= latency < 0.03


@pytest.mark.slow
def test_a_robot_in_a_process_of_its_own_is_watched_put_down_and_kicked() -> None:
    """Over a real port, in real time; its process ends with the block."""
    with ServedRobot('--protocol', 'v2') as served:
        assert Path(served.port).exists()
        served.begin()
        served.kick(0.0, 4.0)
        end = time.monotonic() + DEADLINE
        while (fallen := served.read()).metered.tilt < 0.5:
            assert time.monotonic() < end, fallen
        assert fallen.timing == CommandTiming()
        served.stand()
        end = time.monotonic() + DEADLINE
        while (stood := served.read()).metered.time < 0.2:
            assert time.monotonic() < end, stood
        assert stood.metered.tilt < 0.1
        with pytest.raises(SimulationError, match='kick of'):
            served.kick(math.nan, 0.0)
        process = served._process
    assert process.returncode == 0
    assert not Path(served.port).parent.exists()


@pytest.mark.slow
def test_a_robot_that_cannot_be_served_says_why() -> None:
    """In the process that asked for it."""
    with pytest.raises(SimulationError, match='without physics'), ServedRobot('--physics', 'none'):
        pass
