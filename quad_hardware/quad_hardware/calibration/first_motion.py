# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""First motion of each joint: small, while a key is held, then checked by observation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
import math

from first_motion import (
    DriveFacts,
    JointKind,
    judge,
    MotionGuard,
    MotionPlan,
    Order,
    Outcome,
    Sample,
    Seen,
    Verdict,
)
from operator_input import HeldKeys, Keyboard

from ..exceptions import CommandError, NoAnswerError
from ..joints import JointServo
from .wizard import CancelledError, confirm, Console, LimpRobot, place_of, prompt_number

DISTANCE = math.radians(10.0)  # [rad]
SPEED = math.radians(5.0)  # [rad/s]
PLAY = math.radians(1.0)  # [rad] of a servo, and of a byte of protocol v1: no motion
PERIOD = 0.03  # [s] between two looks at the robot
REPORT_TIMEOUT = 0.5  # [s] without a report, after which nothing moves on
OTHER_RANGES = (
    'its angles count otherwise: give --model lite or mini, and look at joints.{joint}.motor'
)
QUIT = frozenset({'q', 'escape', 'ctrl+c'})
REMEDIES = {
    Verdict.OTHER_JOINT: 'two motor ids are exchanged: look at joints.{joint}.motor',
    Verdict.NO_MOTION: 'look at its cable, its torque, and what doctor finds',
    Verdict.ENCODER_ONLY: 'look whether its horn turns on the shaft',
    **dict.fromkeys((Verdict.WRONG_SCALE, Verdict.WRONG_SIGN_AND_SCALE), OTHER_RANGES),
    Verdict.NOT_REPORTED: 'its servo reports no position: look at its cable',
}
"""What to do, where ``calibrate joints`` does not find it."""


def check_joint(
    console: Console,
    robot: LimpRobot,
    keyboard: Callable[[], AbstractContextManager[Keyboard]],
    servo: JointServo,
) -> None:
    """Move a joint while the space bar is held, and ask what the user observed.

    Raises:
        CancelledError: The user cancelled.
        CommandError: The joint did not move as expected; the message has the remedy.
        NoAnswerError: The robot does not report, or commands are not sent.
    """
    angles = robot.angles()
    if servo.motor not in angles:
        raise CommandError(f'motor {servo.motor} of {servo.joint} reports no angle')
    start = servo.position(angles[servo.motor])
    distance = DISTANCE if start + DISTANCE <= servo.upper else -DISTANCE
    guard = MotionGuard(
        MotionPlan(
            start,
            distance,
            SPEED,
            PLAY,
            others={str(m): math.radians(a) for m, a in angles.items() if m != servo.motor},
        ),
        robot.now(),
    )
    console.write(
        f'{servo.joint} (motor {servo.motor}): hold the space bar, and it moves by 10 degrees; '
        'releasing it stops. Enter: it is enough. q, Escape, Ctrl-C: end'
    )
    with keyboard() as keys:
        _move(robot, keys, servo, guard, angles)
    reported = servo.position(robot.angles().get(servo.motor, math.nan)) - start
    if guard.outcome is Outcome.IDLE:
        raise CancelledError(f'{servo.joint}: {guard.outcome.value}; nothing was written')
    if not guard.outcome.is_judged:
        raise CommandError(f'{servo.joint}: {guard.outcome.value}; {_remedy(servo)}')
    seen = _ask_seen(console, servo, reported)
    found = judge(JointKind.TURNS, distance, reported, seen, DriveFacts(1.0))
    console.write(f'  {found.verdict.value}')
    if found.verdict is not Verdict.RIGHT:
        remedy = REMEDIES.get(found.verdict, '').format(joint=servo.joint) or _remedy(servo)
        raise CommandError(f'{servo.joint}: {found.verdict.value}; {remedy}; nothing was written')


def _ask_seen(console: Console, servo: JointServo, reported: float) -> Seen:
    console.write(f'What did you see? + is: {place_of(servo.joint)[1]}.')
    answers = {'+': 1, '-': -1, '0': 0, 'o': 0}
    while (
        way := console.prompt('which way, + or -; 0 for no motion, o for another joint:')
    ) not in answers:
        console.write('  type one of + - 0 o')
    if way in '0o':
        return Seen(0, other_joint=way == 'o')
    if confirm(console, f'by about {math.degrees(abs(reported)):.0f} degrees?', default=True):
        return Seen(answers[way])
    degrees = prompt_number(console, 'by how many degrees about?')
    return Seen(answers[way], math.radians(degrees))


def _remedy(servo: JointServo) -> str:
    return f'calibrate joints --joint {servo.joint} finds its zero, direction and motor'


def _move(
    robot: LimpRobot,
    keys: Keyboard,
    servo: JointServo,
    guard: MotionGuard,
    angles: Mapping[int, float],
) -> None:
    """Move as long as the guard permits; then hold."""
    held, target, plan = HeldKeys(), guard.plan.start, guard.plan
    last = seen_at = robot.now()
    latest, order = dict(angles), Order.NONE
    while order is not Order.END:
        finished = False
        for event in keys.wait(PERIOD):
            held.feed(event)
            if event.is_stroke and event.key in QUIT:
                raise CancelledError('ended by you; nothing was written')
            finished |= event.is_stroke and event.key == 'enter'
        now = robot.now()
        for report in robot.reports():
            latest, seen_at = {**latest, **report.positions}, now
        if now - seen_at > REPORT_TIMEOUT:
            raise NoAnswerError(f'no report for {now - seen_at:.1f} s; {servo.joint} was left')
        sample = Sample(
            servo.position(latest[servo.motor]),
            others={str(motor): math.radians(angle) for motor, angle in latest.items()},
        )
        is_held = held.current(now) == 'space' and not held.is_tap(now)
        order = guard.finish() if finished else guard.step(now, sample, held=is_held, busy=False)
        if guard.moving:
            way = min(abs(target - plan.start) + SPEED * (now - last), abs(plan.distance))
            target = plan.start + math.copysign(way, plan.distance)
        elif order is not Order.NONE:
            target = sample.position
        if guard.moving or order is not Order.NONE:
            robot.command({**angles, servo.motor: servo.angle(target)})
        last = now
