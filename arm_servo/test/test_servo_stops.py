# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""However a jog ends, no set-point of its stop brings links together."""

from __future__ import annotations

from collections.abc import Callable
import contextlib

import core_commands
from model_robots import ready, robot, ROBOTS
import numpy as np
import pytest

from arm_servo import MotionCore
from arm_trajectory import GoalError, GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

PERIOD = 0.01
CLEAR = 0.0045  # clearance of a stop in [m], and a little for sliding along


def ask_back(core: MotionCore) -> None:
    """Ask for a target where the arm is, which it has to come back to."""
    core_commands.move_by(core, dict.fromkeys(core.model.joints, 0.0))


def follow_back(core: MotionCore) -> None:
    """Ask for a trajectory to the pose where it began."""
    back = ready(core.model.name).tolist()
    core_commands.follow(core, TrajectoryGoal(core.model.joints, [GoalPoint(6.0, back)]))


def follow_later(core: MotionCore) -> None:
    """Ask for the same, to begin when the arm rests."""
    back = ready(core.model.name).tolist()
    core_commands.follow(core, TrajectoryGoal(core.model.joints, [GoalPoint(6.0, back)], age=-1.5))


ENDS: dict[str, Callable[[MotionCore], None]] = {
    'stop': core_commands.stop,
    'pause': core_commands.pause,
    'time-out': lambda _core: None,
    'target': ask_back,
    'trajectory': follow_back,
    'stamped trajectory': follow_later,
}


def jog_into_contact(name: str, rng: np.random.Generator, cycles: int) -> MotionCore:
    """Return a core that jogs joints at random speeds for some cycles, or until links are near."""
    model = robot(name)
    core = MotionCore(model)
    core.reset(ready(name))
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
    for seed in range(8):
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
    core = MotionCore(robot('gp110'))
    core.reset(ready('gp110'))
    speeds = [-2.383, 0.79, -0.943, 1.404, 1.689, 1.695]
    jog = dict(zip(core.model.joints, speeds, strict=True))
    for cycle in range(250):
        if cycle < 143:
            core_commands.jog(core, jog, cycle * PERIOD)
        elif cycle == 143:
            core_commands.stop(core)
        state = core.step(cycle * PERIOD, PERIOD).state
        assert core.model.clearance(state.position) > 0.0
