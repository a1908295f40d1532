# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories: on their path at any speed, refused with reasons, ended with words."""

from __future__ import annotations

from dataclasses import replace
import math

import core_commands
from core_commands import follow_to_the_end, kept, stream, STREAM_PERIOD, wave
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


def core_of(name: str, execution: ExecutionSettings | None = None) -> MotionCore:
    """Return a core of a robot in its pose to start from."""
    core = MotionCore(robot(name), CoreSettings(execution=execution or ExecutionSettings()))
    core.reset(ready(name))
    return core


def off_the_path(states: list[RobotState], path: Path) -> float:
    """Return how far positions are from the nearest place of a path, at most, in [rad]."""
    places = np.array([path.at(t).position for t in np.linspace(0, path.duration, 4000)])
    return max(float(np.abs(places - s.position).max(axis=1).min()) for s in states[::10])


def path_of(core: MotionCore) -> Path:
    """Return the path that a core follows."""
    assert core.execution is not None
    return core.execution.path


@pytest.mark.parametrize(('name', 'kind'), list(zip(ROBOTS, 'lcq', strict=True)))
def test_a_trajectory_is_followed_to_its_end(name: str, kind: str) -> None:
    """Every kind of segment ends at the goal, within the limits, successful."""
    core = core_of(name)
    goal = wave(robot(name), ready(name), kind)
    execution = core_commands.follow(core, goal)
    states = follow_to_the_end(core, execution)
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.SUCCESSFUL
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    assert not states[-1].moving
    kept(robot(name).limits, states)


@pytest.mark.parametrize('kind', ['l', 'c', 'q'])
def test_a_trajectory_beyond_the_limits_is_followed_within_them(kind: str) -> None:
    """Where a trajectory asks more acceleration than there is, the arm is late, on its path."""
    core = core_of('panda')
    goal = wave(robot('panda'), ready('panda'), kind, step=0.7)
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    assert off_the_path(states, path_of(core)) < 1e-3
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    kept(robot('panda').limits, states)


@pytest.mark.parametrize('kind', ['c', 'q'])
def test_points_are_passed_at_their_times(kind: str) -> None:
    """A point with velocities is passed at its time, within the rounding of the cubic."""
    core = core_of('prbt')
    goal = wave(robot('prbt'), ready('prbt'), kind)
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    for point in goal.points[:-1]:
        there = states[round(point.time / STREAM_PERIOD)]
        assert there.position == pytest.approx(point.positions, abs=2e-3)
        assert there.velocity == pytest.approx(point.velocities, abs=5e-2)


@pytest.mark.parametrize('kind', ['l', 'c', 'q'])
def test_pause_and_resume_stay_on_the_path(kind: str) -> None:
    """A paused arm comes to rest on its path, and goes on along it."""
    core = core_of('panda')
    goal = wave(robot('panda'), ready('panda'), kind)
    core_commands.follow(core, goal)
    events = {0.7: lambda c, _: core_commands.pause(c), 1.6: lambda c, _: core_commands.resume(c)}
    states = [point.state for point in stream(core, 6.0, events)]
    at_rest = [not state.moving for state in states]
    assert any(at_rest[round(0.8 / STREAM_PERIOD) : round(1.6 / STREAM_PERIOD)])
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    assert off_the_path(states, path_of(core)) < 1e-3
    kept(robot('panda').limits, states)


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
    """At 50 % a trajectory takes twice its time."""
    core = core_of('prbt')
    core_commands.override(core, 0.5)
    execution = core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q'))
    states = follow_to_the_end(core, execution)
    assert len(states) * STREAM_PERIOD == pytest.approx(9.0, abs=0.05)


@pytest.mark.parametrize(
    ('name', 'time'), [('panda', 0.1), ('prbt', 0.7), ('gp110', 1.45), ('panda', 2.9)]
)
def test_cancel_stops_on_the_path(name: str, time: float) -> None:
    """A cancelled trajectory comes to rest on its path, within the limits, and says so."""
    core = core_of(name)
    execution = core_commands.follow(core, wave(robot(name), ready(name), 'q'))
    points = stream(core, time + 1.5, {time: lambda c, _: core_commands.stop(c, 'canceled')})
    states = [point.state for point in points]
    assert execution.ending == Outcome(GoalCode.SUCCESSFUL, 'canceled', canceled=True)
    assert execution.phase is Phase.DONE
    assert not states[-1].moving
    assert off_the_path(states, path_of(core)) < 1e-3
    kept(robot(name).limits, states)


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
    assert first.ending is not None
    assert 'new trajectory' in first.ending.reason
    states += follow_to_the_end(core, second)[1:]
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    kept(robot(name).limits, states)


def test_a_first_point_without_time_is_caught_up_with() -> None:
    """Set-points that begin beside the path meet it, and stay on it."""
    core = core_of('gp110')
    start = ready('gp110')
    points = [GoalPoint(0.0, tuple(start + 0.03)), GoalPoint(2.0, tuple(start + 0.4))]
    states = follow_to_the_end(
        core, core_commands.follow(core, TrajectoryGoal(robot('gp110').joints, points))
    )
    assert states[-1].position == pytest.approx(start + 0.4, abs=1e-6)
    assert off_the_path(states[len(states) // 2 :], path_of(core)) < 1e-4
    kept(robot('gp110').limits, states)


def test_the_way_to_a_first_point_heeds_the_speed_override() -> None:
    """Where the arm begins beside a path, it gets there at the speed that is set."""
    core, start = core_of('panda'), ready('panda')
    core_commands.override(core, 0.05)
    points = [GoalPoint(0.0, tuple(start + 0.049)), GoalPoint(5.0, tuple(start + 0.15))]
    core_commands.follow(core, TrajectoryGoal(robot('panda').joints, points))
    states = [point.state for point in stream(core, 8.0)]
    speeds = np.max([np.abs(state.velocity) for state in states], axis=0)
    assert np.all(speeds <= 0.051 * robot('panda').limits.velocity)
    assert np.all(states[-1].position > start + 0.04)


@pytest.mark.parametrize('age', [0.999, 0.9999, 1.4, 2.9999])
def test_a_trajectory_is_joined_at_any_time(age: float) -> None:
    """A point that passes in a moment is no reason to refuse the rest."""
    core = core_of('prbt')
    goal = wave(robot('prbt'), ready('prbt'), 'q', step=1.0)
    states = follow_to_the_end(core, core_commands.follow(core, replace(goal, age=age)))
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    kept(robot('prbt').limits, states)


def test_continuous_joints_take_the_short_way() -> None:
    """A goal a turn away is half a turn away at most, and goes on from there."""
    model = chain('cyyzyz')
    core = MotionCore(model)
    core.reset([3.0, 0.0, 0.5, 0.0, 0.5, 0.0])
    goal = TrajectoryGoal(
        model.joints, [GoalPoint(1.5, (-3.0 - 4 * math.pi, 0.0, 0.5, 0.0, 0.5, 0.0))]
    )
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    assert states[-1].position[0] == pytest.approx(2 * math.pi - 3.0, abs=1e-6)


def test_a_velocity_at_the_end_is_run_out() -> None:
    """Where it is allowed, an end with velocity comes to rest behind the last point."""
    core = core_of('prbt', ExecutionSettings(rules=GoalRules(end_velocity=True)))
    start, joints = ready('prbt'), robot('prbt').joints
    point = GoalPoint(1.0, tuple(start + 0.2), (0.4,) * 6)
    states = follow_to_the_end(core, core_commands.follow(core, TrajectoryGoal(joints, [point])))
    assert np.all(states[-1].position > start + 0.2)
    assert not states[-1].moving
    kept(robot('prbt').limits, states)
    with pytest.raises(GoalError, match=r'prbt_joint_1 has 0\.4000 rad/s at the last point'):
        core_commands.follow(core_of('prbt'), TrajectoryGoal(joints, [point]))


def test_a_trajectory_may_begin_later() -> None:
    """A start in the future is waited for at rest."""
    core = core_of('prbt')
    execution = core_commands.follow(
        core, replace(wave(robot('prbt'), ready('prbt'), 'q'), age=-0.5)
    )
    states = [point.state for point in stream(core, 0.48)]
    assert not any(state.moving for state in states)
    follow_to_the_end(core, execution)
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.SUCCESSFUL


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
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.SUCCESSFUL, execution.ending
    assert len(followed) * STREAM_PERIOD == pytest.approx(4.5 + ahead, abs=0.1)
    assert followed[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    kept(robot(name).limits, states + followed[1:])


def test_an_arm_that_waits_for_a_later_begin_slows_down_on_its_line() -> None:
    """Joints in motion along a straight line come to rest on it, before the new path begins."""
    core, start = core_of('panda'), ready('panda')
    line = np.array([0.6, 0.3, -0.2, 0.1, 0.5, -0.3, 0.2])
    core_commands.follow(
        core, TrajectoryGoal(robot('panda').joints, [GoalPoint(2.0, tuple(start + line))])
    )
    stream(core, 1.0)
    end = tuple(start + 0.1)
    core_commands.follow(
        core, TrajectoryGoal(robot('panda').joints, [GoalPoint(2.0, end)], age=-1.0)
    )
    ways = np.array([point.state.position - start for point in stream(core, 0.99)])
    off = ways - np.outer(ways @ line, line) / float(line @ line)
    assert float(np.abs(off).max()) < 2e-3


def test_a_trajectory_that_has_begun_is_joined() -> None:
    """Points that have passed are left out; the next one is met in its time."""
    core = core_of('prbt')
    goal = replace(wave(robot('prbt'), ready('prbt'), 'q'), age=2.0)
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    assert len(states) * STREAM_PERIOD == pytest.approx(2.5, abs=0.05)
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)


def test_a_trajectory_that_waits_can_be_canceled() -> None:
    """A cancel before the begin ends it at once, at rest."""
    core = core_of('prbt')
    execution = core_commands.follow(
        core, replace(wave(robot('prbt'), ready('prbt'), 'q'), age=-0.5)
    )
    points = stream(core, 0.3, {0.1: lambda c, _: core_commands.stop(c, 'canceled')})
    assert execution.ending == Outcome(GoalCode.SUCCESSFUL, 'canceled', canceled=True)
    assert execution.phase is Phase.DONE
    assert not any(point.state.moving for point in points)


def test_a_trajectory_can_begin_paused() -> None:
    """At a speed of 0 a trajectory waits; with speed it is followed to its end."""
    core = core_of('prbt')
    core_commands.override(core, 0.0)
    execution = core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q'))
    assert not any(point.state.moving for point in stream(core, 0.3))
    core_commands.override(core, 1.0)
    states = follow_to_the_end(core, execution)
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.SUCCESSFUL
    kept(robot('prbt').limits, states)


def lagging(core: MotionCore, lag: Array, cycles: int) -> None:
    """Step a core whose drives are off by an amount."""
    for step in range(cycles):
        state = core.state
        measured = RobotState(state.position - lag, state.velocity, state.acceleration)
        core.step(step * STREAM_PERIOD, STREAM_PERIOD, measured)


def test_a_path_violation_names_joint_amount_and_time() -> None:
    """A joint off its path ends the trajectory on the path, with joint, amount and time."""
    settings_ = ExecutionSettings(path=JointTolerance(0.05))
    core = core_of('prbt', settings_)
    execution = core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q'))
    lagging(core, np.zeros(6), 100)
    lagging(core, np.array([0, 0, 0.08, 0, 0, 0]), 400)
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.PATH_TOLERANCE_VIOLATED
    for word in ('prbt_joint_3', '+0.08', 'tolerance 0.0500', 'at 0.4'):
        assert word in execution.ending.reason
    assert execution.phase is Phase.DONE
    assert not core.state.moving


def test_a_goals_own_tolerance_counts() -> None:
    """A tolerance of the goal replaces the default, and -1 takes it away."""
    goal = wave(robot('prbt'), ready('prbt'), 'q')
    lag = np.array([0, 0, 0.08, 0, 0, 0])
    for tolerance, expected in ((0.1, None), (-1.0, None), (0.02, 'tolerance 0.0200')):
        core = core_of('prbt', ExecutionSettings(path=JointTolerance(0.05)))
        asked = {'prbt_joint_3': JointTolerance(tolerance)}
        execution = core_commands.follow(core, replace(goal, path_tolerance=asked))
        lagging(core, lag, 50)
        ending = execution.ending
        assert (ending is None) == (expected is None)
        assert expected is None or expected in str(ending)


def test_a_goal_that_is_not_reached_in_time_says_so() -> None:
    """A joint that stays off at the end ends with its name, amount and the time."""
    core = core_of('prbt', ExecutionSettings(goal=JointTolerance(0.01), goal_time=0.3))
    execution = core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q', step=0.8))
    lagging(core, np.array([0, 0.02, 0, 0, 0, 0]), 800)
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.GOAL_TOLERANCE_VIOLATED
    for word in ('prbt_joint_2', '+0.0200', 'goal_time 0.3'):
        assert word in execution.ending.reason


def spoiled(index: int, **changes: object) -> TrajectoryGoal:
    """Return a trajectory with one point changed."""
    goal = wave(robot('prbt'), ready('prbt'), 'q')
    points = list(goal.points)
    points[index] = replace(points[index], **changes)  # type: ignore[arg-type]
    return replace(goal, points=points)


GOOD = wave(robot('prbt'), ready('prbt'), 'q')

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
    'no points': (replace(GOOD, points=[]), -1, 'no points'),
    'too many points': (replace(GOOD, points=[GoalPoint(1.0, ())] * 5001), -1, 'at most 5000'),
    'velocities here and there': (spoiled(1, velocities=()), -1, 'point 1 has no velocities and'),
    'accelerations alone': (
        replace(GOOD, points=[replace(point, velocities=()) for point in GOOD.points]),
        -1,
        'accelerations and no velocities',
    ),
    'unknown joint': (replace(GOOD, joints=['elbow', *GOOD.joints[1:]]), -2, "'elbow'"),
    'twice': (replace(GOOD, joints=[GOOD.joints[1], *GOOD.joints[1:]]), -2, 'twice'),
    'missing joint': (replace(GOOD, joints=GOOD.joints[1:]), -2, 'prbt_joint_1 is missing'),
    'no joints': (replace(GOOD, joints=[]), -2, 'missing'),
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
    'far begin': (
        replace(GOOD, points=[GoalPoint(0.0, tuple(ready('prbt') + 0.3))]),
        -1,
        '0.300 rad away',
    ),
}


@pytest.mark.parametrize(('goal', 'code', 'words'), REFUSED.values(), ids=REFUSED.keys())
def test_bad_goals_are_refused_with_reasons(goal: TrajectoryGoal, code: int, words: str) -> None:
    """A goal that cannot be followed is refused with code and reason, and nothing moves."""
    core = core_of('prbt')
    running = core_commands.follow(core, GOOD)
    with pytest.raises(GoalError, match=words) as refused:
        core_commands.follow(core, goal)
    assert refused.value.code == code
    assert running.phase is Phase.FOLLOWING


def test_joints_in_any_order_and_some_of_them() -> None:
    """Joints come in any order; where it is allowed, those that are missing stay."""
    start = ready('prbt')
    names = robot('prbt').joints
    core = core_of('prbt', ExecutionSettings(rules=GoalRules(partial=True)))
    goal = TrajectoryGoal([names[4], names[1]], [GoalPoint(1.5, (start[4] + 0.3, start[1] - 0.2))])
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    expected = np.array(start)
    expected[[4, 1]] += (0.3, -0.2)
    assert states[-1].position == pytest.approx(expected, abs=1e-6)


def test_joints_that_a_goal_of_some_leaves_out_stand_where_they_were_commanded_to() -> None:
    """As joint_trajectory_controller: at its acceptance, also of an arm that moves then."""
    start, names = ready('prbt'), robot('prbt').joints
    core = core_of('prbt', ExecutionSettings(rules=GoalRules(partial=True)))
    core_commands.follow(core, TrajectoryGoal(names, [GoalPoint(2.0, tuple(start + 0.3))]))
    for step in range(100):
        core.step(step * STREAM_PERIOD, STREAM_PERIOD)
    accepted = core.state
    assert accepted.velocity[0] > 0.05
    goal = TrajectoryGoal([names[4]], [GoalPoint(1.5, (start[4],))])
    states = follow_to_the_end(core, core_commands.follow(core, goal))
    expected = np.array(accepted.position)
    expected[4] = start[4]
    assert states[-1].position == pytest.approx(expected, abs=1e-6)


def test_a_turn_of_a_continuous_joint_is_no_error() -> None:
    """A drive that counts from -pi to pi is where it was sent, on the way and at the goal."""
    core = MotionCore(chain('cyyzyz'))
    core.reset([3.0, 0.2, 1.5, 0.9, 1.1, 0.8])
    tight = dict.fromkeys(core.model.joints, JointTolerance(0.01))
    there = [3.6, 0.2, 1.5, 0.9, 1.1, 0.8]
    goal = TrajectoryGoal(core.model.joints, [GoalPoint(2.0, there)])
    execution = core_commands.follow(
        core, replace(goal, path_tolerance=tight, goal_tolerance=tight)
    )
    for step in range(600):
        state = core.state
        wrapped = np.array(state.position)
        wrapped[0] = np.arctan2(np.sin(wrapped[0]), np.cos(wrapped[0]))
        core.step(
            step * STREAM_PERIOD,
            STREAM_PERIOD,
            RobotState(wrapped, state.velocity, state.acceleration),
        )
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.SUCCESSFUL, execution.ending.reason


@pytest.mark.parametrize('age', [0.0, -0.3])
@pytest.mark.parametrize('is_paused_later', [False, True])
def test_a_trajectory_that_is_paused_before_its_begin_does_not_move_the_arm(
    age: float, is_paused_later: bool
) -> None:
    """Not by a creep to its first point either; it begins with the end of the pause."""
    core = MotionCore(robot('panda'))
    begin = ready('panda')
    core.reset(begin)
    points = [GoalPoint(0.0, (begin + 0.0009).tolist()), GoalPoint(2.0, (begin + 0.2).tolist())]
    goal = TrajectoryGoal(core.model.joints, points, age=age)
    if is_paused_later:
        core_commands.follow(core, goal)
        core_commands.pause(core)
    else:
        core_commands.pause(core)
        core_commands.follow(core, goal)
    for step in range(300):
        assert (
            core.step(step * STREAM_PERIOD, STREAM_PERIOD).state.position.tolist()
            == begin.tolist()
        )
    core_commands.resume(core)
    for step in range(300, 900):
        core.step(step * STREAM_PERIOD, STREAM_PERIOD)
    assert core.state.position == pytest.approx(begin + 0.2, abs=1e-6)


def test_a_canceled_trajectory_that_waits_in_a_pause_ends() -> None:
    """Where it is: at rest, before its begin."""
    core = MotionCore(robot('panda'))
    core.reset(ready('panda'))
    core_commands.pause(core)
    there = (ready('panda') + 0.2).tolist()
    execution = core_commands.follow(
        core, TrajectoryGoal(core.model.joints, [GoalPoint(2.0, there)])
    )
    core.step(0.0, STREAM_PERIOD)
    core_commands.stop(core)
    core_commands.resume(core)
    for step in range(1, 20):
        core.step(step * STREAM_PERIOD, STREAM_PERIOD)
    assert execution.phase is Phase.DONE
    assert core.state.position.tolist() == ready('panda').tolist()
