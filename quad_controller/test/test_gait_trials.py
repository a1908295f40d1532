# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trials of policies beside the gait: courses, what they come to, the chain, and the report."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from dataclasses import replace
import math
from pathlib import Path
import re
import time
from typing import Any

import pytest

from quad_controller import find_policy, GaitGenerator, GaitParameters, Velocity
from quad_controller.exceptions import CheckError
from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.gait.velocity import REST
from quad_controller.policy.contract.model import CommandRanges, Gains
from quad_controller.policy.options import gain_rows, ServoResponse
from quad_controller.policy_check.arenas import (
    Conditions,
    PhysicsArena,
    RobotChoice,
    serial_arena,
    SerialArena,
    servo_response,
)
from quad_controller.policy_check.course import (
    axis_of,
    course_for,
    CourseFigures,
    CourseWalker,
    Passage,
)
from quad_controller.policy_check.findings import against_gait, is_too_late, timing_notes
from quad_controller.policy_check.main import ExitCode, run
from quad_controller.policy_check.trial import Candidate, run_trials, Trial
from quad_description import robot_urdf, RobotState
from quad_gait_rig import metadata, ROBOT, write_policy
from quad_hardware import NoAnswerError
from quad_sim import CommandTiming, ServedRobot, Watched
from quad_sim.physics import PhysicsBackend, Robot

DEADLINE = 90.0  # [s]
STAND_TARGETS = GaitGenerator(ROBOT, GaitParameters()).stand_targets
FAIR = Passage(Velocity(0.2), Velocity(0.19), 10.0, 0, 0.05, 0.02, 0.0, 0.05, 5.0)


def course(*passages: Passage) -> CourseFigures:
    """Return the figures of some passages."""
    return CourseFigures(passages or (FAIR,))


# --- what is walked


def test_a_course_has_what_a_policy_was_trained_for() -> None:
    """Three speeds of each axis and one backward, within its commands; none of what it lacks."""
    everything = course_for(None)
    assert len(everything) == 12
    assert {Velocity(-0.2), Velocity(y=-0.1), Velocity(yaw=-1.0)} < set(everything)
    ranges = CommandRanges((-0.15, 0.2), (0.0, 0.0), (0.0, 9.0))
    speeds = (0.0667, 0.1333, 0.2, -0.1)
    assert course_for(ranges)[:4] == tuple(map(Velocity, speeds))
    assert all(each.yaw >= 0.0 for each in course_for(ranges))
    assert {axis_of(each) for each in course_for(ranges)} == {'forward', 'turn'}


@pytest.mark.slow
def test_falls_are_counted_and_walked_on_after() -> None:
    """The gait walks one way without a push, and falls when it is hit."""
    arena = PhysicsArena(RobotChoice())
    walker = CourseWalker(arena, ROBOT, None)
    (walked,) = walker.walk([Velocity(0.2)], 3.0).passages
    assert walked.falls == 0
    assert walked.time == pytest.approx(3.0)
    assert walked.error < 0.03
    assert 1.0 < walked.cost_of_transport < 20.0
    assert 0.0 < walked.smoothness < 0.5
    assert walked.timing is None
    toppled = walker.walk([Velocity(0.2), Velocity(yaw=1.0)], 4.1, push=4.0)
    assert toppled.falls > 0
    assert [each.time > 0.0 for each in toppled.passages] == [True, True]
    assert math.isnan(toppled.passages[1].cost_of_transport)


@pytest.mark.slow
def test_the_trained_policy_falls_less_than_half_as_often_as_the_gait() -> None:
    """On firm servos, under pushes that tip the low and wide gait, too; unpushed it goes along."""
    firm, commands = RobotChoice(servo='firm'), (Velocity(0.2), Velocity(yaw=1.0))
    policy = Candidate(find_policy('trot_ppo'), robot=firm)
    pushed, walkers = Conditions(push=2.0), (Candidate(gait=LOW_AND_WIDE, robot=firm), policy)
    trials = [Trial(who, commands, 16.0, pushed) for who in walkers]
    gait, trained, level = run_trials([*trials, Trial(policy, course_for(None), 3.0)])
    assert gait.falls > 3
    assert trained.falls <= 0.5 * gait.falls
    assert level.falls == 0
    assert level.mean('error') < 0.03


@pytest.mark.slow
def test_protocol_v1_costs_the_gait_no_speed() -> None:
    """Positions come in steps of a byte, and velocities from their differences."""
    for preset, widest in (('lite', 30.0), ('mini', 31.0)):  # of a hip [deg], in 255 steps
        backend = PhysicsArena(RobotChoice(preset), Conditions(v1=True)).backend
        state = backend.reset()
        for step in range(20):
            state = backend.step([*STAND_TARGETS[:-1], STAND_TARGETS[-1] + 0.02 * step])
        assert state.joints is not None
        degrees = math.degrees(state.joints.positions[0])
        steps = (degrees + widest) * 255.0 / (2.0 * widest)
        assert steps == pytest.approx(round(steps), abs=1e-6)
        assert state.joints.velocity_error > 0.1  # [rad/s]
    pair = [Trial(Candidate(), (Velocity(0.2),), 3.0, Conditions(v1=v1)) for v1 in (False, True)]
    plain, rounded = run_trials(pair)
    assert rounded.mean('error') < plain.mean('error') + 0.02


class Interrupted(PhysicsArena):
    """An arena on a machine that pauses as often as is said, each time with a fall."""

    times = 0

    @property
    def interruption(self) -> str:
        """The pause, unless none is left."""
        self.times -= 1
        return 'a pause of 0.7 s' if self.times >= 0 else ''

    @interruption.setter
    def interruption(self, _: str) -> None: ...


@pytest.mark.slow
def test_what_the_machine_does_is_no_fall_of_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """A walk that it cut off is walked again; too many of them end the trial."""
    monkeypatch.setattr('quad_controller.policy_check.course.MAX_INTERRUPTIONS', 2)
    arena = Interrupted(RobotChoice(), Conditions())
    arena.times = 1
    walker = CourseWalker(arena, ROBOT, None)
    figures = walker.walk([Velocity(0.1)], 3.0, push=5.0)
    assert walker.interruptions == 1
    assert figures.falls == 1
    arena.times = 1000
    with pytest.raises(CheckError, match=r'too busy .* a pause of 0\.7 s'):
        walker.walk([Velocity(0.1)] * 2, 3.0, push=5.0)


def test_a_robot_that_is_silent_for_a_while_is_waited_for() -> None:
    """And that is noted, as what interrupted the walk."""
    physics, missing = PhysicsBackend(Robot(robot_urdf())), [None] * 3
    step = physics.step

    def late(targets: Sequence[float] | None) -> RobotState:
        if missing:
            missing.pop()
            raise NoAnswerError('no report for 0.5 s')
        return step(targets)

    physics.step = late  # type: ignore[method-assign]
    arena = SerialArena(ServedRobot(), physics)
    arena.step(None)
    assert 'no report' in arena.interruption
    arena.interruption = ''
    arena.step(None)
    assert arena.interruption == ''


@pytest.mark.slow
def test_the_gait_walks_through_the_whole_chain() -> None:
    """Servos, board, line, driver, estimator: it gets on, and its commands are timed."""
    with serial_arena(RobotChoice()) as arena:
        walker = CourseWalker(arena, ROBOT, None)
        end = time.monotonic() + DEADLINE
        measured = walk_on(arena, walker, end)
        while measured.metered.x < 0.1:
            assert time.monotonic() < end, measured
            measured = walk_on(arena, walker, end)
        assert measured.metered.energy > 0.0
        assert 0.0 < measured.timing.latency(0.5) < measured.timing.latency(1.0)
        walker.run(0.5, REST)


def walk_on(arena: SerialArena, walker: CourseWalker, end: float) -> Watched:
    """Walk for a second, from standing where a busy machine has brought the robot down."""
    if walker.is_down:
        walker.restart()
        walker.stand_up()
        arena.robot.begin()
    for _ in range(50):
        if walker.is_down or time.monotonic() > end:
            break
        walker.step(Velocity(0.2))
    return arena.robot.read()


# --- what is judged


def test_a_policy_that_goes_as_commanded_and_falls_no_oftener_stands_up() -> None:
    """Also where both fall alike; going astray is one's own, whatever the gait does."""
    fell = replace(FAIR, falls=1)
    assert list(against_gait(course(), course())) == []
    assert list(against_gait(course(FAIR, fell), course(FAIR, fell))) == []
    slow = course(replace(FAIR, went=Velocity(0.05)))
    (reason,) = against_gait(slow, slow)
    assert 'so does the gait' in reason


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'falls': 2}, 'it fell 2 times, the gait 0'),
        ({'went': Velocity(0.05)}, 'x went \\+0.050 of \\+0.200, too slow'),
        ({'went': Velocity(-0.001)}, 'x went -0.001 of \\+0.200, hardly any'),
        ({'went': Velocity(-0.2)}, 'the other way'),
        ({'torque_saturation': 0.4}, 'largest torque for 40% of the time'),
        ({'speed_saturation': 0.3}, 'largest speed for 30% of the time'),
        ({'time': 0.0}, 'never came to walk'),
    ],
)
def test_a_policy_that_does_worse_than_the_gait_does_not(
    changes: dict[str, Any], reason: str
) -> None:
    """With the reason."""
    found = list(against_gait(course(replace(FAIR, **changes)), course()))
    assert len(found) == 1
    assert re.search(reason, found[0])


def test_late_commands_are_named_and_say_nothing_of_a_policy() -> None:
    """Without clocks there is nothing to name."""
    late = course(replace(FAIR, timing=CommandTiming((0.004, 0.005, 0.006), (0.03,) * 3)))
    notes = ' '.join(timing_notes(late))
    assert '5.0 ms (median), goal 3 ms' in notes
    assert '30.0 ms off their period' in notes
    assert is_too_late(late, 0.02)
    fine = replace(FAIR, timing=CommandTiming((0.001,), (0.001,)))
    assert list(timing_notes(course(fine, fine))) == list(timing_notes(course())) == []
    assert not is_too_late(course(), 0.02)


# --- gains

FIRM = servo_response('firm')


def test_the_bandwidth_is_where_a_servo_has_lost_three_decibel() -> None:
    """By the transfer function itself."""
    for servo in (FIRM, servo_response('vendor_rl'), ServoResponse(5.0, 0.02, 1e-3)):
        s = 2j * math.pi * servo.bandwidth
        answer = servo.stiffness / (servo.inertia * s * s + servo.damping * s + servo.stiffness)
        assert abs(answer) == pytest.approx(math.sqrt(0.5))


@pytest.mark.parametrize(
    ('stiffness', 'damping', 'latency', 'words'),
    [
        (10.0, 0.3, 0.005, []),
        (1.1, 0.05, 0.005, ['pulls 9.1 times as hard']),
        (40.0, 0.3, 0.005, ['sag 4.0 times as far', 'times as slowly']),
        (10.0, 2.0, 0.005, ['times as fast']),
        (0.0, 0.3, 0.005, ['0 N m/rad']),
        (10.0, 0.3, 0.03, ['30 ms']),  # half of the period of 20 ms is near enough
    ],
)
def test_other_gains_than_those_of_the_servos_are_named_with_what_they_do(
    stiffness: float, damping: float, latency: float, words: list[str]
) -> None:
    """A warning for each that is far off, none for those that are near."""
    gains = Gains((10.0, stiffness), (0.3, damping))
    rows = gain_rows(gains, replace(FIRM, latency=latency), 0.02)
    warned = [row for row in rows if row.verdict.value == 'warn']
    assert len(warned) == len(words)
    for row, word in zip(warned, words, strict=True):
        assert word in row.found


@pytest.mark.slow
def test_a_policy_that_walks_nowhere_does_not_stand_up_beside_the_gait(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report has a row for each command of each walker; what was not measured is empty."""
    fastest = course_for(None)[2::4]
    monkeypatch.setattr('quad_controller.policy_check.main.course_for', lambda _: fastest)
    still, report = write_policy(tmp_path / 'still.onnx', metadata()), tmp_path / 'report.csv'
    assert run([str(still), '--duration', '1', '--report', str(report)]) == ExitCode.DOES_NOT
    output = capsys.readouterr().out
    assert 'does not stand up:\n' in output
    assert 'hardly any' in output
    assert 'not stated' in output, 'the gains'
    rows = list(csv.DictReader(report.read_text(encoding='utf-8').splitlines()))
    walked = [(walker, command) for walker in ('policy', 'gait') for command in fastest]
    for row, (walker, command) in zip(rows, walked, strict=True):
        assert (row['walker'], row['axis']) == (walker, axis_of(command))
        assert float(row['commanded yaw [rad/s]']) == pytest.approx(command.yaw, abs=1e-3)
        assert (row['falls'], row['latency p50 [s]']) == ('0', '')
    slow = next(row for row in rows if row['axis'] == 'forward')
    assert abs(float(slow['went x [m/s]'])) < 0.05
