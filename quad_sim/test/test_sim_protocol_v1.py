# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated robot, and its own gait, as a client of v1 that shares no code with it sees it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from sim_serial import Line, V1Client, VirtualRobot

from quad_description import movable_joints, robot_urdf
from quad_hardware.protocol import Frame, Kind, LEG_MOTORS, Register, V1

pytestmark = pytest.mark.slow

# byte = 255 * (angle - low) / (high - low) of the lite's servos: calf, thigh, hip [deg]
RANGES = ((-70.0, 50.0), (-70.0, 90.0), (-30.0, 30.0))


def degrees(data: bytes) -> list[float]:
    """Decode the angles of the leg servos: calf, thigh, hip of each leg."""
    return [
        byte / 255 * (RANGES[k % 3][1] - RANGES[k % 3][0]) + RANGES[k % 3][0]
        for k, byte in enumerate(data[:12])
    ]


def encoded(angles: list[float]) -> bytes:
    """Encode angles of the leg servos."""
    return bytes(
        int(255 * (angle - RANGES[k % 3][0]) / (RANGES[k % 3][1] - RANGES[k % 3][0]))
        for k, angle in enumerate(angles)
    )


def test_golden_bytes() -> None:
    """Frames that are printed in public documents are answered with the printed bytes."""
    arguments = '--physics', 'none', '--preset', 'mini', '--firmware', 'M-4.3.3', '--battery', '85'
    client = V1Client(*arguments)
    for request, answer in {
        '55 00 09 02 01 01 F2 00 AA': '55 00 09 12 01 55 8E 00 AA',
        '55 00 09 02 07 0A E3 00 AA': '55 00 12 12 07 4D 2D 34 2E 33 2E 33 00 00 00 64 00 AA',
    }.items():
        assert client.exchange(bytes.fromhex(request)) == bytes.fromhex(answer)
    # 15 servos and the IMU block answer with the lengths of the description
    for request, length in (('09 02 50 0F 95', 23), ('09 02 65 18 77', 32)):
        found = client.exchange(bytes.fromhex(f'55 00 {request} 00 AA'))
        assert (len(found), found[2], found[3]) == (length, length, 0x12)


def test_what_a_resting_robot_reports() -> None:
    """Firmware, battery, level attitude, one g upwards, and the servos of the standing pose."""
    client = V1Client('--start', 'stand', '--servo', 'firm')
    client.robot.run(0.5)
    assert client.read(0x07, 10).startswith(b'L-')
    assert client.read(0x01, 1) == b'\x64'
    acceleration, rate, attitude = client.imu()
    assert acceleration == pytest.approx((0, 0, 9.81), abs=0.1)
    assert rate == pytest.approx((0, 0, 0), abs=0.5)
    assert attitude == pytest.approx((0, 0, 0), abs=0.5)
    assert client.attitude() == pytest.approx((0, 0, 0), abs=0.5)
    stand = [math.degrees(q) for q in (-0.2792, 1.0, 0.0)] * 4
    assert degrees(client.read(0x50, 15)) == pytest.approx(stand, abs=1.0)
    assert len(client.read(0x50, 12)) == 12
    assert client.read(0x66, 2) in {b'\x00\x00', b'\xff\xff', b'\x00\x01'}


def test_servos_go_where_one_frame_for_all_or_for_each_sends_them() -> None:
    """Twelve bytes at 0x50 are read back as they were written; one frame moves one servo.

    So the vendor's library sends them; at a lower speed it is slower.
    """
    client = V1Client('--physics', 'none')
    wanted = encoded([-20.0, 40.0, 5.0, -10.0, 30.0, -5.0, 0.0, 60.0, 10.0, 10.0, 20.0, -10.0])
    client.write(0x50, wanted)
    client.robot.run(1.0)
    assert client.read(0x50, 12) == wanted
    client.write(0x52, encoded([0, 0, 20.0])[2:])
    client.robot.run(1.0)
    assert degrees(client.read(0x50, 15))[2] == pytest.approx(20.0, abs=0.5)
    client.write(0x5C, bytes([10]))
    client.write(0x52, encoded([0, 0, -20.0])[2:])
    assert degrees(client.read(0x50, 15))[2] > 0.0
    client.robot.run(4.0)
    assert degrees(client.read(0x50, 15))[2] == pytest.approx(-20.0, abs=0.5)


def test_servos_that_another_program_left_slow_are_as_fast_as_ever() -> None:
    """Legs and arm are commanded at full speed from the first command, whatever was set before."""
    line = Line('--protocol', 'v1', '--physics', 'none', '--arm', protocol=V1)
    line.robot.send(Frame(Kind.WRITE, Register.MOTOR_SPEED, b'\x01'))
    line.robot.run(0.01)
    targets = {**dict.fromkeys(LEG_MOTORS, 10.0), 52: 30.0}
    line.command(targets)
    line.wait_until(line.now() + 0.3)
    found = line.reports()[-1].positions
    assert [found[motor] for motor in targets] == pytest.approx([*targets.values()], abs=1.0)


def test_motors_without_torque_let_go() -> None:
    """Unload all, load all, and one leg by its number."""
    client = V1Client('--start', 'stand')
    servos, plant = client.robot.simulation.board.servos, client.robot.simulation.plant
    for byte, loose in (
        (0x01, [*servos.fitted]), (0x00, []), (0x13, [31, 32, 33]), (0x23, []),
    ):  # fmt: skip
        client.write(0x20, bytes((byte,)))
        assert [m for m in servos.fitted if not servos.torque_on(m)] == loose
        if byte == 0x01:
            client.robot.run(1.5)
            assert plant.base_pose.position[2] < 0.11, 'the robot sinks'


def test_a_write_of_the_vendors_older_library_counts() -> None:
    """XGO-PythonLib 1.1.8 writes with TYPE 0x01."""
    client = V1Client('--physics', 'none')
    client.exchange(bytes.fromhex('55 00 09 01 30 FF C6 00 AA'))
    assert client.robot.simulation.board.walker.command[0] > 0.0


def test_a_pose_of_the_body_and_a_reset() -> None:
    """Pitch and height move the body; action 255 brings the default stance back."""
    client = V1Client('--start', 'stand')
    robot = client.robot
    client.write(0x37, b'\xff')
    client.write(0x35, b'\xff')
    robot.run(2.0)
    assert client.attitude()[1] > 6.0, 'the nose goes down'
    assert robot.simulation.plant.base_pose.position[2] > 0.13, 'the body rises'
    client.write(0x3E, b'\xff')
    robot.run(2.0)
    assert abs(client.attitude()[1]) < 1.0, 'it is level again'
    assert robot.simulation.board.walker.stance.attitude == (0.0, 0.0, 0.0)
    client.write(0x3E, b'\x01')
    robot.run(2.0)
    assert degrees(client.read(0x50, 15))[1] > 75.0, 'it folds its legs'


def test_registers_that_cannot_be_read_are_not_answered() -> None:
    """No frame comes back, and the next question is answered."""
    client = V1Client('--physics', 'none')
    answers = [client.read(register, 1) for register in (0x30, 0xEE, 0x01)]
    assert answers == [b'', b'', b'\x64']


def test_the_board_loses_frames_that_come_too_fast() -> None:
    """With the option, two frames without a pause are one; with a pause, both are carried out."""
    client = V1Client('--physics', 'none', '--command-gap', '0.001')
    client.exchange(bytes.fromhex('55 00 09 00 30 FF C7 00 AA 55 00 09 00 31 FF C6 00 AA'))
    ahead, aside, _ = client.robot.simulation.board.walker.command
    assert ahead > 0
    assert aside == 0
    assert client.robot.line.statistics.hurried == 1
    client.write(0x31, b'\xff')
    assert client.robot.simulation.board.walker.command[1] > 0


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
@pytest.mark.parametrize('register', [Register.VX, Register.VY, Register.VYAW])
def test_both_middles_are_rest(register: Register, byte: int) -> None:
    """From a walk the robot comes to rest on its feet, and goes nowhere."""
    robot = standing()
    write(robot, register, 230)
    robot.run(1.0)
    write(robot, register, byte)
    robot.run(1.0)
    assert robot.simulation.board.walker.command == (0.0, 0.0, 0.0), 'it does not creep'
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
