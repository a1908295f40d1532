# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The developer firmware of the XGO-Mini: the page's bytes, and a robot that walks by them."""

from __future__ import annotations

from collections.abc import Callable
import itertools
import math
from pathlib import Path
import struct
import time

import pytest
from sim_serial import serve, Served, VirtualRobot

from quad_description import (
    JointSample,
    movable_joints,
    Pose,
    pose_positions,
    robot_urdf,
    RobotState,
)
from quad_hardware import LinkError, NoAnswerError
from quad_hardware.backend import recorded_in, SerialBackend
from quad_hardware.doctor.main import check_port
from quad_hardware.estimation import Estimator, EstimatorSettings
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.link import LinkOptions
from quad_hardware.link.dialects import DeveloperDialect
from quad_hardware.link.open import open_session
from quad_hardware.protocol import (
    DEVELOPER,
    Frame,
    Kind,
    LEG_MOTORS,
    PROTOCOLS,
    Register,
    ROBOT_KINDS,
    StreamParser,
    V1,
)
from quad_hardware.report import Report
from quad_hardware.serial_robot import RobotSettings
from quad_sim.board import Walker
from quad_sim.faults import make_fault

pytestmark = pytest.mark.slow

TIMEOUT = 20.0  # [s] for anything to happen
ARGUMENTS = ('--protocol', 'developer', '--preset', 'mini', '--noise', 'none')
PERIOD = 0.02  # [s] between two pushes


def pushed(order: str, attitude: tuple[float, float, float], motor: int) -> bytes:
    """Return a frame as the vendor's page has it; shares nothing with the product."""
    body = (
        bytes((0x21, 0, 0)) + struct.pack(f'{order}3f', *attitude) + bytes((motor,) * 12 + (77,))
    )
    return b'\x55\x00' + body + bytes((255 - sum(body) % 256,)) + b'\x00\xaa'


def settings(served: Served, *, arm: bool = False, log: Path | None = None) -> RobotSettings:
    """Return the settings of a mini."""
    urdf = robot_urdf('mini', arm)
    servos = JointMap(map(servo_of, movable_joints(urdf)))
    return RobotSettings(LinkOptions(str(served.path)), urdf, servos, serial_log=log)


def joints(state: RobotState) -> JointSample:
    """Return the joints, which are there."""
    assert state.joints is not None
    return state.joints


def wait(condition: Callable[[], bool], what: str) -> None:
    """Wait for something."""
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline, f'no {what}'
        time.sleep(0.002)


@pytest.mark.parametrize('order', ['<', '>'])
def test_the_board_sends_what_the_page_says_and_answers_nothing(order: str) -> None:
    """33 bytes at 50 Hz, from which struct reads attitude, servos and charge; no reply."""
    endian = ('--big-endian',) if order == '>' else ()
    slope = '--slope', '8', '--start', 'stand'
    robot = VirtualRobot(*ARGUMENTS, *endian, *slope, '--battery', '80', protocol=DEVELOPER)
    robot.line.receive(Frame(Kind.READ, Register.FIRMWARE, b'\x0a').encode(V1), 0.0)
    robot.run(1.0)
    frames = [robot.received[at : at + 33] for at in range(0, len(robot.received), 33)]
    assert 49 <= len(frames) <= 51
    for frame in frames[1:-1]:
        assert (frame[:5], frame[-2:]) == (b'\x55\x00\x21\x00\x00', b'\x00\xaa')
        assert (sum(frame[2:-2]) % 256, frame[29]) == (255, 80)
    attitude = struct.unpack(f'{order}3f', frames[-2][5:17])
    assert attitude == pytest.approx((0.0, -8.0, 0.0), abs=2.0)
    assert robot.simulation.line.statistics.frames == 0


def test_servos_are_measured_26_times_a_second() -> None:
    """They turn all the time, and half of the pushes have the bytes of the one before."""
    robot = VirtualRobot(*ARGUMENTS, '--physics', 'none', protocol=DEVELOPER)
    motors = []
    for byte in range(50):  # two degrees a push
        robot.send(Frame(Kind.WRITE, Register.MOTORS, bytes((4 * byte,)) * 12))
        motors += [frame.payload[12:24] for frame in robot.run(PERIOD)]
    changes = sum(before != after for before, after in itertools.pairwise(motors))
    assert 23 <= changes <= 27


def test_joint_velocities_are_of_what_was_measured_anew() -> None:
    """Joints that turn evenly have an even velocity, though half of the pushes repeat them."""
    robot = VirtualRobot(*ARGUMENTS, '--physics', 'none', protocol=DEVELOPER)
    urdf = robot_urdf('mini')
    servos = JointMap(map(servo_of, movable_joints(urdf)))
    estimator, dialect = Estimator(urdf, servos, EstimatorSettings()), DeveloperDialect(0.0)
    thigh, found = servos.names.index('fl_thigh_joint'), []
    robot.send(Frame(Kind.WRITE, Register.MOTORS, bytes(12)))
    robot.run(1.0)
    for byte in range(60):
        robot.send(Frame(Kind.WRITE, Register.MOTORS, bytes((4 * byte,)) * 12))
        for frame in robot.run(PERIOD):
            report = dialect.handle_frame(frame, robot.now)
            assert report is not None
            state = estimator.step(report)
            assert state is not None
            found.append((joints(state).velocities or ())[thigh])
    speed = math.radians(4 * (93 + 66) / 255) / PERIOD
    assert found[20:55] == pytest.approx([speed] * 35, rel=0.35)


@pytest.mark.parametrize('order', ['<', '>'])
def test_it_is_listened_to_and_a_damaged_frame_is_refused(order: str) -> None:
    """No byte goes out before a command; either order of the floats; commands are those of v1."""
    dialect, parser = DeveloperDialect(0.0), StreamParser(DEVELOPER, ROBOT_KINDS)
    good = pushed(order, (1.5, -2.25, 179.9), 128)
    damaged = bytearray(good)
    damaged[20] ^= 0x10
    reports: list[Report] = []
    for count in range(20):
        now = count * PERIOD
        assert not dialect.step(now).send
        for frame in parser.feed(bytes(damaged) if count == 10 else good):
            report = dialect.handle_frame(frame, now)
            assert report is not None
            reports.append(report)
    assert (len(reports), parser.counters.bad_checksum) == (19, 1)
    last = reports[-1]
    assert last.attitude == pytest.approx((1.5, -2.25, 179.9), abs=1e-4)
    assert {report.positions[11] for report in reports} == {last.positions[11]}
    assert last.positions.keys() == set(LEG_MOTORS)
    assert (last.battery, last.acceleration, last.rates) == (77, None, None)
    dialect.command(dict.fromkeys(LEG_MOTORS, 0.0))
    sent = dialect.step(now + PERIOD).send
    assert (sent[:5], len(sent)) == (b'\x55\x00\x14\x00\x50', 20)


def test_auto_finds_a_robot_that_stands_up_walks_and_is_lost(tmp_path: Path) -> None:
    """By commands, in physics; its log replays; a line that falls silent is reported."""
    log = tmp_path / 'serial.log'
    with (
        serve(tmp_path / 'xgo', *ARGUMENTS) as served,
        SerialBackend(settings(served, log=log)) as backend,
    ):
        place = dict(zip(backend.names, joints(backend.reset()).positions, strict=True))
        stand = pose_positions(Pose.STAND)
        for step in range(75):
            share = min(step / 50, 1.0)
            backend.step([p + share * (stand[n] - p) for n, p in place.items()])
        wait(lambda: served.server.truth.pose.position[2] > 0.07, 'stand')
        walker = Walker(robot_urdf('mini'))
        walker.command, begun = (0.15, 0.0, 0.0), time.monotonic()
        while served.server.truth.pose.position[0] < 0.15:
            assert time.monotonic() < begun + TIMEOUT
            targets = walker.step(PERIOD)
            state = backend.step([targets[name] for name in backend.names])
        assert state.imu is not None
        assert (state.imu.acceleration, state.imu.rate_differentiated) == (None, True)
        assert joints(state).velocity_error > 0.9  # of 26 measurements a second
        assert state.foot_contacts is not None
        served.do(lambda: served.simulation.line.faults.add(make_fault('silence', [])))
        with pytest.raises(NoAnswerError, match='no report'):
            wait(lambda: backend.step(None) is None, 'loss')
    assert '"protocol": "developer"' in log.read_text()
    assert len(recorded_in(log, robot_urdf('mini'))) > 75


def test_a_robot_of_another_preset_is_refused_and_its_doctor_knows_it(tmp_path: Path) -> None:
    """The firmware is the mini's; the doctor names it and reads the charge of a push."""
    with serve(tmp_path / 'xgo', *ARGUMENTS, '--physics', 'none', '--battery', '64') as served:
        with pytest.raises(LinkError, match='is of a mini, and preset lite'):
            open_session(LinkOptions(str(served.path), PROTOCOLS, preset='lite'))
        found = '\n'.join(map(str, check_port(str(served.path))))
    assert 'M developer, protocol developer at 1000000 baud' in found
    assert 'at 64 %' in found


def test_an_arm_stays_as_it_is(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Targets of all joints move the legs; the arm is neither moved nor reported, and why."""
    with (
        serve(tmp_path / 'xgo', *ARGUMENTS, '--arm', '--physics', 'none') as served,
        SerialBackend(settings(served, arm=True)) as backend,
    ):
        backend.reset()
        goal = [0.2 if name.endswith('hip_joint') else 0.0 for name in backend.names]
        moved = backend.names.index('fl_hip_joint')
        wait(lambda: joints(backend.step(goal)).positions[moved] > 0.15, 'hip')
        state = backend.observe()
    unmeasured = [backend.names[place] for place in joints(state).unmeasured]
    assert unmeasured == [joint for joint in backend.names if joint.startswith(('arm', 'hand'))]
    assert 'the developer firmware moves no arm' in caplog.text
