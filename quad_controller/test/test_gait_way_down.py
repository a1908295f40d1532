# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From every fault there is a way down, which needs only what still works."""

from __future__ import annotations

from dataclasses import replace
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from quad_controller import State, StateParameters, Velocity
from quad_description import ImuSample, Targets
from quad_gait_rig import (
    PERIOD,
    policy_rig,
    Rig,
    ROBOT,
    STAND,
    standing,
    StillPolicy,
    tilted,
    UPRIGHT,
)

pytestmark = pytest.mark.slow

LYING = ROBOT.legs[0].hip[2] - StateParameters().lie_height  # [m] of the feet, below the body
FORWARD = Velocity(0.1)
SPINNING = replace(UPRIGHT, angular_velocity=(0.0, 20.0, 0.0))
BROKEN = replace(UPRIGHT, orientation=(math.nan,) * 4)
NAN_TARGETS = (math.nan,) * 12


def on_its_feet(mode: str, duration: float = 1.0) -> tuple[Rig, StillPolicy]:
    """Return a rig that does what a mode says [s]."""
    rig, policy = policy_rig()
    standing(rig).ask(mode)
    rig.run(duration, FORWARD)
    return rig, policy


def lies(rig: Rig) -> bool:
    """Return whether all legs are folded."""
    return all(abs(foot[2] - LYING) < 1e-4 for foot in ROBOT.feet(rig.positions))


@settings(max_examples=40)
@given(
    mode=st.sampled_from(
        ['stand', 'walk', 'turn', 'policy', 'gait:crawl', 'gait:pace', 'lie', 'relax']
    ),
    duration=st.floats(0.0, 2.0),
    imu=st.sampled_from([UPRIGHT, None, BROKEN, SPINNING, tilted(1.5), tilted(3.1)]),
    joints=st.booleans(),
    battery=st.sampled_from([None, 0.01]),
    target=st.sampled_from([STAND, None, NAN_TARGETS]),
    waited=st.floats(0.0, 4.0),
    asked=st.sampled_from(['lie', 'relax']),
)
def test_from_every_fault_there_is_a_way_down(
    *,
    mode: str,
    duration: float,
    imu: ImuSample | None,
    joints: bool,
    battery: float | None,
    target: Targets | None,
    waited: float,
    asked: str,
) -> None:
    """Whatever failed, whenever: the legs fold, or stop with a fault and fold when asked again.

    The robot is in a mode for a time, then measures and its policy answers so, and waits.
    """
    rig, policy = on_its_feet(mode, duration)
    rig.imu, rig.joints, rig.battery = imu, joints, battery
    policy.targets = target
    rig.run(waited, FORWARD)
    rig.largest_step = 0.0
    rig.ask(asked)
    rig.run(6.0, FORWARD)
    if rig.is_in(State.FAULT):  # what failed only now; it is known to whoever asks again
        rig.ask(asked)
        rig.run(6.0, FORWARD)
    assert rig.is_in(State.LIE if asked == 'lie' else State.RELAX), rig.log
    assert lies(rig)
    assert rig.largest_step <= 10.0 * 1.5 * PERIOD + 1e-9


@pytest.mark.parametrize('imu', [None, SPINNING])
def test_a_robot_on_its_way_down_stays_there_until_its_fault_is_cleared(
    imu: ImuSample | None,
) -> None:
    """Lying, the fault is still latched and reported; it is cleared where its reason is gone."""
    rig, _ = on_its_feet('walk')
    rig.imu = imu
    rig.run(1.5, FORWARD)
    assert rig.is_in(State.FAULT)
    assert not rig.controller.set_mode('stand').accepted
    rig.ask('lie')
    rig.until(State.LIE)
    rig.run(3.0)
    assert rig.controller.status.faults
    assert not rig.controller.set_mode('stand').accepted
    assert not rig.controller.clear_fault().accepted
    rig.imu = UPRIGHT
    rig.run(0.2)
    assert not rig.controller.set_mode('stand').accepted
    assert rig.controller.clear_fault().accepted
    assert rig.is_in(State.LIE)
    assert not rig.controller.status.faults
    rig.ask('stand')
    rig.until(State.STAND)


def test_a_fault_that_is_cleared_does_not_end_the_way_down() -> None:
    """The gait comes to rest for lying down, and the fault is cleared meanwhile."""
    rig, _ = on_its_feet('walk')
    rig.imu = None
    while not rig.is_in(State.FAULT):
        rig.step(FORWARD)
    rig.ask('lie')
    rig.imu = UPRIGHT
    rig.step()
    assert rig.controller.clear_fault().accepted
    rig.run(4.0)
    assert rig.is_in(State.LIE)
    assert lies(rig)


def test_a_robot_that_falls_on_its_way_down_stops_until_it_is_asked_again() -> None:
    """A new fault holds the legs; the same request then folds them in spite of it."""
    rig, _ = on_its_feet('stand')
    rig.imu = None
    rig.run(1.0)
    rig.ask('lie')
    rig.run(0.3)
    rig.imu = tilted(1.5)
    rig.run(0.2)
    assert rig.is_in(State.FAULT)
    held = rig.positions
    rig.run(1.0)
    assert rig.positions == held
    rig.ask('lie')
    rig.run(4.0)
    assert rig.is_in(State.LIE)
    assert lies(rig)
