# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the IMU is mounted: found by tilting, applied to reports, and not taken for granted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
import itertools
import math
from pathlib import Path
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from quad_description import movable_joints, robot_urdf
from quad_description.rotations import (
    conjugate,
    down_in_body,
    from_rpy,
    multiply,
    Quaternion,
    rotate,
    rotation_vector,
    Vector,
    yaw_of,
)
from quad_hardware import CommandError
from quad_hardware.calibration.imu import find_mounting, Stance
from quad_hardware.calibration.main import imu_parameters, read_parameters, run_calibrate
from quad_hardware.calibration.wizard import ImuReading, mean_attitude
from quad_hardware.estimation import Estimator, EstimatorSettings, ImuMounting
from quad_hardware.filters import STANDARD_GRAVITY
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.protocol import LEG_MOTORS, Protocol, V1, V2
from quad_hardware.report import Report
from quad_pty_peer import PtyPeer, Script

pytestmark = pytest.mark.slow

SIGNS: list[Vector] = [(x, y, z) for x, y, z in itertools.product((1.0, -1.0), repeat=3)]
MOUNTINGS = st.builds(
    ImuMounting,
    st.builds(
        from_rpy,
        st.sampled_from([0.0, math.pi]),
        st.just(0.0),
        st.sampled_from([quarter * math.pi / 2 for quarter in range(4)]),
    ),
    st.sampled_from(SIGNS),
    st.sampled_from(SIGNS),
)
YAWED = ImuMounting(from_rpy(0.0, 0.0, math.pi))  # as in the vendor's simulation


def angles_of(rotation: Quaternion) -> Vector:
    """Roll, pitch, yaw of a rotation [deg]."""
    x, y, z, w = rotation
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(min(max(2 * (w * y - z * x), -1.0), 1.0))
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw_of(rotation))


def signed(signs: Vector, values: Vector) -> Vector:
    """Values with signs."""
    x, y, z = (sign * value for sign, value in zip(signs, values, strict=True))
    return x, y, z


def report(mounting: ImuMounting, body: Quaternion) -> ImuReading:
    """What an IMU with a mounting reports of a body at rest."""
    unsigned = angles_of(multiply(body, mounting.rotation))
    x, y, z = down_in_body(body)
    force = (-STANDARD_GRAVITY * x, -STANDARD_GRAVITY * y, -STANDARD_GRAVITY * z)
    felt = rotate(conjugate(mounting.rotation), force)
    return ImuReading(
        signed(mounting.attitude_signs, unsigned), signed(mounting.acceleration_signs, felt)
    )


def held(mounting: ImuMounting, tilt: float = 20.0, yaw: float = 0.3) -> dict[Stance, ImuReading]:
    """What is reported while a person holds the robot as asked, with a hand that is not exact."""
    angle, odd = math.radians(tilt), 0.05
    bodies = {
        Stance.LEVEL: from_rpy(odd, -odd, yaw),
        Stance.NOSE_DOWN: from_rpy(-odd, angle, yaw + 0.1),
        Stance.RIGHT_DOWN: from_rpy(angle, odd, yaw - 0.1),
        Stance.TURNED_LEFT: from_rpy(0.0, odd, yaw + 0.8),
    }
    return {stance: report(mounting, body) for stance, body in bodies.items()}


@settings(max_examples=50)
@given(MOUNTINGS, st.floats(12.0, 40.0), st.floats(-3.1, 3.1), st.booleans())
def test_what_is_found_turns_reports_into_the_attitude_of_the_body(
    mounting: ImuMounting, tilt: float, yaw: float, accelerometer: bool
) -> None:
    """Whatever the signs, and any of the eight ways to lie on the board: gravity is right."""
    readings = held(mounting, tilt, yaw)
    if not accelerometer:
        readings = {stance: replace(r, acceleration=None) for stance, r in readings.items()}
    found = find_mounting(readings)
    assert found.checked
    for roll, pitch, turn in [(0.3, 0.0, 0.0), (0.0, -0.3, 1.0), (-0.2, 0.2, -2.0)]:
        body = from_rpy(roll, pitch, turn)
        seen = report(mounting, body)
        attitude = found.attitude(seen.attitude)
        assert down_in_body(attitude) == pytest.approx(down_in_body(body), abs=1e-6)
        if accelerometer:
            assert seen.acceleration is not None
            down = rotate(conjugate(body), (0.0, 0.0, -STANDARD_GRAVITY))
            felt = found.acceleration(seen.acceleration)
            assert [-x for x in felt] == pytest.approx(down, abs=1e-6)
    level, turned = (
        yaw_of(found.attitude(report(mounting, from_rpy(0.0, 0.0, angle)).attitude))
        for angle in (0.0, 0.5)
    )
    assert math.remainder(turned - level, math.tau) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(
    'mounting',
    [YAWED, ImuMounting(YAWED.rotation, (1.0, -1.0, -1.0), (1.0, -1.0, 1.0), (-1.0, 1.0, -1.0))],
    ids=['yawed', 'yawed, with other signs'],
)
def test_reports_are_published_for_the_body(mounting: ImuMounting) -> None:
    """Attitude, acceleration and turn rate, by the mounting of the parameters."""
    urdf = robot_urdf('lite')
    joints = JointMap(servo_of(joint) for joint in movable_joints(urdf))
    estimator = Estimator(urdf, joints, EstimatorSettings(mounting=mounting))
    body, turning = from_rpy(0.2, -0.3, 1.0), (0.5, -1.0, 2.0)
    seen = report(mounting, body)
    rates = signed(mounting.rate_signs, rotate(conjugate(mounting.rotation), turning))
    zeros = dict.fromkeys(LEG_MOTORS, 0.0)
    reported = Report(
        0.0, 0.001, seen.attitude, seen.acceleration, zeros, zeros,
        rates=signed((math.degrees(1.0),) * 3, rates),
    )  # fmt: skip
    state = estimator.step(reported)
    assert state is not None
    assert state.imu is not None
    assert state.imu.down == pytest.approx(down_in_body(body), abs=1e-6)
    up = rotate(conjugate(body), (0.0, 0.0, STANDARD_GRAVITY))
    assert state.imu.acceleration == pytest.approx(up, abs=1e-6)
    assert state.imu.angular_velocity == pytest.approx(turning, abs=1e-9)


def test_a_turned_imu_is_a_turned_imu() -> None:
    """Where both would do, a rotation is found and not two wrong signs."""
    found = find_mounting(held(YAWED))
    assert found.attitude_signs == found.acceleration_signs == (1.0, 1.0, 1.0)
    assert abs(yaw_of(found.rotation)) == pytest.approx(math.pi)
    assert find_mounting(held(ImuMounting())) == ImuMounting(checked=True)


FIRM = held(ImuMounting())
SWUNG = replace(FIRM[Stance.RIGHT_DOWN], acceleration=(0.0, 5.0, 13.0))
ASKEW = replace(FIRM[Stance.NOSE_DOWN], acceleration=FIRM[Stance.RIGHT_DOWN].acceleration)


@pytest.mark.parametrize(
    ('spoilt', 'named'),
    [
        ({Stance.NOSE_DOWN: FIRM[Stance.LEVEL]}, 'nose_down'),
        ({Stance.RIGHT_DOWN: SWUNG}, 'right_down'),
        ({Stance.NOSE_DOWN: ASKEW}, 'nose_down'),
    ],
    ids=['not tilted', 'swung', 'an accelerometer that feels otherwise'],
)
def test_what_fits_no_mounting_is_refused(spoilt: dict[Stance, ImuReading], named: str) -> None:
    """The message says in which stance, and nothing is found."""
    with pytest.raises(CommandError, match=named):
        find_mounting({**FIRM, **spoilt})


def turned(
    mounting: ImuMounting, gyro: Vector, bias: float, noise: Callable[[], float]
) -> dict[Stance, ImuReading]:
    """What is reported while a person turns the robot from one stance to the next, too.

    Args:
        mounting: Of the IMU.
        gyro: What the gyro says for each [rad/s] about its axes.
        bias: Of the gyro [deg/s].
        noise: Of the attitude [deg].
    """
    ways = {  # roll, pitch, yaw of the body at the ends [rad]
        Stance.LEVEL: (0.0, 0.0, 0.3),
        Stance.NOSE_DOWN: (0.0, 0.35, 0.3),
        Stance.RIGHT_DOWN: (0.35, 0.0, 0.3),
        Stance.TURNED_LEFT: (0.0, 0.0, 1.1),
    }
    readings, start = held(mounting), ways[Stance.LEVEL]
    for stance, end in ways.items():
        states, before = [], from_rpy(*start)
        for tick in range(90):  # a second to turn, and a while to hold
            share = min(tick / 50, 1.0)
            roll, pitch, yaw = (a + share * (b - a) for a, b in zip(start, end, strict=True))
            body = from_rpy(roll, pitch, yaw)
            vector = rotation_vector(multiply(conjugate(before), body))
            felt = rotate(conjugate(mounting.rotation), vector)
            x, y, z = (
                bias + share * math.degrees(angle) / 0.02
                for share, angle in zip(gyro, felt, strict=True)
            )
            r, p, q = (angle + noise() for angle in report(mounting, body).attitude)
            state = Report(tick * 0.02, 0.0, (r, p, q), None, {}, {}, rates=(x, y, z))
            states.append(state)
            before = body
        readings[stance] = replace(readings[stance], on_the_way=tuple(states))
        start = end
    return readings


@settings(max_examples=25)
@given(MOUNTINGS, st.sampled_from(SIGNS), st.floats(-3.0, 3.0), st.integers(0, 9))
def test_turning_the_robot_by_hand_proves_the_signs_of_its_gyro(
    mounting: ImuMounting, signs: Vector, bias: float, seed: int
) -> None:
    """Each axis by the stance that turns about it, whatever hand, bias and noise."""
    random = Random(seed)
    found = find_mounting(turned(mounting, signs, bias, lambda: random.uniform(-0.1, 0.1)))
    assert found.rates_checked
    for axis in range(3):
        rates = [0.0, 0.0, 0.0]
        rates[axis] = 1.0
        felt = rotate(conjugate(mounting.rotation), (rates[0], rates[1], rates[2]))
        x, y, z = (math.degrees(rate) for rate in felt)
        assert found.rate(signed(signs, (x, y, z))) == pytest.approx(rates, abs=1e-9)


@pytest.mark.parametrize(
    ('gyro', 'unseen', 'named'),
    [
        ((0.0, 1.0, 1.0), (), 'about x'),
        ((1.0, 0.1, 1.0), (), 'about y'),
        ((1.0, 1.0, 9.0), (), 'about z'),
        ((1.0, 1.0, 1.0), (Stance.RIGHT_DOWN, Stance.TURNED_LEFT), 'about x'),
    ],
)
def test_a_gyro_that_does_not_turn_with_the_body_is_refused(
    gyro: Vector, unseen: tuple[Stance, ...], named: str
) -> None:
    """A dead axis, one in another unit, or one whose reports are missing: the message names it."""
    readings = turned(ImuMounting(), gyro, 0.0, lambda: 0.0)
    for stance in unseen:
        readings[stance] = replace(readings[stance], on_the_way=())
    with pytest.raises(CommandError, match=f'gyro.*{named}'):
        find_mounting(readings)


@pytest.mark.parametrize('protocol', [V2, V1], ids=lambda protocol: protocol.name)
def test_a_person_finds_it_and_the_file_has_it(tmp_path: Path, protocol: Protocol) -> None:
    """By the dialogue, over the serial line; protocol v1 has a gyro, whose signs are proven."""
    output, readings = tmp_path / 'found.yaml', held(YAWED if protocol is V2 else ImuMounting())
    with PtyPeer(tmp_path / 'port', protocol) as peer:
        peer.behaviour.gyro = (1.0, -1.0, 1.0)

        def hold(stance: Stance) -> None:
            attitude, acceleration = readings[stance].attitude, readings[stance].acceleration
            assert acceleration is not None
            if protocol is V1:
                peer.turn_to(attitude, acceleration)
            peer.behaviour.attitude, peer.behaviour.acceleration = attitude, acceleration

        script = Script(*((partial(hold, stance), '') for stance in Stance))
        command = ['imu', '--port', str(peer.link), '--output', str(output)]
        assert run_calibrate(command, script) == 0, script.said
        assert peer.torque
        assert peer.commands == []
    found = read_parameters(output)['imu']
    assert isinstance(found, dict)
    assert found['mounting_checked'] is True
    if protocol is V2:  # reports no gyro
        assert found == imu_parameters(find_mounting(readings))['imu']
        assert 'rates_checked' not in found
    else:
        assert (found['rate_signs'], found['rates_checked']) == ([1.0, -1.0, 1.0], True)


@given(st.lists(st.floats(-180.0, 180.0), min_size=1, max_size=15), st.floats(85.0, 89.9))
def test_the_mean_of_attitudes_nose_up_is_one_of_them(rolls: list[float], pitch: float) -> None:
    """There roll and yaw leap together from one report to the next, and the body hardly turns."""
    seen = [(roll, 90.0, roll) for roll in rolls]
    assert mean_attitude(seen)[1] == pytest.approx(90.0, abs=0.1)
    level = mean_attitude([(0.0, pitch, 179.0), (0.0, pitch, -179.0)])
    assert abs(math.remainder(level[2] - 180.0, 360.0)) < 0.5
    assert level[1] == pytest.approx(pitch, abs=0.5)
