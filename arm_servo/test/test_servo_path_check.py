# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions on whose way links meet are refused before anything moves."""

from __future__ import annotations

from functools import cache
import math

import core_commands
from model_robots import ready, robot, ROBOTS
import numpy as np
import pytest

from arm_model import Array, CommandError
from arm_servo import CoreSettings, DisplacementRequest, MotionCore, Phase, Source
from arm_trajectory import GoalCode, GoalError, GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

PERIOD = 0.01


def core_at(name: str, positions: Array, check: bool = True) -> MotionCore:
    """Return a core whose arm rests somewhere."""
    core = MotionCore(robot(name), CoreSettings(check_self_collision=check))
    core.reset(positions)
    return core


def goal_to(core: MotionCore, positions: Array, duration: float = 8.0) -> TrajectoryGoal:
    """Return a trajectory of one point."""
    return TrajectoryGoal(core.model.joints, [GoalPoint(duration, positions.tolist())])


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
        core_commands.follow(core, goal_to(core, end))
    assert caught.value.code is GoalCode.INVALID_GOAL
    assert core.source is Source.NONE
    core.step(0.0, PERIOD)
    assert core.state.position.tolist() == begin.tolist()
    allowed = core_at(name, begin, check=False)
    path = core_commands.follow(allowed, goal_to(allowed, end)).path
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
    execution = core_commands.follow(core, goal_to(core, begin))
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
    core = core_at('prbt', ready('prbt'))
    for come_between in (core_commands.stop, core_commands.pause, _move_a_little):
        basis = core.basis
        motion = core.plan(DisplacementRequest({'prbt_joint_1': 0.1}), basis)
        assert motion is not None
        come_between(core)
        with pytest.raises(CommandError, match='before this command had begun'):
            core.begin(motion, basis)
        core_commands.stop(core)
        core_commands.resume(core)
        assert core.source is Source.NONE


def _move_a_little(core: MotionCore) -> None:
    core_commands.move_by(core, {'prbt_joint_2': 0.01})
