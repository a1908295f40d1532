# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The servo model of a robot: one thigh of a robot that hangs free steps and swings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import itertools
import math
import random
from statistics import median
from typing import Protocol

from urdf_reader import read_urdf

from quad_description import movable_joints

from ..estimation.plausibility import SampleClock
from ..exceptions import CommandError
from ..joints import JointServo
from ..protocol import LEG_MOTORS
from ..report import Report
from .servo_fit import fit_servo, leg_load, Recording, ServoFit
from .wizard import Console

AMPLITUDE = 0.4  # [rad] to either side of where the leg hangs
PERIOD = 0.02  # [s] between two commands on a way
APPROACH_SPEED = 0.5  # [rad/s]
STEPS = 44  # to either side in turn, of 0.3 to 1 of the amplitude
STEP_TIMES = 0.2, 0.4  # [s] between two steps; uneven, so that reports meet them at all phases
SWEEP = 0.3, 3.5  # [Hz] at its ends
SWEEP_TIME = 12.0  # [s]
MAX_OFFSET = 0.15  # [rad] between a servo that follows and its target at rest
SETTLING = 1.0  # [s]


class SwungRobot(Protocol):
    """A robot that is commanded and reports; :class:`.robot.LimpRobot` is one."""

    def angles(self) -> dict[int, float]: ...  # noqa: D102
    def command(self, angles: Mapping[int, float]) -> float: ...  # noqa: D102
    def rounded(self, motor: int, angle: float) -> float: ...  # noqa: D102
    def reports(self) -> Sequence[Report]: ...  # noqa: D102
    def now(self) -> float: ...  # noqa: D102
    def wait_until(self, moment: float) -> None: ...  # noqa: D102


def calibrate_servos(
    console: Console,
    robot: SwungRobot,
    servos: Sequence[JointServo],
    urdf: str,
    leg: str,
    *,
    repeat: int = 1,
) -> ServoFit:
    """Swing the thigh of a leg, fit the servo model, and print it as the other packages take it.

    Args:
        servos: Of all joints.
        leg: Its name, such as fl.
        repeat: How often the motion is done.

    Raises:
        CommandError: The joint does not follow, or the recording shows no servo.
        NoAnswerError: The robot does not report, or commands are not sent.
    """
    (servo,) = (each for each in servos if each.joint == f'{leg}_thigh_joint')
    console.write(
        f'{servo.joint} (motor {servo.motor}) will swing by {math.degrees(AMPLITUDE):.0f} degrees '
        f'to either side for {repeat * 25} s; all other servos hold.'
    )
    console.prompt(
        'Put the trunk on a stand, level, so that all legs hang free, and keep hands away. '
        'Enter begins; Ctrl-C ends it: the leg goes back slowly, and at a second one stays'
    )
    limits = next(each.limits for each in movable_joints(urdf) if each.name == servo.joint)
    held = robot.angles()  # without those that the protocol does not report: they stay
    if missing := sorted(set(LEG_MOTORS) - held.keys()):
        raise CommandError(f'motor {missing[0]} reports no angle; look at the robot with doctor')
    positions = {s.joint: s.position(held[s.motor]) for s in servos if s.motor in held}
    load = leg_load(read_urdf(urdf), servo.joint, positions, limits.effort)
    centre = math.atan(-load.level / load.turned)  # where gravity turns it neither way
    lower, upper = max(limits.lower, servo.lower), min(limits.upper, servo.upper)
    if upper - lower < 2.0 * AMPLITUDE:
        raise CommandError(
            f'{servo.joint} has no room to swing between {lower:g} and {upper:g} rad'
        )
    centre = min(max(centre, lower + AMPLITUDE), upper - AMPLITUDE)
    start = positions[servo.joint]
    try:
        _go(robot, servo, held, start, centre)
        offset = servo.position(_angle(robot, servo)) - centre
        if abs(offset) > MAX_OFFSET:
            raise CommandError(
                f'{servo.joint} is {offset:+.2f} rad from where it was sent; is its torque on, '
                'and does the leg hang free? calibrate joints first where signs are not known'
            )
        motion = list(_motion(centre, repeat))
        recording = _record(robot, servo, held, motion)
    finally:
        _go(robot, servo, held, servo.position(_angle(robot, servo)), start)
    found = fit_servo(recording, load)
    times = [time for time, _ in recording.positions]
    period = median(b - a for a, b in itertools.pairwise(times))
    console.write(
        f'{servo.joint}: {found.error:.4f} rad rms between recording and model; '
        + ', '.join(f'{name} ±{share:.0%}' for name, share in found.deviations.items())
    )
    console.write('the simulated robot, and policies on it:')
    console.write(f'  ros2 run quad_sim fake_xgo --servo {found.argument}')
    console.write('  ros2 run quad_controller check_policy MODEL --servo ... (the same)')
    console.write(f'  without a serial line, add refresh={period:.3g}: reports came so often')
    console.write('the gait:')
    kp = f'servo_compensation.kp:={found.stiffness:.3g}'
    console.write(f'  ros2 run quad_controller controller_node --ros-args -p {kp}')
    return found


def _angle(robot: SwungRobot, servo: JointServo) -> float:
    angle = robot.angles().get(servo.motor)
    if angle is None:
        raise CommandError(f'motor {servo.motor} reports no angle any more')
    return angle


def _motion(centre: float, repeat: int) -> Iterator[tuple[float, float]]:
    """Yield pauses before targets [s], and targets [rad]."""
    uneven = random.Random(1)  # noqa: S311  no secret
    yield 0.0, centre
    for _ in range(repeat):
        yield from _steps_and_sweep(centre, uneven)


def _steps_and_sweep(centre: float, uneven: random.Random) -> Iterator[tuple[float, float]]:
    for index in range(STEPS):
        size = AMPLITUDE * uneven.uniform(0.3, 1.0)
        yield uneven.uniform(*STEP_TIMES), centre + (size if index % 2 else -size)
    yield SETTLING, centre
    for index in range(round(SWEEP_TIME / PERIOD)):
        time = index * PERIOD
        cycles = SWEEP[0] * time + (SWEEP[1] - SWEEP[0]) * time * time / (2 * SWEEP_TIME)
        yield PERIOD, centre + 0.5 * AMPLITUDE * math.sin(2 * math.pi * cycles)


def _record(
    robot: SwungRobot,
    servo: JointServo,
    held: Mapping[int, float],
    motion: Sequence[tuple[float, float]],
) -> Recording:
    targets: list[tuple[float, float]] = []
    robot.reports()
    due = robot.now()
    for pause, target in motion:
        due += pause
        robot.wait_until(due)
        angle = robot.rounded(servo.motor, servo.angle(target))
        sent = robot.command({**held, servo.motor: angle})
        targets.append((sent, servo.position(angle)))
    robot.wait_until(due + SETTLING)
    clock = SampleClock()
    positions = [
        (clock.time(report) - report.joints_age, servo.position(angle))
        for report in robot.reports()
        if math.isfinite(angle := report.positions.get(servo.motor, math.nan))
    ]
    return Recording(targets, positions)


def _go(
    robot: SwungRobot, servo: JointServo, held: Mapping[int, float], start: float, end: float
) -> None:
    count = max(math.ceil(abs(end - start) / (APPROACH_SPEED * PERIOD)), 1)
    due = robot.now()
    for index in range(1, count + 1):
        place = start + (end - start) * index / count
        robot.command({**held, servo.motor: servo.angle(place)})
        due += PERIOD
        robot.wait_until(due)
    robot.wait_until(due + SETTLING)
