# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A gait asks the servos for what they can: the height of a swing, and the speed of joints."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_controller import Gait, GaitGenerator, GaitParameters, Velocity
from quad_controller.gait.body import UPRIGHT
from quad_controller.gait.schedule import SCHEDULES
from quad_controller.gait.stepping import SwingLift
from quad_gait_rig import ROBOT

PERIOD = 0.02  # [s]
HEIGHT = 0.02  # [m]
NEUTRAL = ROBOT.footprint(0.085, [0.0] * 12)
LIFTS = {gait: SwingLift(ROBOT, NEUTRAL, SCHEDULES[gait], HEIGHT) for gait in Gait}
speeds = st.floats(-1.0, 1.0)


def fastest_joint(gait: Gait, velocity: Velocity) -> float:
    """Largest speed of a joint's target in a gait that goes on, as a share of its limit."""
    generator = GaitGenerator(ROBOT, GaitParameters())
    generator.choose(gait)
    rows = [generator.step(velocity, UPRIGHT, None, PERIOD).targets for _ in range(300)]
    return max(
        abs(after - before) / (limits.velocity * PERIOD)
        for one, other in itertools.pairwise(rows[100:])
        for before, after, limits in zip(one, other, ROBOT.limits, strict=True)
    )


@pytest.mark.parametrize(
    ('gait', 'velocity'),
    [
        (Gait.TROT, Velocity(0.2)),
        (Gait.TROT, Velocity(-0.2)),
        (Gait.TROT, Velocity(0.0, 0.15)),
        (Gait.TROT, Velocity(0.0, 0.0, 1.5)),
        (Gait.TROT, Velocity(0.15, 0.0, 0.6)),
        (Gait.CRAWL, Velocity(0.06)),
        (Gait.PACE, Velocity(0.13)),
    ],
)
def test_no_joint_is_asked_for_more_than_its_speed(gait: Gait, velocity: Velocity) -> None:
    """In every direction, at what the README names."""
    assert fastest_joint(gait, velocity) <= 1.0


def test_the_fastest_trot_asks_for_little_more() -> None:
    """A lower foot would scuff; what is asked too much is cut by the controller, and counted."""
    assert fastest_joint(Gait.TROT, Velocity(0.3)) < 1.15


@given(st.sampled_from(Gait), speeds, speeds)
def test_a_foot_is_lifted_less_the_faster_it_is_and_never_dragged(
    gait: Gait, x: float, y: float
) -> None:
    """Whatever its direction, and beyond what the gait does."""
    lift = LIFTS[gait]
    slow, fast = lift.height(0.5 * x, 0.5 * y), lift.height(x, y)
    assert 0.35 * HEIGHT < fast <= slow + 1e-12 <= HEIGHT + 2e-12
    assert lift.height(-x, -y) == fast


def test_a_slow_robot_lifts_its_feet_as_high_as_commanded() -> None:
    """Where the joints have speed to spare."""
    assert LIFTS[Gait.CRAWL].height(0.06, 0.0) == HEIGHT
    assert LIFTS[Gait.TROT].height(0.1, 0.0) == HEIGHT
