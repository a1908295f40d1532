# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints and servos: radians and degrees, signs and offsets, and what is missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
import sys
import threading
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_description import movable_joints, robot_urdf
from quad_hardware import CommandError
from quad_hardware.joints import (
    CommandLimiter,
    JointMap,
    JointServo,
    LimiterSettings,
    MAX_PERIOD,
    NOMINAL_PERIOD,
    servo_of,
)
from quad_hardware.link.dialects import V1Dialect, V2Dialect
from quad_hardware.protocol import LEG_MOTORS, Model

LEGS, ARM = movable_joints(robot_urdf('lite')), movable_joints(robot_urdf('lite', arm=True))
JOINTS, ARM_JOINTS = (JointMap(map(servo_of, joints)) for joints in (LEGS, ARM))
HOME = [0.0] * 12
POSITIONS = st.lists(st.floats(-1e3, 1e3), min_size=12, max_size=12)


@pytest.mark.slow
@given(
    st.lists(st.floats(-3.4, 3.4), min_size=12, max_size=12),
    st.lists(st.tuples(POSITIONS, st.floats(0.0, 2.0)), min_size=1, max_size=20),
    st.builds(LimiterSettings, st.floats(0.1, 100.0), st.floats(0.1, 100.0)),
)
def test_no_target_jumps_or_goes_farther_beyond_its_limits(
    measured: list[float], stream: list[tuple[list[float], float]], settings: LimiterSettings
) -> None:
    """From wherever the robot is, whatever is asked for, at whatever intervals.

    Also at the beginning of a stream, where someone allows less than the usual start.
    """
    limiter = CommandLimiter(JOINTS, settings)
    last, now = measured, 0.0
    for index, (wanted, pause) in enumerate(stream):
        now += pause
        elapsed = min(pause, MAX_PERIOD) if index else NOMINAL_PERIOD
        command = limiter.step(wanted, last, now)
        targets = list(command.targets)
        steps = [abs(b - a) for a, b in zip(last, targets, strict=True)]
        assert max(steps) <= settings.max_joint_speed * elapsed + 1e-9
        rows = zip(JOINTS.servos, wanted, last, targets, strict=True)
        for servo, asked, before, target in rows:
            low, high = min(servo.lower, before), max(servo.upper, before)
            assert low <= target <= high
            assert (servo.joint in command.clamped) is not (low <= asked <= high)
            inside = servo.lower <= target <= servo.upper
            assert inside == (servo.joint not in command.outside)
        last = targets


@pytest.mark.parametrize(
    ('wrong', 'reason'),
    [([*HOME[:4], value, *HOME[5:]], 'no finite position for fr_thigh_joint')
     for value in (math.nan, math.inf, -math.inf)]
    + [([0.0] * length, f'{length} positions for 12 joints.*fl_hip_joint, fl_t')
       for length in (0, 1, 11, 13, 16)],
)  # fmt: skip
def test_a_wrong_command_is_refused_and_the_stream_goes_on(
    wrong: list[float], reason: str
) -> None:
    """By joint or with all joints in their order."""
    limiter = CommandLimiter(JOINTS)
    limiter.step(HOME, HOME, 0.0)
    with pytest.raises(CommandError, match=reason):
        limiter.step(wrong, HOME, 0.02)
    assert limiter.step([0.01] * 12, HOME, 0.04).targets == (0.01,) * 12


def test_a_robot_with_arm_takes_legs_or_all() -> None:
    """Twelve positions leave the arm alone."""
    limiter = CommandLimiter(ARM_JOINTS)
    assert len(limiter.step(HOME, [0.0] * 16, 0.0).targets) == 12
    assert len(limiter.step([0.0] * 16, [0.0] * 16, 0.02).targets) == 16
    with pytest.raises(CommandError, match='or the first 12'):
        limiter.step([0.0] * 15, [0.0] * 16, 0.04)


def test_a_stream_begins_slowly_where_the_robot_is() -> None:
    """The first step is small, later ones are large, and it is reported that they are slowed.

    So it begins after a pause, or a reset: the robot may have been moved meanwhile.
    """
    limiter = CommandLimiter(JOINTS, LimiterSettings(10.0, 1.0, start_time=0.5))
    wanted = [*HOME[:1], 1.0, *HOME[2:]]
    first = limiter.step(wanted, HOME, 0.0)
    assert first.targets[1] == pytest.approx(0.02)
    assert first.slowed == ('fl_thigh_joint',)
    for tick in range(1, 50):
        last = limiter.step(wanted, HOME, tick * 0.02)
    assert last.targets[1] == 1.0
    assert last.slowed == ()
    moved = [0.3] * 12
    assert limiter.step(HOME, moved, 2.0).targets[1] == pytest.approx(0.3 - 0.02)
    limiter.reset()
    assert limiter.step(HOME, moved, 2.02).targets[1] == pytest.approx(0.3 - 0.02)


def test_a_leg_that_nobody_has_seen_is_not_moved() -> None:
    """Its target would jump: the command is refused by name, and the next one begins anew."""
    limiter = CommandLimiter(JOINTS)
    with pytest.raises(CommandError, match='no report of fl_thigh_joint, fl_calf_joint'):
        limiter.step([0.5] * 12, [0.0, None, None, *HOME[3:]], 0.0)
    with pytest.raises(CommandError, match='fl_hip_joint'):
        limiter.step([0.5] * 12, [None] * 12, 0.02)
    assert limiter.step([0.5] * 12, HOME, 0.04).targets == pytest.approx([0.04] * 12)


def test_an_arm_servo_that_is_not_reported_takes_its_first_target_and_that_is_reported() -> None:
    """There is nothing to begin from; then it is where it was sent, even after a pause."""
    limiter = CommandLimiter(ARM_JOINTS)
    measured = [*HOME, None, 0.0, 0.0, 0.0]
    first = limiter.step([*HOME, 0.7, 0.0, 0.0, 0.0], measured, 0.0)
    assert first.targets[12] == 0.7
    assert first.unseen == ('arm_yaw_joint',)
    later = limiter.step([*HOME, 0.0, 0.0, 0.0, 0.0], measured, 5.0)
    assert later.targets[12] == pytest.approx(0.7 - 0.04)
    assert later.unseen == ()
    limiter.reset()
    assert limiter.step([*HOME, 0.0, 0.0, 0.0, 0.0], measured, 5.02).unseen != ()


def test_from_beyond_its_limits_a_servo_only_comes_back() -> None:
    """Asked to stay, it stays, for as long as it is asked; and it is reported.

    Farther is refused and reported, nearer is slow, and what was gained is not given away.
    """
    limiter = CommandLimiter(JOINTS)
    found = [0.9, *HOME[1:]]
    for tick in range(50):
        command = limiter.step(found, found, tick * 0.02)
        assert command.targets == tuple(found)
        assert (command.outside, command.clamped) == (('fl_hip_joint',), ())
    limiter.reset()
    farther = limiter.step([1.2, *HOME[1:]], found, 1.0)
    assert farther.targets[0] == 0.9
    assert (farther.outside, farther.clamped) == (('fl_hip_joint',), ('fl_hip_joint',))
    nearer = limiter.step([0.3, *HOME[1:]], found, 1.02)
    assert 0.9 - 0.05 < nearer.targets[0] < 0.9
    assert limiter.step([1.2, *HOME[1:]], found, 1.04).targets[0] == nearer.targets[0]
    for tick in range(3, 60):
        command = limiter.step([0.3, *HOME[1:]], found, 1.0 + tick * 0.02)
    assert command.targets[0] == 0.3
    assert command.outside == ()


def test_a_lost_robot_may_be_reported_in_the_midst_of_a_command() -> None:
    """The driver's thread ends the stream while the node's takes a command of it."""
    limiter, done, place = CommandLimiter(JOINTS), threading.Event(), [0.5] * 12

    def lose() -> None:
        while not done.is_set():
            limiter.reset()

    thread, before = threading.Thread(target=lose), sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    thread.start()
    try:
        for step in range(5_000):
            assert len(limiter.step(place, place, 0.02 * step).targets) == len(place)
    finally:
        done.set()
        thread.join()
        sys.setswitchinterval(before)


@given(st.sampled_from([1, -1]), st.floats(-3, 3), st.floats(-3, 3))
def test_position_and_angle_are_inverse(sign: int, offset: float, position: float) -> None:
    """The offset is where the servo reads zero; the sign turns it round."""
    servo = JointServo('joint', 11, sign, offset)
    assert servo.position(servo.angle(position)) == pytest.approx(position, abs=1e-12)
    assert servo.position(0.0) == offset
    assert servo.position(90.0) == pytest.approx(offset + sign * math.pi / 2)
    assert servo.velocity(90.0) == pytest.approx(sign * math.pi / 2)


def test_every_joint_of_the_robot_has_its_motor() -> None:
    """In the order of the URDF, legs first; zero is zero, but for the gripper.

    Protocol v1 does not read motor 54: nothing is made up for its joint.
    """
    names = tuple(joint.name for joint in ARM)
    assert ARM_JOINTS.names == names
    motors = [servo.motor for servo in ARM_JOINTS.servos]
    assert motors == [13, 12, 11, 23, 22, 21, 43, 42, 41, 33, 32, 31, 54, 53, 52, 51]
    assert ARM_JOINTS.angles([0.0] * 12) == dict.fromkeys(motors[:12], 0.0)
    gripper = ARM_JOINTS.servos[-1]
    assert [gripper.angle(p) for p in (0.0, 0.02)] == pytest.approx([-65.0, 65.0])
    angles = dict.fromkeys(LEG_MOTORS, 90.0)
    assert ARM_JOINTS.positions(angles) == dict.fromkeys(names[:12], pytest.approx(math.pi / 2))
    assert servo_of(KNEE, 11).lower == LEGS[2].limits.lower, 'of another name'
    assert JointMap([*reversed(SERVOS[:12]), *SERVOS[12:]]).leg_count == 12


SERVOS = [servo_of(joint) for joint in ARM]
KNEE, TAIL = (replace(LEGS[2], name=name) for name in ('front_left_knee', 'tail_joint'))


@pytest.mark.parametrize(
    ('refused', 'reason'),
    [
        (lambda: JointMap(s for s in SERVOS if s.joint != 'bl_calf_joint'),
         'no joint for motors 41; .* bl_calf_joint; correct robot_description'),
        (lambda: servo_of(KNEE), r'front_left_knee.*joints\.front_left_knee\.motor'),
        (lambda: JointMap([*SERVOS, servo_of(KNEE, 11)]), 'motor 11 moves two joints'),
        (lambda: JointMap([SERVOS[12], *SERVOS[:12], *SERVOS[13:]]),
         'has arm_yaw_joint before joints of the legs'),
        (lambda: JointMap([*SERVOS, servo_of(TAIL, 61)]),
         r'tail_joint: unknown motor 61; give joints\.tail_joint\.motor'),
    ],
)  # fmt: skip
def test_joints_that_are_no_quadruped_are_refused_by_name(
    refused: Callable[[], object], reason: str
) -> None:
    """Before a port is opened. The legs come first: twelve positions are theirs."""
    with pytest.raises(CommandError, match=reason):
        refused()


@given(
    st.floats(-7, 7), st.sampled_from([1, -1]), st.floats(-math.inf, 7), st.floats(-7, math.inf)
)
def test_every_target_fits_into_a_frame(
    offset: float, sign: int, lower: float, upper: float
) -> None:
    """Whatever a parameter file says: it is refused by name, or both limits can be sent."""
    lower, upper = min(lower, upper), max(lower, upper)
    hip = replace(servo_of(LEGS[0]), offset=offset, sign=sign, lower=lower, upper=upper)
    try:
        joints = JointMap([hip, *(servo_of(joint) for joint in LEGS[1:])])
    except CommandError as error:
        assert 'correct joints.fl_hip_joint.offset' in str(error)  # noqa: PT017  or none
        return
    servo = joints.servos[0]
    assert lower <= servo.lower <= servo.upper <= upper
    for model in Model:
        for position in (servo.lower, servo.upper):
            angles = {**dict.fromkeys(LEG_MOTORS, 0.0), servo.motor: servo.angle(position)}
            for dialect in (V2Dialect(0.0), V1Dialect(0.0, model)):
                dialect.command(angles)


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        ({'sign': 0}, 'sign 0 is neither'),
        ({'offset': math.nan}, 'offset nan'),
        ({'lower': 1.0, 'upper': 0.5}, 'lower 1.0 is above upper 0.5'),
        ({'lower': math.nan}, 'lower nan'),
    ],
)
def test_settings_that_move_a_servo_wrongly_are_refused(
    change: dict[str, Any], reason: str
) -> None:
    """The message names the joint and the value."""
    with pytest.raises(CommandError, match=f'knee: {reason}'):
        JointServo('knee', 11, **change)
