# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Another policy while the robot stands or walks: it comes to stand, and goes on by that one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from quad_controller import find_policy, GaitGenerator, load_policy, PolicyOptions, State, Velocity
from quad_description import Targets
from quad_gait_rig import (
    FIRM,
    firm,
    MODEL,
    PERIOD,
    PhysicsRig,
    policy_rig,
    STAND,
    standing,
    StillPolicy,
    tilted,
)

CROUCHED = tuple(angle + 0.1 for angle in STAND)
STANDING_LOW = tuple(angle + 0.05 for angle in STAND)
FORWARD = Velocity(0.15)


def good(name: str = 'good', targets: Targets = CROUCHED) -> StillPolicy:
    """Return a policy that is well."""
    policy = StillPolicy(targets)
    policy.name = name
    return policy


@pytest.mark.parametrize('mode', ['stand', 'walk', 'turn'])
def test_a_policy_takes_over_from_the_gait_standing(mode: str) -> None:
    """The robot comes to rest, then the policy is eased in; no target jumps."""
    rig, policy = standing(mode=mode), good()
    rig.run(1.0, FORWARD)
    answer = rig.controller.follow(policy)
    assert answer.message == 'stands, then follows good'
    assert rig.controller.status.policy == 'good'
    while not rig.is_in(State.POLICY):
        assert policy.resets == 0
        rig.step(FORWARD)
    assert rig.positions == pytest.approx(STAND, abs=0.02)
    rig.largest_step = 0.0
    rig.run(2.0)
    assert rig.positions == pytest.approx(CROUCHED)
    assert rig.controller.status.title == 'policy'
    assert rig.largest_step < 0.005
    assert policy.resets == 1


def test_the_robot_stands_between_two_policies_and_the_gait() -> None:
    """The former one winds down without a velocity; the next one gets it again."""
    former, policy = good('former'), good('new', STANDING_LOW)
    rig = standing(policy_rig(former)[0], 'policy')
    rig.run(1.0, FORWARD)
    assert rig.controller.follow(policy).accepted
    former.velocities.clear()
    rig.step(FORWARD)
    assert not rig.controller.follow(good('third')).accepted
    rig.run(4.0, FORWARD)
    assert rig.log == ['policy -> stand', 'stand -> policy']
    assert all(velocity.at_rest for velocity in former.velocities)
    assert policy.velocities[-1] == FORWARD
    assert rig.positions == pytest.approx(STANDING_LOW)
    assert rig.controller.follow(None).message == 'stands, then follows the gait'
    rig.run(4.0, FORWARD)
    assert rig.is_in(State.WALK)
    assert (rig.controller.status.velocity, rig.controller.status.policy) == (FORWARD, '')
    assert not rig.controller.set_mode('policy').accepted
    rig.ask('lie')
    assert 'on its way to lie' in rig.controller.follow(policy).message
    rig.run(4.0)
    before = rig.positions
    assert 'the mode policy follows new' in rig.controller.follow(policy).message
    rig.run(1.0)
    assert rig.positions == before
    assert rig.largest_step <= 10.0 * 1.5 * PERIOD + 1e-9


@pytest.mark.parametrize('end', ['stop', 'lie', 'fall'])
def test_what_comes_between_ends_the_swap(end: str) -> None:
    """The robot does not walk off afterwards; the mode policy follows the new one."""
    former, policy = good('former'), good('new')
    rig = standing(policy_rig(former)[0], 'policy')
    rig.run(1.0, FORWARD)
    assert rig.controller.follow(policy).accepted
    rig.run(0.1)
    assert rig.is_in(State.POLICY)
    if end == 'stop':
        assert rig.controller.stop().accepted
    elif end == 'lie':
        rig.ask('lie')
    else:
        rig.imu = replace(tilted(0.0), angular_velocity=(9.0, 0.0, 0.0))
    rig.run(6.0)
    assert policy.resets == 0
    assert rig.is_in({'stop': State.STAND, 'lie': State.LIE, 'fall': State.FAULT}[end])
    assert rig.controller.policy is policy
    if end == 'fall':
        assert 'fall' in rig.controller.follow(good()).message


def test_a_policy_that_fails_is_no_obstacle() -> None:
    """The robot stands by the gait in between."""
    former, policy = good('former'), good('new')
    rig = standing(policy_rig(former)[0], 'policy')
    rig.run(1.0, FORWARD)
    former.targets = None
    assert rig.controller.follow(policy).accepted
    rig.run(4.0)
    assert 'the policy was given up: broken on purpose' in rig.log
    assert rig.is_in(State.POLICY)
    assert policy.resets == 1


def test_a_policy_that_misses_a_measurement_is_refused_before_the_robot_stands() -> None:
    """What is followed goes on; the mode is refused, too, and the missing turn rate reported."""
    rig = standing(policy_rig()[0], 'walk')
    rig.imu = replace(tilted(0.0), angular_velocity=None)
    rig.step()
    former, missing = rig.controller.policy, 'a policy needs what /imu does not have'
    answer = rig.controller.follow(good())
    assert (answer.accepted, answer.message) == (False, f'stays as it is: {missing}')
    assert rig.controller.policy is former
    assert missing in rig.controller.set_mode('policy').message
    assert rig.is_in(State.WALK)
    assert any('max_turn_rate' in text for text in rig.controller.status.warnings)


@pytest.mark.slow
def test_gait_policy_and_gait_walk_on_in_physics() -> None:
    """From one to the other at 0.15 m/s, the robot goes on as commanded and stays level."""
    stand = GaitGenerator(MODEL, FIRM).stand_targets
    path = find_policy('trot_ppo')
    policy = load_policy(path, MODEL, stand, PolicyOptions(), PERIOD).runner
    rig = PhysicsRig(firm(), FIRM)
    rig.mode('walk')
    rig.run(1.0, FORWARD)
    rig.tilt = 0.0
    for each, state in ((policy, State.POLICY), (None, State.WALK)):
        assert rig.controller.follow(each).accepted
        rig.run(4.0, FORWARD)
        assert rig.controller.status.state is state
        assert rig.tilt < 0.15, f'on the way to {state}'
        travel = rig.travel(2.0, FORWARD)
        assert travel.x == pytest.approx(FORWARD.x, abs=0.03)
        assert travel.tilt < 0.15
