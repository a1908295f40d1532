# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories that ask more than joints can do: exactly on their path, later or refused."""

from __future__ import annotations

from dataclasses import replace
import math
import re

import core_commands
from core_commands import core_of, ending, goal_to, kept, STREAM_PERIOD
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from model_robots import ready, robot, ROBOTS, table, texts
import numpy as np
import pytest

from arm_model import Array, JointLimits, RobotModel, RobotState
from arm_servo import ArmState, CoreSettings, Execution, ExecutionSettings, MotionCore, Phase
from arm_trajectory import (
    GoalCode,
    GoalError,
    GoalPoint,
    OnlineTrajectoryGenerator,
    TrajectoryGoal,
)

pytestmark = pytest.mark.slow

EXACT = 5e-4  # what counts as on the path in [rad]: a cycle sees a step of the jerk as one


WITHOUT_JERK = RobotModel(
    *texts('panda'),
    {name: each | {'has_jerk_limits': False} for name, each in table('panda').items()},
)


FREE = CoreSettings(check_self_collision=False)


def free(arm: str | RobotModel) -> MotionCore:
    """Return a core of an arm in its pose to start from, without a look at collisions."""
    return core_of(arm, FREE)


def refusal(core: MotionCore, goal: TrajectoryGoal) -> str:
    """Return why a trajectory is refused; empty when it is not."""
    try:
        core_commands.follow(core, goal)
    except GoalError as error:
        return str(error)
    return ''


def slowed(goal: TrajectoryGoal, factor: float) -> TrajectoryGoal:
    """Return a trajectory of positions with more time."""
    points = [replace(point, time=point.time * factor) for point in goal.points]
    return replace(goal, points=points)


def time_optimal(
    limits: JointLimits, begin: Array, end: Array, kind: str, step: float
) -> TrajectoryGoal:
    """Return the straight way as planners give it: without a thought of jerk, sampled.

    Args:
        kind: What its points have: positions (p), velocities (v), accelerations (a).
    """
    way = end - begin
    most = np.maximum(np.abs(way), 1e-9)
    speed, gain = np.min(limits.velocity / most), np.min(limits.acceleration / most)
    rising = min(speed / gain, math.sqrt(1.0 / gain))
    speed = gain * rising
    cruising = (1.0 - speed * rising) / speed
    total = 2.0 * rising + cruising

    def share(time: float) -> tuple[float, float, float]:
        if time < rising:
            return 0.5 * gain * time**2, gain * time, gain
        if time < rising + cruising:
            return 0.5 * speed * rising + speed * (time - rising), speed, 0.0
        left = max(total - time, 0.0)
        return 1.0 - 0.5 * gain * left**2, gain * left, -gain

    points = []
    for time in [*np.arange(0.0, total - 1e-3, step).tolist(), total]:
        s, v, a = share(time)
        rows = {'p': begin + way * s, 'v': way * v, 'a': way * a}
        filled = [tuple(row) if each in kind else () for each, row in rows.items()]
        points.append(GoalPoint(time, *filled))
    return TrajectoryGoal(limits.names, points)


def follow(core: MotionCore, execution: Execution) -> tuple[list[RobotState], float]:
    """Follow a trajectory to its end; return the states, and how far off its path they were."""
    states, off = [core.state], 0.0
    for step in range(round(30.0 / STREAM_PERIOD)):
        states.append(core.step(step * STREAM_PERIOD, STREAM_PERIOD).state)
        error = execution.feedback.desired.position - states[-1].position
        off = max(off, float(np.abs(error).max()))
        if execution.phase is Phase.DONE:
            return states, off
    raise AssertionError('the trajectory is not done after 30 s')


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('kind', ['p', 'pv', 'pva'])
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 10**6), step=st.sampled_from([0.02, 0.1, 0.25]))
def test_time_optimal_plans_are_followed_exactly(
    name: str, kind: str, seed: int, step: float
) -> None:
    """A plan that uses speed and acceleration to the full is followed on its path."""
    core, limits, begin = free(name), robot(name).limits, ready(name)
    end = begin + np.random.default_rng(seed).uniform(-0.8, 0.8, len(begin))
    end = np.clip(end, limits.lower + 0.01, limits.upper - 0.01)
    goal = time_optimal(limits, begin, end, kind, step)
    if kind == 'p':  # corners at full speed are more than joints can do
        goal = slowed(goal, 2.0)
    assume(not refusal(core, goal))  # so short that the jerk alone takes longer than clients wait
    execution = core.execution
    assert execution is not None
    states, off = follow(core, execution)
    assert ending(execution).code is GoalCode.SUCCESSFUL
    assert off < EXACT
    assert states[-1].position == pytest.approx(goal.points[-1].positions, abs=1e-6)
    kept(limits, states)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.floats(0.1, 1.5))
def test_an_assumed_jerk_suffices_for_the_time_parameterization_of_moveit(
    seed: int, size: float
) -> None:
    """Full speed and acceleration, a point every 0.1 s, and a limits file without max_jerk."""
    limits, begin = WITHOUT_JERK.limits, ready('panda')
    end = begin + np.random.default_rng(seed).uniform(-size, size, len(begin))
    end = np.clip(end, limits.lower + 0.01, limits.upper - 0.01)
    core = free(WITHOUT_JERK)
    assert not refusal(core, time_optimal(limits, begin, end, 'pva', 0.1))


@pytest.mark.parametrize('is_assumed', [True, False])
def test_a_refusal_for_an_assumed_jerk_names_it_as_assumed(is_assumed: bool) -> None:
    """The owner of the arm has a line to add to the limits file; one that has it is not asked."""
    known = {name: entry | {'max_jerk': 20.0} for name, entry in table('panda').items()}
    model = WITHOUT_JERK if is_assumed else RobotModel(*texts('panda'), known)
    rate, bend = 80.0 * math.pi / 6.0, 0.9 * model.limits.acceleration  # fifty swings in 7.5 s
    points = []
    for time in np.linspace(0.0, 7.5, 376).tolist():
        there = ready('panda') + bend * (1.0 - math.cos(rate * time)) / rate**2
        speed, gain = bend * math.sin(rate * time) / rate, bend * math.cos(rate * time)
        points.append(GoalPoint(time, tuple(there), tuple(speed), tuple(gain)))
    reason = refusal(free(model), TrajectoryGoal(model.joints, points))
    assert 'its limit of jerk is' in reason
    assert ('(assumed, as the limits file has no max_jerk)' in reason) is is_assumed


def swinging(size: float, frequency: float) -> TrajectoryGoal:
    """Return 4 s of a sine of the Panda's first joint, a point every 0.01 s, faded in and out."""
    points = []
    for time in np.arange(0.01, 4.0, 0.01).tolist():
        fade = math.sin(0.5 * math.pi * min(1.0, time, 4.0 - time)) ** 2
        positions = ready('panda').copy()
        positions[0] += size * fade * math.sin(2 * math.pi * frequency * time)
        points.append(GoalPoint(time, tuple(positions)))
    return TrajectoryGoal(robot('panda').joints, points)


@pytest.mark.parametrize(('size', 'frequency'), [(0.14, 2.4), (0.1, 2.0)])
def test_too_much_acceleration_is_refused(size: float, frequency: float) -> None:
    """A swing far beyond the acceleration limit is refused with joint, amount and limit."""
    reason = refusal(free('panda'), swinging(size, frequency))
    assert re.search(r'panda_joint1 would need .* times the time', reason)
    assert 'its limit of acceleration is 3.750' in reason


def test_a_swing_within_the_limits_is_followed_exactly() -> None:
    """Dense points without speeds are followed as the smooth curve that they are samples of."""
    core, goal = free('panda'), swinging(0.05, 1.0)
    states, off = follow(core, core_commands.follow(core, goal))
    assert off < EXACT
    asked = {round(point.time / STREAM_PERIOD): point.positions[0] for point in goal.points[:-1]}
    late = round((len(states) * STREAM_PERIOD - goal.points[-1].time) / STREAM_PERIOD)
    found = min(
        max(abs(states[number + shift].position[0] - at) for number, at in asked.items())
        for shift in range(late + 1)
    )
    assert found < 2e-3
    kept(robot('panda').limits, states)


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 10**6), time=st.floats(0.02, 0.5), count=st.integers(1, 4))
@example(seed=573804, time=0.5, count=2)
@example(seed=14016, time=0.5, count=3)
def test_the_factor_of_a_refusal_suffices(name: str, seed: int, time: float, count: int) -> None:
    """What was refused for its time is accepted with as much more of it as the words say."""
    rng, limits = np.random.default_rng(seed), robot(name).limits
    rows = ready(name) + rng.uniform(-1.0, 1.0, (count, len(limits)))
    rows = np.clip(rows, limits.lower, limits.upper)

    points = [GoalPoint(time * (number + 1), tuple(row)) for number, row in enumerate(rows)]
    goal, core = TrajectoryGoal(limits.names, points), free(name)
    reason = refusal(core, goal)
    assume(reason)
    found = re.search(r'give the trajectory (\S+) times the time', reason)
    assert found is not None, reason
    _, off = follow(core, core_commands.follow(core, slowed(goal, float(found[1]))))
    assert off < EXACT


def test_a_bulge_beyond_a_limit_is_refused() -> None:
    """Points within the limits whose speeds lead beyond one between them are refused."""
    limits, core, begin = robot('panda').limits, free('panda'), ready('panda').copy()
    begin[0] = limits.upper[0] - 0.15
    core.reset(begin)
    turn, speeds = begin.copy(), np.zeros(7)
    turn[0], speeds[0] = limits.upper[0] - 0.02, 1.0
    points = [GoalPoint(0.5, tuple(turn), tuple(speeds)), GoalPoint(2.0, tuple(begin), (0.0,) * 7)]
    reason = refusal(core, TrajectoryGoal(limits.names, points))
    assert re.search(r'panda_joint1 would be at 3\.0\d+ at 0\.\d+ s, beyond', reason)


def test_set_points_that_leave_the_path_end_the_trajectory() -> None:
    """Whatever takes the set-points off the path that they had met, it does not go on."""
    core, begin = free('prbt'), ready('prbt')
    limits, state = robot('prbt').limits, RobotState.at_rest(begin)
    execution = Execution(
        goal_to(core, begin + 0.3),
        limits=limits,
        generator=OnlineTrajectoryGenerator(limits),
        state=state,
        speed_scaling=1.0,
        settings=ExecutionSettings(),
    )
    for step in range(300):
        held = state if step < 150 else RobotState.at_rest(state.position)
        arm = ArmState(held, held, 0.0, 1.0, is_paused=False, is_held=False)
        after = execution.update(arm, STREAM_PERIOD)
        state = after if step < 150 and after is not None else held
    assert ending(execution).code is GoalCode.PATH_TOLERANCE_VIOLATED
    assert re.search(r'prbt_joint_\d: the set-point is \+0\.02', ending(execution).reason)


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    time=st.floats(0.1, 1.0),
    count=st.integers(1, 4),
    begun=st.sampled_from([0.0, 0.0, 0.07]),
)
def test_what_is_late_counts_from_the_last_time_from_start(
    name: str, seed: int, time: float, count: int, begun: float
) -> None:
    """As a client's monitor counts: at most 1.1 times that and 0.5 s, and the words say it."""
    rng, limits, core = np.random.default_rng(seed), robot(name).limits, free(name)
    rows = ready(name) + rng.uniform(-0.4, 0.4, (count, len(limits)))
    rows = np.clip(rows, limits.lower, limits.upper)
    times = [begun + time * (number + 1) for number in range(count)]
    points = [GoalPoint(at, tuple(row)) for at, row in zip(times, rows, strict=True)]
    asked = times[-1] - begun
    assume(not refusal(core, TrajectoryGoal(limits.names, points, age=begun)))
    execution = core.execution
    assert execution is not None
    assert execution.path.duration <= 1.1 * asked + 0.5 + 1e-9
    _, off = follow(core, execution)
    assert off < EXACT
    assert ending(execution).code is GoalCode.SUCCESSFUL
    late = r'reached, (\S+) s later than requested, for the (jerk|acceleration|velocity) of \w+'
    found = re.search(late, ending(execution).reason)
    reported = float(found[1]) if found else 0.0
    assert reported == pytest.approx(execution.path.duration - asked, abs=0.011)
