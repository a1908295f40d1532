# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogs, trajectories, targets, stops and lost drives in any order: what leaves on the bus."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import example, given, settings
from hypothesis import strategies as st
from model_robots import robot, ROBOTS
import numpy as np
import pytest
from servo_commands import jog, move_by, twist
from servo_drives import Drives, PERIOD
from servo_streams import kept

from arm_model import ArmError
from arm_servo import JogRequest, PauseRequest, PoseCommand, SpeedRequest, StopRequest
from arm_servo.controllers.controller import MOTIONS
from arm_servo.core.requests import ImmediateRequest
from arm_trajectory import GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

NUDGES = st.lists(st.floats(-0.3, 0.3), min_size=7, max_size=7)
TWISTS = st.lists(st.floats(-0.3, 0.3), min_size=6, max_size=6)
STEPS = st.one_of(
    st.tuples(st.just('twist'), TWISTS),
    st.tuples(st.just('jog'), NUDGES),
    st.tuples(st.just('pose'), NUDGES),
    st.tuples(st.just('target'), NUDGES),
    st.tuples(st.just('trajectory'), NUDGES),
    st.tuples(st.just('wave'), NUDGES),
    st.tuples(
        st.sampled_from(['stop', 'pause', 'resume', 'slow', 'fast', 'lose', 'find']), NUDGES
    ),
)
PLANS = st.lists(st.tuples(STEPS, st.integers(1, 40)), min_size=2, max_size=8)


def wave(drives: Drives, numbers: list[float]) -> list[GoalPoint]:
    """Return so many points there and back that their preparation takes long."""
    here, sizes = np.array([axis.setpoint for axis in drives.axes]), np.array(numbers)
    shares = np.sin(np.arange(1, 61) / 19.0) ** 2
    return [
        GoalPoint(0.55 + 0.05 * number, (here + sizes * share).tolist())
        for number, share in enumerate(shares)
    ]


def perform(drives: Drives, kind: str, numbers: list[float]) -> None:
    """Command a step, or let a drive drop out or come back."""
    gateway = drives.gateway
    names = gateway.model.joints
    numbers = numbers if kind == 'twist' else numbers[: len(names)]
    immediate: dict[str, ImmediateRequest] = {
        'slow': SpeedRequest(0.3),
        'fast': SpeedRequest(1.0),
        'stop': StopRequest('stopped', MOTIONS),
        'pause': PauseRequest(),
        'resume': PauseRequest(is_paused=False),
    }
    if kind in immediate:
        gateway.command(immediate[kind])
    elif kind in {'lose', 'find'}:
        drives.axes[3] = replace(drives.axes[3], followable=kind == 'find')
    elif kind == 'twist':
        twist(gateway, numbers, drives.now, 0.2)
    elif kind == 'jog':
        jog(gateway, dict(zip(names, numbers, strict=True)), drives.now, 0.2)
    elif kind == 'pose':
        there = gateway.model.pose(np.array([axis.setpoint for axis in drives.axes]) + numbers)
        gateway.command(JogRequest(PoseCommand(there), drives.now + 0.3))
    elif kind == 'target':
        move_by(gateway, dict(zip(names, numbers, strict=True)))
    elif kind == 'trajectory':
        to = np.array([axis.setpoint for axis in drives.axes]) + numbers
        gateway.request(TrajectoryGoal(names, [GoalPoint(1.0, to.tolist())]))
    elif kind == 'wave':
        gateway.request(TrajectoryGoal(names, wave(drives, numbers)))


OUT_OF_A_JOG = [(('jog', [0.3] * 7), 15), (('wave', [0.2] * 7), 40), (('wave', [-0.2] * 7), 40)]
BRIEFLY_LOST = [(('trajectory', [0.3] * 7), 40), (('lose', []), 4), (('find', []), 20)]


@given(PLANS)
@example(BRIEFLY_LOST)
@example(OUT_OF_A_JOG)
@settings(max_examples=40)
def test_no_hand_over_makes_the_set_points_jump(
    plan: list[tuple[tuple[str, list[float]], int]],
) -> None:
    """Speed changes by no more than the acceleration limit, from any source to any other.

    A drive that drops out is left alone: its own set-points end there, wherever they are. When it
    comes back before the others rest, it waits for them.
    """
    drives = Drives()
    drives.attach()
    drives.run(2)
    begin = len(drives.path)
    losses = []
    for (kind, numbers), cycles in plan:
        if kind == 'lose':
            losses.append(len(drives.path) - begin)
        perform(drives, kind, numbers)
        drives.run(cycles)
    drives.run(300)
    path = np.array(drives.path)[begin - 1 :]
    rates = np.abs(np.diff(path, 2, axis=0)) / PERIOD**2
    for loss in losses:  # an ideal drive stands still at once when nobody commands it
        rates[max(loss - 1, 0) : loss + 1, 3] = 0.0
    limits = drives.gateway.model.limits.acceleration
    assert (rates.max(axis=0) <= 1.02 * limits + 1e-6).all()


@pytest.mark.parametrize('name', ROBOTS)
@given(PLANS)
@settings(max_examples=20, deadline=None)
def test_set_points_keep_every_limit(
    name: str, plan: list[tuple[tuple[str, list[float]], int]]
) -> None:
    """Velocity, acceleration and jerk of every arm, from any source to any other."""
    drives = Drives(name)
    drives.attach()
    drives.run(2)
    states = []
    for (kind, numbers), cycles in [*plan, (('stop', []), 300)]:
        if kind not in {'lose', 'find'}:
            perform(drives, kind, numbers)
        for _ in range(cycles):
            drives.run()
            point = drives.gateway.snapshot.set_point
            assert point is not None
            states.append(point.state)
    kept(robot(name).limits, states, PERIOD)
    assert not states[-1].moving


@given(TWISTS)
@settings(max_examples=10)
def test_a_refused_command_changes_nothing(numbers: list[float]) -> None:
    """Whatever moves the arm goes on when another command is refused."""
    drives = Drives()
    drives.attach()
    drives.run(2)
    twist(drives.gateway, [0.01, *numbers[1:]], drives.now, 5.0)
    drives.run(5)
    source = drives.gateway.snapshot.source
    there = [axis.setpoint + 9.0 for axis in drives.axes]
    goal = TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(1.0, there)])
    refused = [
        move_by(drives.gateway, {'panda_joint1': float('nan')}),
        move_by(drives.gateway, {'panda_joint1': 9.0}),
        drives.gateway.request(goal),
    ]
    drives.run(10)
    assert all(isinstance(command.future.exception(), ArmError) for command in refused)
    assert drives.gateway.snapshot.source is source
