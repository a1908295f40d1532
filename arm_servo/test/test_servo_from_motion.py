# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How motions begin: from an arm in motion as from rest, and not where links meet on the way.

The way that catches up with a trajectory is not the path that was checked: it stays clear too.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
import math

import core_commands
from core_commands import core_of, ending, follow_to_the_end, goal_to, kept, stream
from hypothesis import example, given, settings
from hypothesis import strategies as st
from model_robots import ready, robot, ROBOTS
import numpy as np
import pytest

from arm_model import Array, CommandError, RobotModel, RobotState
from arm_servo import CoreSettings, DisplacementRequest, MotionCore, Phase, Source
from arm_trajectory import GoalCode, GoalError, GoalPoint, StateMovedError, TrajectoryGoal

PERIOD = 0.01


def core_at(name: str, positions: Array, check: bool = True) -> MotionCore:
    """Return a core whose arm rests somewhere."""
    return core_of(name, CoreSettings(check_self_collision=check), positions)


def by_name(core: MotionCore, positions: Array) -> dict[str, float]:
    """Return positions by joint."""
    return dict(zip(core.model.joints, positions.tolist(), strict=True))


SEEDS = {'panda': 43, 'prbt': 1390, 'gp110': 34}
"""Of the random numbers with which :func:`find_blocked` finds at once what is seldom."""


@cache
def find_blocked(name: str) -> tuple[Array, Array]:
    """Return two free places of an arm whose straight connection is not free."""
    model, rng = robot(name), np.random.default_rng(SEEDS[name])
    lower = np.maximum(model.limits.lower, -3.0)
    upper = np.minimum(model.limits.upper, 3.0)
    for _ in range(5000):
        begin, end = rng.uniform(lower, upper, (2, len(model)))
        if min(model.clearance(begin), model.clearance(end)) < 0.002:
            continue
        shares = np.linspace(0.1, 0.9, 20)
        if min(model.clearance(begin + share * (end - begin)) for share in shares) < -0.01:
            return begin, end
    raise AssertionError(f'{name} is never in its own way')


@pytest.mark.parametrize('name', ROBOTS)
def test_a_trajectory_through_contact_is_refused_with_pair_and_time(name: str) -> None:
    """Links and time are those of the first contact; the arm stays where it is."""
    begin, end = find_blocked(name)
    core = core_at(name, begin)
    with pytest.raises(GoalError, match=r'would collide at \d+\.\d\d s') as caught:
        core_commands.follow(core, goal_to(core, end, 8.0))
    assert caught.value.code is GoalCode.INVALID_GOAL
    assert core.source is Source.NONE
    allowed = core_at(name, begin, check=False)
    path = core_commands.follow(allowed, goal_to(allowed, end, 8.0)).path
    time = float(str(caught.value).split(' would collide at ')[1].split(' s ')[0])
    times = np.arange(0.0, path.duration, 0.01)
    places = path.positions(times)
    first = next(n for n, place in enumerate(places) if core.model.clearance(place) < 0.0)
    assert time == pytest.approx(times[first], abs=0.05)
    links = core.model.nearest(places[first], math.inf, 1)[0].links
    assert all(link in str(caught.value) for link in links)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_single_target_through_contact_is_refused(name: str) -> None:
    """As a place and as a displacement; what moved the arm goes on; it can be switched off."""
    begin, end = find_blocked(name)
    core = core_at(name, begin)
    with pytest.raises(CommandError, match='would collide after'):
        core_commands.move_to(core, by_name(core, end))
    with pytest.raises(CommandError, match='would collide after'):
        core_commands.move_by(core, by_name(core, end - begin))
    execution = core_commands.follow(core, goal_to(core, begin, 8.0))
    with pytest.raises(CommandError, match='would collide after'):
        core_commands.move_to(core, by_name(core, end))
    assert core.source is Source.TRAJECTORY
    assert execution.phase is Phase.FOLLOWING
    allowed = core_at(name, begin, check=False)
    core_commands.move_to(allowed, by_name(allowed, end))
    assert allowed.source is Source.TARGET


@pytest.mark.parametrize('name', ROBOTS)
def test_an_arm_in_contact_may_part_and_not_go_deeper(name: str) -> None:
    """The way back is open to trajectories too."""
    begin, end = find_blocked(name)
    shares = np.linspace(0.0, 1.0, 400)
    model = robot(name)
    distances = np.array([model.clearance(begin + share * (end - begin)) for share in shares])
    shallow = begin + shares[int(np.argmax(distances < -0.002))] * (end - begin)
    inside = begin + shares[int(np.argmin(distances))] * (end - begin)
    core = core_at(name, shallow)
    execution = core_commands.follow(core, goal_to(core, begin, 8.0))
    for cycle in range(2000):
        core.step(cycle * PERIOD, PERIOD)
        if execution.phase is Phase.DONE:
            break
    assert core.state.position == pytest.approx(begin, abs=1e-5)
    core.reset(shallow)
    with pytest.raises(GoalError, match='would collide'):
        core_commands.follow(core, goal_to(core, inside, 8.0))


def test_a_plan_is_void_when_another_command_came() -> None:
    """What was checked does not begin behind a stop, nor behind another motion."""
    core = core_of('prbt')

    def another(core: MotionCore) -> None:
        core_commands.move_by(core, {'prbt_joint_2': 0.01})

    for come_between in (core_commands.stop, core_commands.pause, another):
        basis = core.basis
        motion = core.plan(DisplacementRequest({'prbt_joint_1': 0.1}), basis)
        assert motion is not None
        come_between(core)
        with pytest.raises(CommandError, match='before this command had begun'):
            core.begin(motion, basis)
        core_commands.stop(core)
        core_commands.resume(core)
        assert core.source is Source.NONE


pytestmark = pytest.mark.slow


def jogged(
    name: str, rng: np.random.Generator, by: str, duration: float
) -> tuple[MotionCore, list[RobotState]]:
    """Return a core whose arm was jogged for a time [s] at up to its limits, and its states."""
    core = core_at(name, ready(name), check=False)
    limits = core.model.limits
    if by == 'twist':
        twist = np.concatenate((rng.uniform(-0.6, 0.6, 3), rng.uniform(-1.0, 1.0, 3)))
        core_commands.twist(core, twist, 0.0, duration=9.0)
    else:
        speeds = rng.choice((-0.99, 0.0, 0.99), len(limits)) * limits.velocity
        core_commands.jog(
            core, dict(zip(limits.names, speeds.tolist(), strict=True)), 0.0, duration=9.0
        )
    return core, [core.state, *(point.state for point in stream(core, duration))]


KINDS = {'one point': 2.0, 'with time to spare': 4.0, 'there and back': 1.5, 'planned': 2.5}
"""Trajectories as clients write them, with the time to a place near the arm in [s]."""


def goal(core: MotionCore, rng: np.random.Generator, kind: str) -> TrajectoryGoal:
    """Return a trajectory from where the arm is."""
    limits, here, time = core.model.limits, core.state.position, KINDS[kind]
    there = np.clip(here + rng.uniform(-0.3, 0.3, len(limits)), limits.lower, limits.upper)
    still = (0.0,) * len(limits) if kind == 'planned' else ()
    points = [GoalPoint(time, tuple(there), still)]
    if kind == 'planned':
        points.insert(0, GoalPoint(0.0, tuple(here), still))
    elif kind == 'there and back':
        points.append(GoalPoint(2.0 * time, tuple(here)))
    return TrajectoryGoal(limits.names, points)


def refused_time_suffices(core: MotionCore) -> None:
    """Make sure that a hasty way back is accepted with as much more time as its refusal says.

    It is refused wherever a joint moves at more than half its greatest speed.
    """
    here, moving = core.state.position, np.abs(core.state.velocity) / core.model.limits.velocity
    try:
        core.plan(goal_to(core, here, 0.02), core.basis)
    except GoalError as error:
        factor = float(str(error).split('give the trajectory ')[1].split(' times')[0])
        core.plan(goal_to(core, here, 0.02 * factor), core.basis)
    else:
        assert moving.max() < 0.5


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('by', ['twist', 'joints'])
@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 10**6), duration=st.floats(0.02, 0.8))
@example(seed=0, duration=0.8)  # each arm moves at more than half speed, by a twist or by joints
def test_a_trajectory_right_after_a_jog_is_followed(
    name: str, by: str, kind: str, seed: int, duration: float
) -> None:
    """At any speed of the jog, and while it speeds up; what is too hasty says by how much."""
    rng = np.random.default_rng(seed)
    core, states = jogged(name, rng, by, duration)
    refused_time_suffices(core)
    wanted = goal(core, rng, kind)
    execution = core_commands.follow(core, wanted)
    states += follow_to_the_end(core, execution)[1:]
    assert ending(execution).code is GoalCode.SUCCESSFUL, ending(execution)
    assert states[-1].position == pytest.approx(wanted.points[-1].positions, abs=1e-6)
    kept(core.model.limits, states)


GANTRY = """<robot name="gantry">
<link name="base"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="bridge"/>
<link name="tool"><collision><origin xyz="0 0 -0.3"/><geometry><sphere radius="0.05"/></geometry>
</collision></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="bridge"/><axis xyz="1 0 0"/>
<limit lower="-2" upper="2" velocity="2" effort="1"/></joint>
<joint name="y" type="prismatic"><parent link="bridge"/><child link="tool"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.3"/><limit lower="-2" upper="2" velocity="2" effort="1"/></joint>
</robot>"""
"""A tool of 0.05 m that moves in a plane around a ball of 0.1 m in its middle."""

GROUP = (
    '<robot name="gantry"><group name="arm"><chain base_link="base" tip_link="tool"/></group>'
    '<disable_collisions link1="base" link2="bridge" reason="Adjacent"/></robot>'
)

LIMITS = {name: {'max_velocity': 2.0, 'max_acceleration': 5.0, 'max_jerk': 50.0} for name in 'xy'}


def jogged_past_the_ball(speed: float) -> MotionCore:
    """Return a gantry that jogs along y at a speed [m/s], and is beside the ball now."""
    core = core_of(RobotModel(GANTRY, GROUP, LIMITS), at=[-0.3, -0.17 - np.sign(speed) * 0.6])
    for cycle in range(400):
        core_commands.jog(core, {'y': speed}, cycle * PERIOD)
        core.step(cycle * PERIOD, PERIOD)
        if abs(core.state.position[1] + 0.17) < 0.02 + 0.005 * abs(speed):
            return core
    raise AssertionError('it does not get there')


@pytest.mark.parametrize(
    ('jog', 'aside', 'speed'),
    [(-1.9, 0.009, 1.0), (-1.9, 0.009, 1.5), (1.9, -0.009, 0.5), (1.9, 0.009, 0.5)],
)
def test_catching_up_makes_no_contact(jog: float, aside: float, speed: float) -> None:
    """A path leads around the ball; an arm in motion that catches up would cut its corner."""
    core = jogged_past_the_ball(jog)
    x, beside = core.state.position[0], core.state.position[1] + aside
    y = min(beside, -0.16)  # the path itself must be clear
    corner = (0.17 - x) / speed
    points = [
        GoalPoint(0.0, [x, y]),
        GoalPoint(corner, [0.17, y]),
        GoalPoint(corner + (0.3 - y) / speed, [0.17, 0.3]),
    ]
    # the plan is for an arm at rest there: the way from the motion is not in it
    basis = replace(core.basis, state=RobotState.at_rest(np.array([x, y])))
    motion = core.plan(TrajectoryGoal(core.model.joints, points), basis)
    assert motion is not None
    core.begin(motion, basis)
    execution = core.execution
    assert execution is not None
    for cycle in range(400, 700):
        state = core.step(cycle * PERIOD, PERIOD).state
        assert core.model.clearance(state.position) > 0.0
        if not state.moving:
            break
    assert ending(execution).code is GoalCode.PATH_TOLERANCE_VIOLATED
    assert 'base - tool' in ending(execution).reason
    assert core.source is Source.NONE


def test_a_trajectory_is_void_where_the_arm_is_elsewhere() -> None:
    """Prepared from a place 0.02 rad away it is refused: its path was checked from there only."""
    core = core_of('panda')
    goal = goal_to(core, ready('panda') + 0.2)
    basis = core.basis.foreseen(0.0)
    aside = replace(basis, state=RobotState.at_rest(basis.state.position + 0.02))
    motion = core.plan(goal, aside)
    assert motion is not None
    with pytest.raises(StateMovedError) as refused:
        core.begin(motion, aside)
    assert refused.value.code is GoalCode.INVALID_GOAL
    assert core.source is Source.NONE
