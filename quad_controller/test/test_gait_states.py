# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Behaviour of the states: ways between them, time-outs, faults, and what may never happen."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from quad_controller import (
    Answer,
    BodyPose,
    Controller,
    GaitParameters,
    MODES,
    ParameterError,
    State,
    StateParameters,
    Velocity,
)
from quad_controller.states.modes import Fault
from quad_description import (
    DescriptionError,
    ImuSample,
    JointSample,
    raised_feet,
    RobotState,
    Targets,
)
from quad_gait_rig import (
    ARM_ROBOT,
    FOLDED,
    LYING,
    PERIOD,
    policy_rig,
    Rig,
    ROBOT,
    STAND,
    STANDING,
    standing,
    StillPolicy,
    tilted,
    UPRIGHT,
)

pytestmark = pytest.mark.slow

FORWARD = Velocity(0.1)
LYING_FOOT = ROBOT.legs[0].hip[2] - StateParameters().lie_height  # [m]
SPINNING = replace(UPRIGHT, angular_velocity=(0.0, 9.5, 0.0))
BROKEN = replace(UPRIGHT, orientation=(math.nan,) * 4)
NAN_TARGETS = (math.nan,) * 12


def walking(rig: Rig | None = None, mode: str = 'walk') -> Rig:
    """Return a rig that has walked ahead for a second."""
    rig = standing(rig)
    rig.ask(mode)
    rig.run(1.0, FORWARD)
    return rig


def test_nothing_is_sent_before_the_joints_are_known() -> None:
    """Without joint states there is no target, and no mode but an answer that says why."""
    rig = Rig()
    rig.joints = False
    assert rig.step() is None
    answer = rig.controller.set_mode('walk')
    assert not answer.accepted
    assert '/joint_states' in answer.message


def test_a_joint_that_can_never_move_is_refused_with_its_limit() -> None:
    """A velocity limit of 0 is there, and of no use."""
    limits = (replace(ROBOT.limits[0], velocity=0.0), *ROBOT.limits[1:])
    with pytest.raises(DescriptionError, match='fl_hip_joint has velocity limit 0: it can never'):
        Controller(replace(ROBOT, limits=limits), GaitParameters(), StateParameters())


def test_nothing_moves_before_it_is_asked_to() -> None:
    """Relaxed, the targets are where the joints were found, be it outside of their limits.

    A joint there goes no further out, and standing up takes it in.
    """
    outside = (ROBOT.limits[0].upper + 0.1, FOLDED[1], ROBOT.limits[2].lower - 0.2, *FOLDED[3:])
    for place in (FOLDED, outside):
        rig = Rig(positions=place)
        rig.run(2.0, FORWARD)
        assert (rig.positions, rig.largest_step) == (place, 0.0)
    further = (outside[0] + 0.5, *outside[1:])
    measured = RobotState(JointSample(further, (0.0,) * 12), UPRIGHT)
    for _ in range(10):
        assert rig.controller.step(measured, PERIOD).targets == outside
    standing(rig)
    assert rig.positions == pytest.approx(STAND)
    assert rig.largest_step <= 0.2 + 1e-9


def test_a_joint_moved_by_hand_is_not_pulled_back() -> None:
    """Relaxed, the set-point stays within a band of where a joint was moved."""
    rig = Rig()
    rig.step()
    moved = (*FOLDED[:1], FOLDED[1] - 1.0, *FOLDED[2:])
    measured = RobotState(JointSample(moved, (0.0,) * 12), UPRIGHT)
    for _ in range(100):
        targets = rig.controller.step(measured, PERIOD).targets
    assert targets is not None
    assert abs(targets[1] - moved[1]) <= 0.25 + 1e-9


def test_stands_up_walks_and_lies_down() -> None:
    """Each mode is reached, and the gait comes to rest before the legs are folded."""
    rig = standing()
    assert rig.positions == pytest.approx(STAND)
    rig.ask('walk')
    rig.run(1.0, FORWARD)
    assert rig.controller.status.velocity.x == pytest.approx(0.1)
    rig.ask('turn')
    rig.run(1.0, Velocity(0.2, 0.1, 0.5))
    assert rig.controller.status.velocity == Velocity(yaw=0.5)
    assert 'parameter policy' in rig.controller.set_mode('policy').message
    rig.ask('relax')
    rig.until(State.RELAX, FORWARD)
    assert rig.controller.status.velocity.at_rest
    assert ROBOT.feet(rig.positions)[0][2] == pytest.approx(LYING_FOOT, abs=1e-6)
    assert [line for line in rig.log if '->' in line] == [
        'stand -> walk', 'walk -> turn', 'turn -> lie', 'lie -> relax',
    ]  # fmt: skip


def test_a_stream_that_breaks_off_stops_the_robot() -> None:
    """Half a second after the last velocity the robot is on its way to rest, and says why."""
    rig = walking()
    rig.run(0.4)
    assert rig.controller.status.velocity.x == pytest.approx(0.1)
    rig.run(0.6)
    assert rig.controller.status.velocity.at_rest
    assert 'counts as zero' in rig.controller.status.warnings[0]
    assert sum('counts as zero' in line for line in rig.log) == 1
    assert rig.is_in(State.WALK)
    rig.run(0.5, FORWARD)
    assert rig.controller.status.velocity.x == pytest.approx(0.1)


def test_the_gait_is_tuned_while_nothing_walks() -> None:
    """Lying, another height is taken and stood up to; on its legs the robot refuses it."""
    rig = standing()
    higher = GaitParameters(nominal_height=0.1, servo=None)
    assert 'not in stand' in rig.controller.retune(higher).message
    rig.ask('gait:crawl')
    rig.until(State.WALK)
    rig.ask('lie')
    rig.run(2.0)
    assert rig.controller.retune(higher).accepted
    rig.ask('walk')
    rig.until(State.WALK)
    rig.run(1.0, Velocity(0.03))
    assert rig.controller.status.gait.value == 'crawl'
    assert rig.controller.status.velocity.x == pytest.approx(0.03)
    rig.run(3.0)
    height = ROBOT.legs[0].hip[2] - ROBOT.feet(rig.positions)[0][2]
    assert height == pytest.approx(0.1, abs=1e-4)
    with pytest.raises(DescriptionError):
        Rig().controller.retune(GaitParameters(nominal_height=0.5))


def test_a_velocity_that_is_too_much_is_reported_once() -> None:
    """The robot goes as fast as it can, in the same direction, and says how fast that is."""
    rig = standing()
    rig.ask('walk')
    rig.run(1.0, Velocity(0.8))
    assert rig.controller.status.velocity == Velocity(0.3)
    logged = [line for line in rig.log if 'is more than' in line]
    assert logged == [
        '0.80 0.00 m/s 0.00 rad/s is more than a trot can; clamped to 0.30 0.00 m/s 0.00 rad/s'
    ]
    rig.run(1.0, Velocity(0.2))
    assert len([line for line in rig.log if 'is more than' in line]) == 1


@pytest.mark.parametrize('value', [math.nan, math.inf])
def test_velocities_and_poses_that_are_no_numbers_are_refused(value: float) -> None:
    """They stop the robot or change nothing, and are answered with a reason."""
    rig = standing()
    rig.ask('walk')
    rig.run(0.5, FORWARD)
    assert 'not finite' in rig.controller.set_velocity(Velocity(0.1, value)).message
    assert 'not finite' in rig.controller.set_body_pose(BodyPose(roll=value)).message
    rig.run(0.5)
    assert rig.controller.status.velocity.at_rest
    assert rig.controller.status.refused == 2


@pytest.mark.parametrize(
    ('mode', 'place', 'asked'),
    [('relax', STANDING, 'lie'), ('lie', STANDING, 'stand'), ('walk', LYING, 'stand')],
)
def test_joints_that_moved_unseen_are_held_where_they_are_found(
    mode: str, place: Targets, asked: str
) -> None:
    """A robot that started anew lies or stands: what was held before would move it unasked."""
    rig = Rig()
    rig.step()
    if mode != 'relax':
        walking(rig).ask(mode)
        rig.run(3.0, FORWARD)
        assert rig.is_in(State(mode))
    rig.joints = False
    rig.run(0.3)
    held = rig.positions
    rig.run(2.0)
    assert rig.positions == held
    rig.joints, rig.positions = True, place
    rig.run(1.0)
    assert rig.positions == place
    rig.controller.clear_fault()
    rig.ask(asked)
    rig.run(5.0)
    assert rig.positions != place


@pytest.mark.parametrize(('off', 'wrong_once'), [(-0.2, False), (1.0, True)])
def test_joints_that_sag_unseen_or_are_wrong_once_stay_held(off: float, wrong_once: bool) -> None:
    """Under its weight a leg is a little off its target; of a distance, two samples agree."""
    rig = Rig()
    rig.step()
    held = rig.positions
    rig.joints = False
    rig.run(1.0)
    rig.joints, rig.positions = True, tuple(position + off for position in held)
    if wrong_once:
        assert rig.step() is None
        rig.positions = held
    assert rig.step() == pytest.approx(held)


def test_silent_joints_hold_then_fault_and_need_clearing() -> None:
    """0.3 s are survived: the legs stop at 0.2 s, and walk on.

    At 0.5 s the fault latches, and nothing moves by itself after.
    """
    rig = walking()
    rig.joints = False
    rig.run(0.3, FORWARD)
    rig.joints = True
    rig.run(1.0, FORWARD)
    assert [line for line in rig.log if 'joint states' in line] == [
        'joint states are 220 ms old; holding the last targets', 'joint states: in order again',
    ]  # fmt: skip
    assert rig.controller.status.velocity.x == pytest.approx(0.1)
    rig.joints = False
    rig.run(0.3, FORWARD)
    held = rig.positions
    assert rig.is_in(State.WALK)
    rig.run(0.3, FORWARD)
    assert rig.is_in(State.FAULT)
    assert rig.positions == held
    assert not rig.controller.clear_fault().accepted
    rig.joints = True
    rig.run(1.0, FORWARD)
    assert rig.positions == held
    assert 'joint states: none for' in rig.controller.set_mode('walk').message
    assert rig.controller.clear_fault().accepted
    rig.run(1.0, FORWARD)
    assert rig.positions == held
    rig.ask('walk')
    rig.until(State.WALK)


def test_a_short_pause_of_the_controller_itself_is_no_silence_of_the_robot() -> None:
    """After 0.4 s without a step it walks on; there is no fault."""
    rig = walking()
    before = rig.positions
    targets = rig.controller.step(RobotState(), 0.4).targets
    assert targets is not None
    steps = [abs(a - b) for a, b in zip(targets, before, strict=True)]
    assert max(steps) <= 10.0 * 1.5 * PERIOD + 1e-9
    rig.run(1.0)
    assert rig.is_in(State.WALK)
    assert rig.controller.status.velocity.at_rest


def test_old_messages_in_a_burst_after_a_pause_are_no_fault_and_late_ones_are() -> None:
    """What was sent while the controller slept is read late, once; the reason says by how much."""
    rig = standing()
    still = JointSample(rig.positions, (0.0,) * 12)
    late = RobotState(still, UPRIGHT, joints_age=0.7, imu_age=0.7)
    rig.controller.step(late, 0.4)
    rig.run(0.5)
    assert rig.is_in(State.STAND)
    for _ in range(round(0.4 / PERIOD)):
        rig.controller.step(late, PERIOD)
    assert rig.is_in(State.STAND)
    for _ in range(round(0.4 / PERIOD)):
        rig.controller.step(late, PERIOD)
    assert rig.is_in(State.FAULT)
    assert (
        '/joint_states comes 0.7 s after its header.stamp' in rig.controller.clear_fault().message
    )


@pytest.mark.parametrize('goal', ['walk', 'lie', 'policy'])
def test_a_controller_that_wakes_from_a_pause_in_motion_lies_down(goal: str) -> None:
    """From where it is: the hardware node has moved the legs, what was wanted does not count."""
    rig = standing(policy_rig()[0])
    rig.ask(goal)
    rig.run(0.8, FORWARD)
    stale = RobotState(JointSample(rig.positions, (0.0,) * 12), UPRIGHT)
    assert rig.controller.step(stale, 2.0).targets is None
    assert any('pause' in text for text in rig.controller.status.faults)
    rig.positions = found = tuple([0.05, 1.1, -0.7] * 4)
    rig.largest_step = 0.0
    assert rig.step(FORWARD) == pytest.approx(found, abs=0.01)
    rig.run(3.0, FORWARD)
    assert rig.is_in(State.FAULT)
    assert rig.largest_step < 1.6 * PERIOD
    assert rig.controller.clear_fault().accepted
    assert rig.is_in(State.LIE)


@pytest.mark.parametrize('case', ['fallen', 'joints lost', 'cleared'])
def test_after_a_pause_with_a_foot_in_the_air_nothing_is_lifted_again(case: str) -> None:
    """A fault holds a robot in mid-trot: the hardware node lays it down, if that goes on."""
    rig = walking()
    while not raised_feet(ROBOT.feet(rig.positions)):
        rig.step(FORWARD)
    if case == 'fallen':
        rig.run(3 * PERIOD, FORWARD)  # the fall is noticed when the other pair is up
        rig.imu = replace(UPRIGHT, angular_velocity=(20.0, 0.0, 0.0))
        rig.until(State.FAULT, FORWARD)
    else:
        rig.joints = False
        rig.run(0.6, FORWARD)
    rig.joints = True
    assert rig.is_in(State.FAULT)
    assert raised_feet(ROBOT.feet(rig.positions))
    rig.run(0.1)
    if case == 'cleared':
        assert rig.controller.clear_fault().accepted
        rig.run(0.1)
    stale = RobotState(JointSample(rig.positions, (0.0,) * 12), UPRIGHT)
    assert rig.controller.step(stale, 3.0).targets is None
    assert any('_foot in the air' in text for text in rig.controller.status.faults)
    rig.positions = found = tuple([0.05, 1.1, -0.7] * 4)
    assert rig.step() == pytest.approx(found, abs=0.01)
    rig.run(3.0)
    assert not raised_feet(ROBOT.feet(rig.positions))
    if case != 'cleared':
        assert rig.positions == pytest.approx(found)


def test_stand_is_where_all_feet_stand() -> None:
    """A robot that walked is on its way there until its gait has ended."""
    rig = walking()
    rig.ask('stand')
    titles: list[str] = []
    while not titles or titles[-1] != 'stand':
        rig.step(FORWARD)
        titles.append(rig.controller.status.title)
        assert len(titles) < 200
    assert titles[0] == 'to stand'
    assert len(titles) > 5
    resting = rig.positions
    rig.run(0.5, FORWARD)
    assert rig.positions == pytest.approx(resting, abs=0.02)


@pytest.mark.parametrize('state', [State.WALK, State.FAULT])
def test_a_pause_at_rest_is_no_fault(state: State) -> None:
    """On all its feet it stands as before; the velocity of before the pause is stale."""
    rig = standing(mode='walk')
    if state is State.FAULT:
        rig.imu = None
        rig.run(1.0)
    assert rig.is_in(state)
    before = rig.positions
    assert rig.controller.step(RobotState(), 3.0).targets == pytest.approx(before)
    rig.run(1.0)
    assert rig.is_in(state)
    assert not any('pause' in text for text in rig.controller.status.faults)


@pytest.mark.parametrize('dts', [(0.15,), (0.3,), (1.0,), (0.3, 0.02)])
def test_a_slow_loop_watches_as_well(dts: tuple[float, ...]) -> None:
    """When steps come late again and again, only the first one is excused."""
    rig = standing()
    rig.ask('walk')
    rig.until(State.WALK)
    passed = 0.0
    while not rig.is_in(State.FAULT):
        for dt in dts:
            rig.controller.step(RobotState(), dt)
        passed += sum(dts)
        assert passed <= 0.5 + 2 * sum(dts)


def test_one_odd_sample_after_a_pause_is_no_fault() -> None:
    """A fall and a low charge must last, in what is seen and not in what was slept through."""
    rig = standing()
    still = JointSample(rig.positions, (0.0,) * 12)
    for _ in range(2):
        rig.controller.step(RobotState(still, tilted(1.2), 0.01), 4.0)
        rig.controller.step(RobotState(still, UPRIGHT, 0.9), PERIOD)
    assert rig.is_in(State.STAND)
    rig.imu = tilted(1.2)
    rig.run(0.2)
    assert rig.is_in(State.FAULT)


@pytest.mark.parametrize('frozen', [(1,), tuple(range(12))])
def test_a_frozen_sensor_is_reported(frozen: tuple[int, ...]) -> None:
    """Joint states that come on time but never change are a warning, and only those are."""
    rig = standing()
    rig.ask('walk')
    rig.run(3.0, FORWARD)
    assert not rig.controller.status.warnings
    stuck = rig.positions
    for _ in range(150):
        rig.controller.set_velocity(FORWARD)
        positions = tuple(
            stuck[index] if index in frozen else angle for index, angle in enumerate(rig.positions)
        )
        output = rig.controller.step(
            RobotState(JointSample(positions, (0.0,) * 12), UPRIGHT), PERIOD
        )
        rig.log += [event.text for event in output.events]
        rig.positions = output.targets or rig.positions
    logged = [line for line in rig.log if 'do not follow their targets' in line]
    assert len(logged) == 1
    (warning,) = rig.controller.status.warnings
    assert ('fl_thigh_joint' if len(frozen) == 1 else 'all that move') in warning
    rig.run(2.5, FORWARD)
    assert not rig.controller.status.warnings


@pytest.mark.parametrize(
    ('imu', 'battery', 'words', 'mode'),
    [
        (None, 0.9, 'attitude: none for', 'stand'),
        (tilted(1.2), 0.9, 'fall: the body is tilted by 69 deg', 'relax'),
        (SPINNING, 0.9, 'fall: the body turns at 9.5 rad/s, faster than 8', 'relax'),
        (UPRIGHT, 0.05, 'battery: 5% left', 'lie'),
    ],
)
def test_what_lasts_is_a_fault_with_its_reaction(
    imu: ImuSample | None, battery: float, words: str, mode: str
) -> None:
    """A walk ends in standing, at once where it is, or lying; one sample does nothing."""
    rig = walking()
    rig.imu, rig.battery = imu, battery
    rig.run(0.06, FORWARD)
    rig.imu, rig.battery = UPRIGHT, 0.9
    rig.run(0.1, FORWARD)
    assert rig.is_in(State.WALK)
    rig.imu, rig.battery = imu, battery
    rig.until(State.FAULT, FORWARD)
    held = rig.positions
    rig.run(5.0, FORWARD)
    assert words in rig.controller.clear_fault().message
    if mode == 'stand':
        assert rig.positions == pytest.approx(STAND, abs=1e-3)
    elif mode == 'relax':
        assert rig.positions == held
    else:
        assert ROBOT.feet(rig.positions)[0][2] == pytest.approx(LYING_FOOT, abs=1e-6)
    rig.imu, rig.battery = UPRIGHT, 0.9
    rig.step()
    assert rig.controller.clear_fault().message == f'cleared; the mode is {mode}'


def test_a_servo_that_gives_up_ends_the_walk_and_lies_down() -> None:
    """Limp or hot, as the hardware node says; it stands up again when that is over."""
    rig = walking()
    rig.servo_problem = 'servo silent: look at the cable of the leg that hangs limp'
    rig.until(State.FAULT, FORWARD)
    rig.run(5.0, FORWARD)
    assert ROBOT.feet(rig.positions)[0][2] == pytest.approx(LYING_FOOT, abs=1e-6)
    assert 'servo silent' in rig.controller.set_mode('stand').message
    rig.servo_problem = ''
    rig.step()
    assert rig.controller.clear_fault().accepted
    rig.ask('stand')


def test_limits_and_slew_of_velocities_count_for_a_policy() -> None:
    """As for the gait; a stop is one at once."""
    gait = GaitParameters(max_linear_velocity_x=0.1, linear_acceleration=0.5)
    policy = StillPolicy(STAND)
    rig = standing(Rig(Controller(ROBOT, gait, StateParameters(), policy=policy)))
    rig.ask('policy')
    rig.run(2.0, Velocity())
    policy.velocities.clear()
    rig.run(1.0, Velocity(0.35, 0.0, 9.0))
    steps = [b.x - a.x for a, b in pairwise(policy.velocities)]
    assert max(steps) == pytest.approx(0.5 * PERIOD)
    assert policy.velocities[-1] == pytest.approx((0.1, 0.0, 1.5))
    rig.controller.stop()
    rig.step(Velocity(0.35))
    assert policy.velocities[-1] == Velocity()


def test_an_attitude_may_be_done_without() -> None:
    """With require_imu off a robot that never had one stands up and walks; a policy does not."""
    rig, _ = policy_rig(require_imu=False)
    rig.imu = None
    standing(rig).ask('walk')
    rig.run(1.0, FORWARD)
    assert rig.is_in(State.WALK)
    assert not rig.controller.set_mode('policy').accepted
    measured = RobotState(JointSample(rig.positions, (0.0,) * 12))
    assert rig.controller.step(measured, PERIOD).ready, 'a bring-up would wait for ever'


def test_messages_of_no_use_are_the_reason_of_the_silence() -> None:
    """A fault after joint states without a joint names it, and not the cable."""
    rig = standing()
    rig.ask('walk')
    rig.run(0.5, FORWARD)
    rig.joints = False
    for _ in range(50):
        rig.controller.refuse(Fault.JOINTS, 'joint states without fl_hip_joint')
        rig.run(0.02, FORWARD)
    assert rig.is_in(State.FAULT)
    assert rig.controller.status.faults == ('joint states: joint states without fl_hip_joint',)
    rig.joints = True
    rig.run(0.1)
    assert rig.controller.clear_fault().accepted
    rig.ask('walk')
    rig.run(0.5, FORWARD)
    rig.joints = False
    rig.run(0.1, FORWARD)
    rig.controller.refuse(Fault.JOINTS, 'joint states without fl_hip_joint')
    rig.run(5.0, FORWARD)  # the cable was pulled after one bad message
    assert rig.is_in(State.FAULT)
    assert 'look at the hardware node and its cable' in rig.controller.clear_fault().message
    assert 'fl_hip_joint' not in '; '.join(rig.controller.status.warnings)


def test_a_robot_that_is_carried_while_relaxed_is_no_fault() -> None:
    """Tilting a relaxed robot latches nothing, but it does not stand up then."""
    rig = Rig()
    rig.imu = tilted(1.5)
    rig.run(1.0)
    assert rig.is_in(State.RELAX)
    assert 'put it on its feet' in rig.controller.set_mode('stand').message


def test_joints_lost_while_lying_down_are_a_fault() -> None:
    """The legs stop and do not go on by themselves when the joint states come back."""
    rig = standing()
    rig.ask('lie')
    rig.until(State.LIE)
    rig.run(0.3)
    assert rig.controller.status.title == 'to lie'
    rig.joints = False
    rig.run(0.25)
    held = rig.positions
    assert any('holding the last targets' in line for line in rig.log)
    rig.run(0.5)
    assert rig.is_in(State.FAULT)
    rig.joints = True
    rig.run(2.0)
    assert rig.positions == held
    assert rig.controller.clear_fault().message == 'cleared; the mode is relax'


def test_a_low_reading_and_an_unknown_charge_do_nothing() -> None:
    """A charge has to stay low for some time."""
    rig = standing()
    rig.ask('walk')
    rig.battery = 0.05
    rig.run(1.0, FORWARD)
    rig.battery = 0.5
    rig.run(0.1, FORWARD)
    rig.battery = math.nan  # unknown
    rig.run(4.0, FORWARD)
    assert rig.controller.status.battery == 0.5
    assert rig.is_in(State.WALK)


def test_the_stronger_reaction_prevails() -> None:
    """A robot that falls while it lies down for its battery stops moving at once."""
    rig = standing()
    rig.battery = 0.01
    rig.run(3.3)
    assert rig.is_in(State.FAULT)
    rig.imu = tilted(1.2)
    rig.run(0.3)
    held = rig.positions
    rig.run(1.0)
    assert rig.positions == held
    assert len(rig.controller.status.faults) == 2


def test_measurements_that_are_no_numbers_count_as_missing() -> None:
    """NaN joints hold and fault like silence, and are named."""
    rig = standing()
    bad = RobotState(JointSample((math.nan,) * 12, (0.0,) * 12), UPRIGHT)
    for _ in range(40):
        output = rig.controller.step(bad, PERIOD)
        assert output.targets == rig.positions
    assert rig.is_in(State.FAULT)
    assert rig.controller.status.refused == 40


def test_other_joints_stay_where_they_are_or_go_where_commanded() -> None:
    """An arm is left alone unless it was given a pose."""
    for arm_pose, expected in (((), 0.4), ((-1.0,), -1.0)):
        controller = Controller(ARM_ROBOT, GaitParameters(), StateParameters(), arm_pose=arm_pose)
        rig = standing(Rig(controller, (*FOLDED, 0.4)))
        rig.ask('walk')
        rig.run(1.0, FORWARD)
        assert rig.positions[12] == pytest.approx(expected)
    with pytest.raises(ParameterError, match='arm_yaw_joint'):
        Controller(ARM_ROBOT, GaitParameters(), StateParameters(), arm_pose=(1.0, 2.0))


@pytest.mark.parametrize('walks', [False, True])
def test_a_policy_that_fails_is_replaced_by_the_gait(walks: bool) -> None:
    """Two bad answers are bridged, three in a row end it, without a jump and with the reason."""
    rig, policy = policy_rig(policy_fallback_walks=walks)
    standing(rig).ask('policy')
    rig.until(State.POLICY)
    rig.run(1.0, FORWARD)
    policy.targets = None
    rig.run(2 * PERIOD, FORWARD)
    assert rig.is_in(State.POLICY)
    rig.run(2.0, FORWARD)
    assert rig.is_in(State.WALK if walks else State.STAND)
    assert 'the policy was given up: broken on purpose' in rig.log


def test_an_attitude_whose_signs_nobody_knows_is_not_acted_upon() -> None:
    """It levels nothing, holds no heading and leads no policy; a fall is a fall all the same."""
    turned = ImuSample((0.1, 0.0, 0.3, 0.9487), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
    ends = []
    for imu in (turned, replace(turned, deviation=1.57), None):
        rig = standing(policy_rig(require_imu=False)[0])
        rig.imu = imu
        rig.ask('walk')
        rig.run(2.0, FORWARD)
        ends.append(rig.positions)
        warnings = [
            text for text in rig.controller.status.warnings if 'orientation_covariance' in text
        ]
        uncertain = imu is not None and imu.is_uncertain
        assert bool(warnings) == uncertain
        assert rig.controller.set_mode('policy').accepted is not uncertain
    level, unchecked, without = ends
    assert unchecked == without
    assert unchecked != level
    rig = standing()
    rig.imu = replace(tilted(1.2), deviation=1.57)
    rig.run(0.3)
    assert rig.is_in(State.FAULT)


wild = st.floats(allow_nan=True, allow_infinity=True)
moments = st.fixed_dictionaries(
    {
        'mode': st.sampled_from([*MODES, 'nonsense', None, None, None]),
        'clear': st.booleans(),
        'velocity': st.none() | st.builds(Velocity, wild, wild, wild)
        | st.builds(Velocity, *[st.floats(-2, 2)] * 3),
        'pose': st.none() | st.builds(BodyPose, *[st.floats(-0.5, 0.5)] * 6),
        'joints': st.sampled_from(['follow', 'follow', 'follow', 'none', 'nan', 'blocked']),
        'imu': st.sampled_from([UPRIGHT, UPRIGHT, UPRIGHT, None, tilted(0.3), tilted(1.5)]),
        'battery': st.none() | st.floats(0.0, 1.0),
        'policy': st.sampled_from([STAND, STAND, None, FOLDED, (5.0,) * 12]),
        'dt': st.sampled_from([PERIOD] * 5 + [0.0, 0.001, 0.1, 1.0]),
        'steps': st.integers(1, 40),
    }
)  # fmt: skip


def apart(one: Targets, other: Targets | None) -> float:
    """Return how far the farthest joint is from another place [rad]."""
    return max((abs(a - b) for a, b in zip(one, other or (), strict=False)), default=math.inf)


@settings(max_examples=60)
@given(script=st.lists(moments, min_size=1, max_size=12))
def test_no_sequence_of_events_makes_a_target_jump(script: list[dict[str, object]]) -> None:
    """Whatever is asked and measured, targets are finite, in range, and bounded in their step."""
    rig, policy = policy_rig()
    controller = rig.controller
    rig.run(0.1)
    positions = previous = rig.positions
    begins_anew, lost, unseen = False, False, 0.0
    seen: Targets | None = None
    for moment in script:
        policy.targets = moment['policy']  # type: ignore[assignment]
        if moment['mode'] is not None:
            controller.set_mode(str(moment['mode']))
        if moment['clear']:
            controller.clear_fault()
        if moment['pose'] is not None:
            controller.set_body_pose(moment['pose'])  # type: ignore[arg-type]
        dt = float(moment['dt'])  # type: ignore[arg-type]
        for _ in range(int(moment['steps'])):  # type: ignore[call-overload]
            if moment['velocity'] is not None:
                controller.set_velocity(moment['velocity'])  # type: ignore[arg-type]
            measured = {
                'follow': previous, 'blocked': positions, 'nan': (math.nan,) * 12, 'none': None,
            }[str(moment['joints'])]  # fmt: skip
            joints = JointSample(measured, (0.0,) * 12) if measured is not None else None
            measurement = RobotState(joints, moment['imu'], moment['battery'])  # type: ignore[arg-type]
            holds = controller.status.state in {State.RELAX, State.FAULT, State.LIE}
            targets = controller.step(measurement, dt).targets
            unseen += dt
            lost = lost or unseen > StateParameters().hold_age
            if targets is None:
                assert begins_anew or dt > 0.5 or (lost and holds)
                begins_anew |= dt > 0.5 and not controller._unseen.is_pending
                seen = measured
                continue
            # what is requested then may move them in the same step
            found = lost and holds and measured == seen
            found = found and apart(targets, measured) < apart(targets, previous)
            if begins_anew or found:  # after a pause of its own or of theirs, where joints are
                assert measured is not None
                previous, begins_anew = measured, False
            unseen *= measured in {None, (math.nan,) * 12}
            seen, lost = measured, lost and not found
            for target, before, limits in zip(targets, previous, ROBOT.limits, strict=True):
                assert limits.lower <= target <= limits.upper
                assert abs(target - before) <= limits.velocity * min(dt, 1.5 * PERIOD) + 1e-9
            previous = targets


def test_stop_ends_whatever_walks_at_any_time() -> None:
    """Gait, policy and what is on its way to one; it says what, and needs no second call."""
    rig = Rig()
    assert rig.controller.stop() == Answer(True, 'nothing walks: relax')
    rig.step()
    rig.ask('walk')
    assert 'stopped: relax; the mode is relax' in rig.controller.stop().message
    rig.run(1.0, FORWARD)
    assert rig.is_in(State.RELAX), 'it does not even stand up'
    rig.ask('walk')
    rig.until(State.WALK)
    rig.run(1.0, FORWARD)
    assert rig.controller.status.velocity.x > 0.05
    assert 'stopped: walk; the mode is stand' in rig.controller.stop().message
    rig.run(3.0, FORWARD)
    assert rig.controller.status.title == 'stand', 'whoever goes on to command a velocity'
    assert rig.controller.stop().message == 'nothing walks: stand'
    rig.ask('walk')
    rig.run(0.1)
    assert rig.controller.status.velocity.at_rest, 'no velocity of before'
    rig.until(State.WALK)
    rig.imu = tilted(1.2)
    rig.run(0.5)
    assert rig.controller.stop().message.startswith('nothing walks: fault: ')
    policy = StillPolicy(STAND)
    rig = Rig(Controller(ROBOT, GaitParameters(), StateParameters(), policy=policy))
    rig.step()
    rig.ask('policy')
    rig.until(State.POLICY)
    assert 'stopped: policy' in rig.controller.stop().message
    rig.until(State.STAND)


# --- from every fault there is a way down, which needs only what still works


def lies(rig: Rig) -> bool:
    """Return whether all legs are folded."""
    return all(abs(foot[2] - LYING_FOOT) < 1e-4 for foot in ROBOT.feet(rig.positions))


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
    rig, policy = policy_rig()
    standing(rig).ask(mode)
    rig.run(duration, FORWARD)
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
    rig = walking()
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
    rig = walking()
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
    rig = walking(mode='stand')
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
