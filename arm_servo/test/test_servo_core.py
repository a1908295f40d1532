# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion core: hand-overs without a jump, stops, refusals."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import math

import core_commands
from core_commands import (
    core_of,
    ending,
    goal_to,
    kept,
    stream,
    STREAM_PERIOD,
    twist_between,
    wave,
)
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from model_robots import chain, ready, robot, ROBOTS, two_arms
import numpy as np
import pytest

from arm_model import CommandError, ModelError, Pose
from arm_servo import JogRequest, MotionCore, NotReadyError, Phase, PoseCommand, SetPoint, Source
from arm_trajectory import GoalCode, GoalError, OnlineTrajectoryGenerator

PERIOD = 0.01
CLEAR = 0.0045  # clearance of a stop in [m], and a little for sliding along


def ask_back(core: MotionCore) -> None:
    """Ask for a target where the arm is, which it has to come back to."""
    core_commands.move_by(core, dict.fromkeys(core.model.joints, 0.0))


def follow_back(core: MotionCore, age: float = 0.0) -> None:
    """Ask for a trajectory to the pose where it began, from its stamp on."""
    core_commands.follow(core, goal_to(core, ready(core.model.name), 6.0, age))


ENDS: dict[str, Callable[[MotionCore], None]] = {
    'stop': core_commands.stop,
    'pause': core_commands.pause,
    'time-out': lambda _core: None,
    'target': ask_back,
    'trajectory': follow_back,
    'stamped trajectory': lambda core: follow_back(core, -1.5),  # when the arm rests
}


def jog_into_contact(name: str, rng: np.random.Generator, cycles: int) -> MotionCore:
    """Return a core that jogs joints at random speeds for some cycles, or until links are near."""
    core, model = core_of(name), robot(name)
    senses = rng.choice([-1.0, 1.0], len(model)) * rng.uniform(0.3, 1.0, len(model))
    speeds = dict(zip(model.joints, (senses * model.limits.velocity).tolist(), strict=True))
    for cycle in range(250):
        core_commands.jog(core, speeds, cycle * PERIOD)
        core.step(cycle * PERIOD, PERIOD)
        near = model.nearest(core.state.position, 0.2, 1)
        if near and near[0].gradient @ core.state.velocity < -0.1:
            cycles -= 1
        if cycles == 0:
            break
    return core


@pytest.mark.parametrize('end', ENDS)
@pytest.mark.parametrize('name', ROBOTS)
def test_no_end_of_a_jog_leads_into_contact(name: str, end: str) -> None:
    """At full speed towards contact: stop, pause, silence, a target and a trajectory."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        core = jog_into_contact(name, rng, int(rng.integers(1, 12)))
        least = 0.0 if 'trajectory' in end else min(CLEAR, core.model.clearance(ready(name)))
        begin = 10.0
        with contextlib.suppress(GoalError):  # refused, the jog goes on to its time-out
            ENDS[end](core)
        for cycle in range(200):
            state = core.step(begin + cycle * PERIOD, PERIOD).state
            assert core.model.clearance(state.position) > least
            if not state.moving:
                break


def test_a_long_stop_stays_clear_all_along() -> None:
    """At full speed all joints go far until they rest; nothing in between is overlooked."""
    core = core_of('gp110')
    speeds = [-2.383, 0.79, -0.943, 1.404, 1.689, 1.695]
    jog = dict(zip(core.model.joints, speeds, strict=True))
    for cycle in range(250):
        if cycle < 143:
            core_commands.jog(core, jog, cycle * PERIOD)
        elif cycle == 143:
            core_commands.stop(core)
        state = core.step(cycle * PERIOD, PERIOD).state
        assert core.model.clearance(state.position) > 0.0


pytestmark = pytest.mark.slow


@pytest.mark.parametrize('name', ROBOTS)
def test_a_released_key_is_a_smooth_stop(name: str) -> None:
    """A jog counts for its time-out; then the arm comes to rest, and lets go of the jog.

    The joints stop in step: the tool stays within 1 mm of its line.
    """
    core, model = core_of(name), robot(name)
    core_commands.twist(core, [0.15, 0, 0, 0, 0, 0], 0.0, duration=0.6)
    states = [point.state for point in stream(core, 2.0)]
    speeds = [float(np.linalg.norm(state.velocity)) for state in states]
    assert speeds[round(0.59 / STREAM_PERIOD)] > 0.9 * max(speeds)
    assert speeds[round(0.7 / STREAM_PERIOD)] < 0.9 * max(speeds)
    assert not states[-1].moving
    assert core.source is Source.NONE
    kept(model.limits, states)
    home = model.pose(ready(name)).position
    away = np.array([model.pose(state.position).position - home for state in states])
    assert np.linalg.norm(away[:, 1:], axis=1).max() < 1e-3


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_held_axes_stay_from_any_pose(name: str, seed: int) -> None:
    """A jog along one axis, its stop included, leaves the others within 1 % of the reach."""
    model, rng = robot(name), np.random.default_rng(seed)
    limits, period = model.limits, 0.01
    start = rng.uniform(np.maximum(limits.lower, -math.pi), np.minimum(limits.upper, math.pi))
    assume(model.clearance(start) > 0.01)
    core, axis = MotionCore(model), int(rng.integers(6))
    core.reset(start)
    asked = np.eye(6)[axis] * ([0.1] * 3 + [0.3] * 3)
    core_commands.twist(core, asked, 0.0, duration=1.0)
    for cycle in range(140):
        at = core.step(cycle * period, period).state.position
        aside = twist_between(model, start, at) * ([1.0] * 3 + [model.reach / 3] * 3)
        aside[axis] = 0.0
        assert np.abs(aside).max() < 0.01 * model.reach


def test_without_an_answer_of_the_generator_the_arm_brakes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where ruckig has no answer the joints slow down with their greatest deceleration."""
    core = core_of('prbt')
    core_commands.jog(core, {'prbt_joint_1': 0.8, 'prbt_joint_4': -0.5}, 0.0, duration=1.0)
    stream(core, 0.6)
    monkeypatch.setattr(OnlineTrajectoryGenerator, '_plan', lambda *_: None)
    before = core.state
    states = [point.state for point in stream(core, 0.4)]
    assert not states[-1].moving
    speeds = np.abs([before.velocity, *(state.velocity for state in states)])
    fall = np.diff(speeds, axis=0)
    assert np.all(fall <= 1e-12)
    assert np.all(-fall <= robot('prbt').limits.acceleration * STREAM_PERIOD * 1.001)


def test_what_takes_the_arm_ends_the_trajectory_with_words() -> None:
    """A jog, with whom it lost the arm; a reset, after which the arm rests at the new place."""
    core = core_of('prbt')
    for reason in ('jogging took over', 'the drives were off'):
        execution = core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q'))
        stream(core, 0.4)
        if 'jogging' in reason:
            core_commands.jog(core, {'prbt_joint_1': 0.2}, 0.4)
        else:
            core.reset(ready('prbt') + 0.1, reason)
        assert execution.phase is Phase.DONE
        assert reason in ending(execution).reason
        assert ending(execution).code is GoalCode.INVALID_GOAL
    assert stream(core, 0.1)[-1].state.position == pytest.approx(ready('prbt') + 0.1)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_single_target_is_reached_at_rest(name: str) -> None:
    """A target is reached exactly, then the arm is free."""
    core, expected = core_of(name), np.array(ready(name))
    expected[1] += 0.3
    core_commands.move_to(core, {robot(name).joints[1]: float(expected[1])})
    points = stream(core, 3.0)
    assert points[-1].state.position == pytest.approx(expected, abs=1e-9)
    assert core.source is Source.NONE
    kept(robot(name).limits, [point.state for point in points])


@pytest.mark.parametrize(
    ('override', 'own', 'expected'),
    [(0.2, math.inf, 0.314), (1.0, 0.25, 0.25), (0.5, 0.25, 0.125)],
)
def test_displacements_add_up_at_their_speed(override: float, own: float, expected: float) -> None:
    """At once or one by one; as fast as was asked times the override, and no faster."""
    core = core_of('prbt')
    core_commands.override(core, override)
    for _ in range(5):
        core_commands.move_by(core, {'prbt_joint_1': 0.05}, own)
    points = stream(core, 0.5)
    for _ in range(5):
        core_commands.move_by(core, {'prbt_joint_1': 0.05}, own)
        points += stream(core, 0.02)
    core_commands.move_by(core, {'prbt_joint_2': 0.02}, own)
    points += stream(core, 6.0)
    fastest = max(float(np.abs(point.state.velocity).max()) for point in points)
    assert fastest == pytest.approx(expected, rel=1e-3)
    assert points[-1].state.position[:2] - ready('prbt')[:2] == pytest.approx([0.5, 0.02])


def test_a_pause_holds_everything() -> None:
    """Paused, a target waits and other commands are refused; then both go on."""
    core = core_of('prbt')
    core_commands.move_to(core, {'prbt_joint_1': 1.0})
    stream(core, 0.3)
    core_commands.pause(core)
    assert not stream(core, 1.0)[-1].state.moving
    with pytest.raises(CommandError, match='resume first'):
        core_commands.jog(core, {'prbt_joint_1': 0.1}, 1.3)
    with pytest.raises(CommandError, match='resume first'):
        core_commands.move_by(core, {'prbt_joint_1': 0.1})
    core_commands.resume(core)
    assert stream(core, 3.0)[-1].state.position[0] == pytest.approx(1.0)
    core_commands.override(core, 0.0)
    with pytest.raises(CommandError, match='override is 0'):
        core_commands.move_by(core, {'prbt_joint_1': 0.5})


def test_nothing_is_commanded_before_the_position_is_known() -> None:
    """Without a position every command is refused."""
    core = MotionCore(robot('prbt'))
    refused: list[Callable[[], object]] = [
        lambda: core_commands.twist(core, [0.0] * 6, 0.0),
        lambda: core_commands.jog(core, {'prbt_joint_1': 0.1}, 0.0),
        lambda: core_commands.follow(core, wave(robot('prbt'), ready('prbt'), 'q')),
        lambda: core_commands.move_to(core, {'prbt_joint_1': 0.1}),
        lambda: core.step(0.0, STREAM_PERIOD),
    ]
    for command in refused:
        with pytest.raises(NotReadyError, match='joint states'):
            command()


JOINT, INF, NAN = 'prbt_joint_1', math.inf, math.nan
TWIST = [0.1] * 6
ONES = Pose(np.ones((3, 3)), np.zeros(3))
send = core_commands

BAD: dict[str, tuple[Callable[[MotionCore], object], str]] = {
    'nan twist': (lambda c: send.twist(c, [NAN] * 6, 0.0), 'number 0 is nan'),
    'short twist': (lambda c: send.twist(c, [0.1] * 5, 0.0), '5 numbers, 6 are needed'),
    'unknown link': (lambda c: send.twist(c, TWIST, 0.0, link='hand'), "'hand'"),
    'unknown joint': (lambda c: send.jog(c, {'elbow': 0.1}, 0.0), "'elbow'"),
    'infinite jog': (lambda c: send.jog(c, {JOINT: INF}, 0.0), 'inf'),
    'no joint': (lambda c: send.jog(c, {}, 0.0), 'no joint'),
    'no rotation': (lambda c: c.command(JogRequest(PoseCommand(ONES), 0.1)), 'not a rotation'),
    'reflected': (lambda c: send.twist(c, TWIST, 0.0, axes=-np.eye(3)), 'axes: not a rotation'),
    'nan duration': (lambda c: send.twist(c, TWIST, 0.0, duration=NAN), 'must be finite'),
    'endless': (lambda c: send.jog(c, {JOINT: 0.1}, 0.0, INF), 'must be finite'),
    'target beyond': (lambda c: send.move_to(c, {'prbt_joint_3': 3.0}), 'beyond its limits'),
    'target nan': (lambda c: send.move_to(c, {'prbt_joint_3': NAN}), 'nan'),
    'step beyond': (lambda c: send.move_by(c, {JOINT: 9.0}), 'beyond its limits'),
    'no speed of a step': (lambda c: send.move_by(c, {JOINT: 0.5}, 0.0), 'above 0'),
    'speed': (lambda c: send.override(c, 1.2), 'between 0 and 1'),
    'speed nan': (lambda c: send.override(c, NAN), 'between 0 and 1'),
    'reset': (lambda c: c.reset([0.0] * 5), '5 numbers, 6 are needed'),
}


@pytest.mark.parametrize(('command', 'words'), BAD.values(), ids=BAD.keys())
def test_bad_commands_are_refused_before_anything_moves(
    command: Callable[[MotionCore], object], words: str
) -> None:
    """A command that makes no sense is refused with a reason, and the arm stays at rest."""
    core = core_of('prbt')
    with pytest.raises(CommandError, match=words):
        command(core)
    points: list[SetPoint] = stream(core, 0.1)
    assert not any(point.state.moving for point in points)


def test_what_is_no_chain_is_refused() -> None:
    """A group of two arms is a model, and no arm to jog; each of them is one."""
    MotionCore(two_arms('left'))
    with pytest.raises(ModelError, match=r'group both: .* not one chain'):
        MotionCore(two_arms())
    with pytest.raises(ModelError, match='9 joints, 8 at most'):
        MotionCore(chain('zyyzyyzyy'))


@pytest.mark.parametrize('period', [0.001, 0.002, 0.004])
def test_a_jog_of_short_cycles_is_as_straight_as_one_of_long_cycles(period: float) -> None:
    """Joint speeds count for several cycles; held axes stay, a new command counts at once."""
    core, model = core_of('panda'), robot('panda')
    begin = model.pose(core.state.position)
    states = []
    for cycle in range(round(1.0 / period)):
        now = cycle * period
        if cycle % round(0.02 / period) == 0:
            core_commands.twist(core, [0.0, 0.1, 0.0, 0.0, 0.0, 0.0], now)
        states.append(core.step(now, period).state)
    there = model.pose(core.state.position)
    assert there.position[1] - begin.position[1] == pytest.approx(0.1, abs=0.02)
    assert there.position[[0, 2]] == pytest.approx(begin.position[[0, 2]], abs=3e-4)
    assert there.rotation == pytest.approx(begin.rotation, abs=1e-3)
    changes = np.abs(np.diff([state.velocity for state in states], axis=0)).max(axis=0) / period
    assert (changes <= 1.01 * model.limits.acceleration).all()
    core_commands.twist(core, [0.0, -0.1, 0.0, 0.0, 0.0, 0.0], 1.0)
    assert np.abs(core.step(1.0, period).state.acceleration).max() > 0.0
