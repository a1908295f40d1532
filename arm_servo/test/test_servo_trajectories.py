# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories: on their path at any speed, refused with reasons, ended with words."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

import core_commands
from core_commands import (
    core_of,
    ending,
    follow_to_the_end,
    goal_to,
    kept,
    stream,
    STREAM_PERIOD,
    wave,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain, ready, robot, ROBOTS
import numpy as np
import pytest

from arm_model import Array, RobotState
from arm_servo import CoreSettings, ExecutionSettings, MotionCore, Outcome, Phase
from arm_trajectory import (
    GoalCode,
    GoalError,
    GoalPoint,
    GoalRules,
    JointTolerance,
    Path,
    TrajectoryGoal,
)

pytestmark = pytest.mark.slow


def prbt(**execution: Any) -> MotionCore:
    """Return a core of the PRBT, with settings for its trajectories."""
    return core_of('prbt', CoreSettings(execution=ExecutionSettings(**execution)))


def off_the_path(states: list[RobotState], path: Path) -> float:
    """Return how far positions are from the nearest place of a path, at most, in [rad]."""
    places = np.array([path.at(t).position for t in np.linspace(0, path.duration, 2000)])
    return max(float(np.abs(places - s.position).max(axis=1).min()) for s in states[::10])


def path_of(core: MotionCore) -> Path:
    """Return the path that a core follows."""
    assert core.execution is not None
    return core.execution.path


@pytest.mark.parametrize('kind', ['c', 'q'])
def test_points_are_passed_at_their_times(kind: str) -> None:
    """A point with velocities is passed at its time, within the rounding of the cubic."""
    core, goal = prbt(), wave(robot('prbt'), ready('prbt'), kind)
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    for point in goal.points[:-1]:
        there = states[round(point.time / STREAM_PERIOD)]
        assert there.position == pytest.approx(point.positions, abs=2e-3)
        assert there.velocity == pytest.approx(point.velocities, abs=5e-2)


@pytest.mark.parametrize(
    ('name', 'time', 'kind'),
    [('panda', 0.7, 'l'), ('prbt', 0.1, 'c'), ('gp110', 1.45, 'q'), ('panda', 2.9, 'q')],
)
def test_pauses_and_a_cancel_stay_on_the_path(name: str, time: float, kind: str) -> None:
    """The arm rests in the pause, goes on, and comes to rest for good, within the limits."""
    core = core_of(name)
    execution = core_commands.follow(core, wave(robot(name), ready(name), kind))
    events = {
        time: lambda c, _: core_commands.pause(c),
        time + 1.0: lambda c, _: core_commands.resume(c),
        time + 1.5: lambda c, _: core_commands.stop(c, 'canceled'),
    }
    states = [point.state for point in stream(core, time + 3.0, events)]
    assert not states[round((time + 0.99) / STREAM_PERIOD)].moving
    assert states[round((time + 1.45) / STREAM_PERIOD)].moving
    assert execution.ending == Outcome(GoalCode.SUCCESSFUL, 'canceled', canceled=True)
    assert execution.phase is Phase.DONE
    assert not states[-1].moving
    assert off_the_path(states, path_of(core)) < 1e-3
    kept(robot(name).limits, states)


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_any_speed_at_any_time_stays_on_the_path(name: str, seed: int) -> None:
    """Speed overrides of 0 to 100 % at any time change the speed and not the path."""
    rng, core = np.random.default_rng(seed), core_of(name)
    core_commands.follow(core, wave(robot(name), ready(name), rng.choice(['l', 'c', 'q'])))
    events = {
        float(time): (lambda c, _, s=float(speed): core_commands.override(c, s))
        for time, speed in zip(rng.uniform(0, 3, 4), [*rng.random(3), 1.0], strict=True)
    }
    states = [point.state for point in stream(core, 6.0, events)]
    assert off_the_path(states, path_of(core)) < 3e-3  # where speed and corner meet
    kept(robot(name).limits, states)


def test_a_speed_override_takes_as_much_longer() -> None:
    """At a speed of 0 a trajectory waits; at 50 % it takes twice its time."""
    core = prbt()
    core_commands.override(core, 0.0)
    execution = core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q'))
    assert not any(point.state.moving for point in stream(core, 0.3))
    core_commands.override(core, 0.5)
    states = follow_to_the_end(core, execution)
    assert len(states) * STREAM_PERIOD == pytest.approx(9.0, abs=0.05)
    assert ending(execution).code is GoalCode.SUCCESSFUL
    kept(robot('prbt').limits, states)


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_new_goal_is_spliced_in(name: str, seed: int) -> None:
    """A goal that replaces another at any moment is reached without a jump."""
    rng, core = np.random.default_rng(seed), core_of(name)
    first = core_commands.follow(core, wave(robot(name), ready(name), rng.choice(['l', 'c', 'q'])))
    states = [point.state for point in stream(core, float(rng.uniform(0.05, 2.5)))]
    goal = wave(robot(name), ready(name), rng.choice(['l', 'c', 'q']))
    second = core_commands.follow(core, goal)
    assert 'new trajectory' in ending(first).reason
    after = follow_to_the_end(core, second)
    assert ending(second).code is GoalCode.SUCCESSFUL
    assert off_the_path(after, second.path) < 1e-3
    states += after[1:]
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    kept(robot(name).limits, states)


def test_a_first_point_without_time_is_caught_up_with_at_the_speed_override() -> None:
    """Set-points that begin beside the path meet it no faster than is set, and stay on it."""
    core, start = core_of('panda'), ready('panda')
    core_commands.override(core, 0.05)
    points = [GoalPoint(0.0, tuple(start + 0.049)), GoalPoint(5.0, tuple(start + 0.15))]
    execution = core_commands.follow(core, TrajectoryGoal(robot('panda').joints, points))
    slow = [point.state for point in stream(core, 8.0)]
    speeds = np.max([np.abs(state.velocity) for state in slow], axis=0)
    assert np.all(speeds <= 0.051 * robot('panda').limits.velocity)
    assert np.all(slow[-1].position > start + 0.04)
    core_commands.override(core, 1.0)
    states = follow_to_the_end(core, execution)
    assert states[-1].position == pytest.approx(start + 0.15, abs=1e-6)
    assert off_the_path(states, path_of(core)) < 1e-4
    kept(robot('panda').limits, slow + states[1:])


@pytest.mark.parametrize('age', [0.999, 0.9999, 1.4, 2.0, 2.9999])
def test_a_trajectory_is_joined_at_any_time(age: float) -> None:
    """Points that have passed are left out; one that passes in a moment refuses nothing."""
    core, goal = prbt(), wave(robot('prbt'), ready('prbt'), 'q', step=1.0)
    states = follow_to_the_end(core, core_commands.follow(core, replace(goal, age=age)))
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    if age == 2.0:  # the next point is met in its time
        assert len(states) * STREAM_PERIOD == pytest.approx(1.0, abs=0.05)
    kept(robot('prbt').limits, states)


def test_continuous_joints_take_the_short_way() -> None:
    """A goal a turn away is half a turn away at most; a drive that counts from -pi is there."""
    core = core_of(chain('cyyzyz'), at=[3.0, 0.0, 0.5, 0.0, 0.5, 0.0])
    tight = dict.fromkeys(core.model.joints, JointTolerance(0.01))
    goal = goal_to(core, (-3.0 - 4 * math.pi, 0.0, 0.5, 0.0, 0.5, 0.0))
    execution = core_commands.follow(
        core, replace(goal, path_tolerance=tight, goal_tolerance=tight)
    )
    for step in range(600):
        state = core.state
        wrapped = np.array(state.position)
        wrapped[0] = np.arctan2(np.sin(wrapped[0]), np.cos(wrapped[0]))
        measured = RobotState(wrapped, state.velocity, state.acceleration)
        core.step(step * STREAM_PERIOD, STREAM_PERIOD, measured)
    assert ending(execution).code is GoalCode.SUCCESSFUL, ending(execution)
    assert core.state.position[0] == pytest.approx(2 * math.pi - 3.0, abs=1e-6)


def test_a_velocity_at_the_end_is_run_out() -> None:
    """Where it is allowed, an end with velocity comes to rest behind the last point."""
    core, start = prbt(rules=GoalRules(end_velocity=True)), ready('prbt')
    goal = TrajectoryGoal(core.model.joints, [GoalPoint(1.0, tuple(start + 0.2), (0.4,) * 6)])
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    assert np.all(states[-1].position > start + 0.2)
    assert not states[-1].moving
    kept(robot('prbt').limits, states)
    with pytest.raises(GoalError, match=r'prbt_joint_1 has 0\.4000 rad/s at the last point'):
        core_commands.follow(prbt(), goal)


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 10**6), ahead=st.floats(0.002, 1.5))
def test_a_later_begin_is_planned_before_it(name: str, seed: int, ahead: float) -> None:
    """A stamp ahead plans nothing in the cycle, whatever moves; the end is met at its time."""
    rng, core = np.random.default_rng(seed), core_of(name)
    if seed % 2:
        core_commands.follow(core, wave(robot(name), ready(name), 'q'))
    else:
        core_commands.jog(core, {robot(name).joints[0]: 0.3}, 0.0, 30.0)
    states = [point.state for point in stream(core, float(rng.uniform(0.05, 1.0)))]
    goal = replace(wave(robot(name), ready(name), 'q'), age=-ahead)
    execution = core_commands.follow(core, goal)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr('arm_servo.controllers.trajectory.build_path', None)
        followed = follow_to_the_end(core, execution)
    assert ending(execution).code is GoalCode.SUCCESSFUL, ending(execution)
    assert len(followed) * STREAM_PERIOD == pytest.approx(4.5 + ahead, abs=0.1)
    assert followed[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    kept(robot(name).limits, states + followed[1:])


def test_an_arm_that_waits_for_a_later_begin_slows_down_on_its_line() -> None:
    """Joints in motion along a straight line come to rest on it, before the new path begins."""
    core, start = core_of('panda'), ready('panda')
    line = np.array([0.6, 0.3, -0.2, 0.1, 0.5, -0.3, 0.2])
    core_commands.follow(core, goal_to(core, start + line))
    stream(core, 1.0)
    core_commands.follow(core, goal_to(core, start + 0.1, age=-1.0))
    ways = np.array([point.state.position - start for point in stream(core, 0.99)])
    off = ways - np.outer(ways @ line, line) / float(line @ line)
    assert float(np.abs(off).max()) < 2e-3


def lagging(core: MotionCore, lag: Array, cycles: int) -> None:
    """Step a core whose drives are off by an amount."""
    for step in range(cycles):
        state = core.state
        measured = RobotState(state.position - lag, state.velocity, state.acceleration)
        core.step(step * STREAM_PERIOD, STREAM_PERIOD, measured)


@pytest.mark.parametrize(
    ('own', 'words'),
    [
        (None, ('tolerance 0.0500', 'at 0.4')),
        (0.02, ('tolerance 0.0200', 'at 0.4')),
        (0.1, ()),
        (-1.0, ()),
    ],
)
def test_a_path_violation_names_joint_amount_and_time(
    own: float | None, words: tuple[str, ...]
) -> None:
    """A joint off its path ends it, at rest; a goal's own tolerance counts, -1 is none."""
    core = prbt(path=JointTolerance(0.05))
    tolerance = {} if own is None else {'prbt_joint_3': JointTolerance(own)}
    execution = core_commands.follow(core, replace(GOOD, path_tolerance=tolerance))
    lagging(core, np.zeros(6), 100)
    lagging(core, np.array([0, 0, 0.08, 0, 0, 0]), 400)
    if not words:
        assert execution.ending is None
        return
    assert ending(execution).code is GoalCode.PATH_TOLERANCE_VIOLATED
    assert all(word in ending(execution).reason for word in ('prbt_joint_3', '+0.08', *words))
    assert execution.phase is Phase.DONE
    assert not core.state.moving


def test_a_goal_that_is_not_reached_in_time_says_so() -> None:
    """A joint that stays off at the end ends with its name, amount and the time."""
    core = prbt(goal=JointTolerance(0.01), goal_time=0.3)
    execution = core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q', step=0.8))
    lagging(core, np.array([0, 0.02, 0, 0, 0, 0]), 800)
    assert ending(execution).code is GoalCode.GOAL_TOLERANCE_VIOLATED
    for word in ('prbt_joint_2', '+0.0200', 'goal_time 0.3'):
        assert word in ending(execution).reason


GOOD = wave(robot('prbt'), ready('prbt'), 'q')


def spoiled(index: int, **changes: Any) -> TrajectoryGoal:
    """Return a trajectory with one point changed."""
    points = list(GOOD.points)
    points[index] = replace(points[index], **changes)
    return replace(GOOD, points=points)


def points(*rows: GoalPoint) -> TrajectoryGoal:
    """Return a trajectory with other points."""
    return replace(GOOD, points=list(rows))


def joints(*names: str) -> TrajectoryGoal:
    """Return a trajectory of other joints."""
    return replace(GOOD, joints=list(names))


ALONE = [replace(point, velocities=()) for point in GOOD.points]
FAR = GoalPoint(0.0, tuple(ready('prbt') + 0.3))
FIRST, *REST = GOOD.joints

REFUSED = {
    'nan': (spoiled(1, positions=(math.nan,) * 6), -1, 'prbt_joint_1 is nan'),
    'infinite velocity': (spoiled(1, velocities=(math.inf,) * 6), -1, 'must be finite'),
    'wrong length': (spoiled(0, positions=(0.0,) * 5), -1, '5 positions for 6 joints'),
    'no positions': (spoiled(0, positions=()), -1, 'no positions'),
    'times': (spoiled(1, time=1.5), -1, 'must increase'),
    'negative time': (spoiled(0, time=-1.0), -1, 'must be 0 or more'),
    'nan time': (spoiled(0, time=math.nan), -1, 'must be 0 or more'),
    'beyond': (spoiled(1, positions=(9.0,) * 6), -1, 'prbt_joint_3 at 9.0000 is beyond'),
    'too fast': (spoiled(1, time=1.6), -1, 'times the time'),
    'no points': (points(), -1, 'no points'),
    'too many points': (points(*[GoalPoint(1.0, ())] * 5001), -1, 'at most 5000'),
    'velocities here and there': (spoiled(1, velocities=()), -1, 'point 1 has no velocities and'),
    'accelerations alone': (points(*ALONE), -1, 'accelerations and no velocities'),
    'unknown joint': (joints('elbow', *REST), -2, "'elbow'"),
    'twice': (joints(REST[0], *REST), -2, 'twice'),
    'missing joint': (joints(*REST), -2, 'prbt_joint_1 is missing'),
    'no joints': (joints(), -2, 'missing'),
    'over': (replace(GOOD, age=9.0), -3, 'ended 4.500 s ago'),
    'tolerance of a stranger': (
        replace(GOOD, path_tolerance={'elbow': JointTolerance(0.1)}),
        -2,
        "path_tolerance: no joint 'elbow'; joints: prbt_joint_1, ",
    ),
    'nan tolerance': (
        replace(GOOD, goal_tolerance={'prbt_joint_1': JointTolerance(math.nan)}),
        -1,
        'goal_tolerance of prbt_joint_1 is not a number',
    ),
    'far begin': (points(FAR), -1, '0.300 rad away'),
}


@pytest.mark.parametrize(('goal', 'code', 'words'), REFUSED.values(), ids=REFUSED.keys())
def test_bad_goals_are_refused_with_reasons(goal: TrajectoryGoal, code: int, words: str) -> None:
    """A goal that cannot be followed is refused with code and reason, and the other goes on."""
    core = prbt()
    running = core_commands.follow(core, GOOD)
    with pytest.raises(GoalError, match=words) as refused:
        core_commands.follow(core, goal)
    assert refused.value.code == code
    assert running.phase is Phase.FOLLOWING


def test_joints_that_a_goal_of_some_leaves_out_stand_where_they_were_commanded_to() -> None:
    """As joint_trajectory_controller: at its acceptance, also of an arm that moves then."""
    start, core = ready('prbt'), prbt(rules=GoalRules(partial=True))
    names = core.model.joints
    core_commands.follow(core, goal_to(core, start + 0.3))
    stream(core, 0.4)
    accepted = core.state
    assert accepted.velocity[0] > 0.05
    # joints come in any order
    goal = TrajectoryGoal([names[4], names[1]], [GoalPoint(1.5, (start[4], start[1] - 0.2))])
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    expected = np.array(accepted.position)
    expected[[4, 1]] = start[[4, 1]] - (0.0, 0.2)
    assert states[-1].position == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize('age', [0.0, -0.3])
@pytest.mark.parametrize('is_paused_later', [False, True])
def test_a_trajectory_that_is_paused_before_its_begin_does_not_move_the_arm(
    age: float, is_paused_later: bool
) -> None:
    """Not by a creep to its first point either; it begins with the end of the pause."""
    core, begin = core_of('panda'), ready('panda')
    steps = [GoalPoint(0.0, tuple(begin + 0.0009)), GoalPoint(2.0, tuple(begin + 0.2))]
    goal = TrajectoryGoal(core.model.joints, steps, age=age)
    if not is_paused_later:
        core_commands.pause(core)
    core_commands.follow(core, goal)
    core_commands.pause(core)
    for point in stream(core, 1.2):
        assert point.state.position.tolist() == begin.tolist()
    core_commands.resume(core)
    assert stream(core, 2.4)[-1].state.position == pytest.approx(begin + 0.2, abs=1e-6)


@pytest.mark.parametrize('waits_for', ['its stamp', 'the end of a pause'])
def test_a_trajectory_that_waits_can_be_canceled(waits_for: str) -> None:
    """A cancel before the begin ends it at once, at rest."""
    core, is_paused = prbt(), waits_for == 'the end of a pause'
    if is_paused:
        core_commands.pause(core)
    goal = goal_to(core, ready('prbt') + 0.2, age=0.0 if is_paused else -0.5)
    execution = core_commands.follow(core, goal)
    points = stream(core, 0.1)
    core_commands.stop(core, 'canceled')
    core_commands.resume(core)
    points += stream(core, 0.1)
    assert execution.ending == Outcome(GoalCode.SUCCESSFUL, 'canceled', canceled=True)
    assert execution.phase is Phase.DONE
    assert not any(point.state.moving for point in points)
