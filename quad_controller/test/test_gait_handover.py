# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Another policy while the robot stands or walks: over to it, and back when it does not do."""

from __future__ import annotations

from dataclasses import replace

import pytest

from quad_controller.gait.generator import GaitGenerator
from quad_controller.gait.parameters import GaitParameters
from quad_controller.gait.velocity import Velocity
from quad_controller.policy.interface import PolicyInputs, PolicyStep
from quad_controller.policy.load import load_policy
from quad_controller.policy.options import PolicyOptions
from quad_controller.policy.runner import PolicyRunner
from quad_controller.policy.shipped import find_policy
from quad_controller.states.controller import Controller
from quad_controller.states.handover import BLEND_TIME, PROBATION_TIME, RETURN_TIME, WARM_UP_TIME
from quad_controller.states.modes import State
from quad_controller.states.parameters import StateParameters
from quad_description import Targets
from quad_gait_physics import MODEL, PhysicsRig
from quad_gait_rig import PERIOD, Rig, ROBOT, StillPolicy, tilted

STAND = GaitGenerator(ROBOT, GaitParameters()).stand_targets
CROUCHED = tuple(angle + 0.1 for angle in STAND)
TO_PROBATION = WARM_UP_TIME + BLEND_TIME + 2 * PERIOD
FORWARD = Velocity(0.15)


class NamedPolicy(StillPolicy):
    """A policy that answers as a test says."""

    def __init__(self, name: str, answer: PolicyStep) -> None:
        """Answer always the same."""
        super().__init__(answer.targets or STAND)
        self.name, self.answer = name, answer
        self.memory = 0.0

    def step(self, inputs: PolicyInputs, dt: float) -> PolicyStep:
        """Answer."""
        self.velocities.append(inputs.velocity)
        return self.answer


class JumpingPolicy(NamedPolicy):
    """A policy that wants joints to be elsewhere in each step."""

    def step(self, inputs: PolicyInputs, dt: float) -> PolicyStep:
        """Answer one of two poses, in turn."""
        super().step(inputs, dt)
        off = 0.8 if len(self.velocities) % 2 else 0.0
        return PolicyStep(tuple(angle + off for angle in STAND))


def good(name: str = 'good', targets: Targets = CROUCHED) -> NamedPolicy:
    """Return a policy that is well."""
    return NamedPolicy(name, PolicyStep(targets))


def standing(policy: NamedPolicy | None = None, mode: str = 'stand') -> Rig:
    """Return a rig that stands, by a policy if there is one and the mode is its."""
    rig = Rig(Controller(ROBOT, GaitParameters(), StateParameters(), policy=policy))
    rig.step()
    rig.ask(mode)
    rig.run(4.0)
    rig.log.clear()
    return rig


def test_a_policy_takes_over_from_the_gait_in_the_documented_times() -> None:
    """It watches, moves nothing, blends, and is kept; no target jumps."""
    rig, policy = standing(), good()
    before = rig.positions
    answer = rig.controller.follow(policy)
    assert answer.accepted
    assert 'from the gait to good within 1 s' in answer.message
    rig.largest_step = 0.0
    rig.run(WARM_UP_TIME - PERIOD)
    assert rig.positions == before
    assert rig.controller.status.title == 'to policy'
    assert rig.controller.status.policy == 'good: warming up'
    rig.run(BLEND_TIME / 2)
    assert before[0] < rig.positions[0] < CROUCHED[0]
    rig.run(BLEND_TIME / 2 + 2 * PERIOD)
    assert rig.positions == pytest.approx(CROUCHED)
    assert rig.controller.status.title == 'policy'
    rig.run(PROBATION_TIME + 2 * PERIOD)
    phases = ('warming up', 'blending', 'on probation', 'kept')
    assert rig.log == [f'good: {phase}' for phase in phases]
    assert rig.controller.status.policy == 'good'
    assert rig.largest_step < 0.005
    assert policy.resets == 1


def test_a_policy_that_sees_far_back_watches_longer() -> None:
    """The history is full before the blend begins."""
    rig, policy = standing(), good()
    policy.memory = 2.0
    assert 'watched for 2 s' in rig.controller.follow(policy).message
    rig.run(1.9)
    assert rig.positions == pytest.approx(STAND)


def test_a_second_policy_is_refused_while_one_takes_over() -> None:
    """In each phase the answer says how far it is; nothing changes."""
    rig, policy = standing(), good()
    assert rig.controller.follow(policy).accepted
    for duration, word in ((0.1, 'warming up'), (0.8, 'blending'), (2.0, 'on probation')):
        rig.run(duration)
        answer = rig.controller.follow(good('other'))
        assert not answer.accepted
        assert f'good: {word}' in answer.message
    assert rig.controller.policy is policy


@pytest.mark.parametrize(
    ('bad', 'reason'),
    [
        (NamedPolicy('bad', PolicyStep(CROUCHED, saturated=0.3)), 'saturation: targets of 30%'),
        (NamedPolicy('bad', PolicyStep(CROUCHED, computing=0.015)), 'late inference: 15.0 ms'),
        (JumpingPolicy('bad', PolicyStep(None)), 'action jump: targets go 4.0 times'),
        (NamedPolicy('bad', PolicyStep(None, 'broken on purpose')), 'broken on purpose'),
    ],
)
def test_a_bad_policy_is_given_up_for_the_one_before(bad: NamedPolicy, reason: str) -> None:
    """Already while it only watches: it never moves the robot."""
    former = good('former')
    rig = standing(former, 'policy')
    assert rig.controller.follow(bad).accepted
    rig.largest_step = 0.0
    rig.run(WARM_UP_TIME + RETURN_TIME)
    assert rig.log[1].startswith(f'bad was given up: {reason}')
    assert rig.log[-2:] == [rig.log[1], 'bad: gone back']
    assert rig.controller.policy is former
    assert rig.is_in(State.POLICY)
    assert rig.positions == pytest.approx(CROUCHED)
    assert rig.largest_step == pytest.approx(0.0, abs=1e-9)


def test_a_policy_that_tips_the_robot_is_given_up_before_it_is_a_fall() -> None:
    """The tilt counts when the policy moves the robot, and goes back without a leap."""
    former = good('former', STAND)
    rig = standing(former, 'policy')
    rig.imu = tilted(0.5)
    assert rig.controller.follow(good('bad')).accepted
    rig.run(WARM_UP_TIME - PERIOD)
    assert rig.controller.status.policy == 'bad: warming up'
    rig.imu = tilted(0.0)
    rig.run(TO_PROBATION + 1.0)
    rig.largest_step = 0.0
    rig.imu = tilted(0.5)
    rig.run(RETURN_TIME + 2 * PERIOD)
    assert 'bad was given up: tilt: 29 deg, more than 26 on probation; back to former' in rig.log
    assert rig.positions == pytest.approx(STAND)
    assert rig.largest_step < 0.02
    assert rig.is_in(State.POLICY)


def test_a_fall_on_probation_leaves_the_former_policy_for_later() -> None:
    """The fault holds as ever; mode policy would follow the former one."""
    rig = standing()
    assert rig.controller.follow(good('bad')).accepted
    rig.run(TO_PROBATION)
    rig.imu = replace(tilted(0.0), angular_velocity=(9.0, 0.0, 0.0))
    rig.run(0.3)
    assert rig.is_in(State.FAULT)
    assert rig.controller.policy is None
    assert 'bad was given up for the gait, which the mode policy follows' in rig.log
    assert 'fall' in rig.controller.follow(good()).message


def test_both_failing_ends_standing() -> None:
    """When there is nothing to go back to, the robot stands by the gait."""
    former = good('former')
    rig = standing(former, 'policy')
    former.answer = PolicyStep(None, 'broken, too')
    assert rig.controller.follow(NamedPolicy('bad', PolicyStep(None, 'broken'))).accepted
    rig.run(0.3)
    assert rig.is_in(State.STAND)
    assert any('the one before it failed: broken, too' in text for text in rig.log)
    assert rig.controller.policy is former


def test_lying_it_is_loaded_and_nothing_moves() -> None:
    """The mode policy follows it then."""
    rig = standing()
    rig.ask('lie')
    rig.run(3.0)
    before = rig.positions
    assert 'the mode policy follows good' in rig.controller.follow(good()).message
    rig.run(2.0)
    assert rig.positions == before
    rig.ask('policy')
    rig.until(State.POLICY)


def test_on_the_way_down_no_policy_is_taken() -> None:
    """The request to lie down counts."""
    rig = standing()
    rig.ask('walk')
    rig.run(1.0, FORWARD)
    rig.ask('lie')
    assert 'on its way to lie' in rig.controller.follow(good()).message


def test_a_request_to_lie_on_probation_is_followed() -> None:
    """The handover is no obstacle to a way down."""
    rig, policy = standing(), good()
    assert rig.controller.follow(policy).accepted
    rig.run(0.8)
    rig.ask('lie')
    rig.until(State.LIE)
    assert rig.controller.policy is policy
    assert rig.controller.follow(good('next')).accepted


def shipped() -> PolicyRunner:
    """Return the policy that is shipped, anew."""
    path = find_policy('trot_imitation')
    stand = GaitGenerator(MODEL, GaitParameters()).stand_targets
    return load_policy(path, MODEL, stand, PolicyOptions(), PERIOD).runner


@pytest.mark.slow
def test_gait_policy_and_gait_walk_on_in_physics() -> None:
    """From one to the other at 0.15 m/s, the robot goes on as commanded and stays level."""
    rig = PhysicsRig()
    rig.mode('walk')
    rig.run(1.0, FORWARD)
    for policy, state in (
        (shipped(), State.POLICY),
        (shipped(), State.POLICY),
        (None, State.WALK),
    ):
        assert rig.controller.follow(policy).accepted
        travel = rig.travel(TO_PROBATION + PROBATION_TIME, FORWARD)
        assert rig.controller.status.state is state
        assert travel.x == pytest.approx(FORWARD.x, abs=0.03)
        assert travel.tilt < 0.15
    assert rig.controller.policy is None


@pytest.mark.slow
def test_a_policy_that_goes_wild_later_is_given_up_and_the_robot_walks_on_in_physics() -> None:
    """It walks well, until it moves the calves to and fro; the gait, ready beside it, goes on."""

    class WildPolicy(NamedPolicy):
        def __init__(self, walks: PolicyRunner) -> None:
            super().__init__('wild', PolicyStep(None))
            self._walks = walks

        def step(self, inputs: PolicyInputs, dt: float) -> PolicyStep:
            """Answer as the other one, with 0.5 rad more in every other step from 3 s on."""
            super().step(inputs, dt)
            answer, count = self._walks.step(inputs, dt), len(self.velocities)
            off = 0.5 if count > 150 and count % 2 else 0.0
            targets = answer.targets and tuple(angle + off for angle in answer.targets)
            return PolicyStep(targets, answer.reason)

    rig = PhysicsRig()
    rig.mode('walk')
    rig.run(1.0, FORWARD)
    assert rig.controller.follow(WildPolicy(shipped())).accepted
    rig.run(2.9, FORWARD)
    assert rig.controller.status.policy == 'wild: on probation'
    rig.run(1.0, FORWARD)
    assert rig.controller.policy is None
    assert rig.state == 'walk'
    travel = rig.travel(4.0, FORWARD)
    assert travel.x == pytest.approx(FORWARD.x, abs=0.03)
    assert travel.tilt < 0.15
