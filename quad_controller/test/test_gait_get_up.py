# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The mode get_up: when it is possible, what it does, and what it says when it gives up."""

from __future__ import annotations

from dataclasses import replace
import math
import re

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from quad_controller import Controller, GaitParameters, State, StateParameters
from quad_controller.states.get_up import (
    BLIND_DEADLINE,
    Lying,
    lying_on,
    MAX_TRIES,
    RECOVERIES,
    Stage,
)
from quad_description import ImuSample, PRESETS, quadruped, robot_urdf
from quad_description.rotations import about, from_rpy, Quaternion, rotate
from quad_gait_rig import ARM_ROBOT, FOLDED, PERIOD, Rig, ROBOT, STAND, tilted, UPRIGHT

QUARTER = math.pi / 2
ATTITUDES: dict[Lying, Quaternion] = {
    Lying.BELLY: (0.0, 0.0, 0.0, 1.0),
    Lying.LEFT: about((1.0, 0.0, 0.0), -QUARTER),
    Lying.RIGHT: about((1.0, 0.0, 0.0), QUARTER),
    Lying.NOSE: about((0.0, 1.0, 0.0), QUARTER),
    Lying.TAIL: about((0.0, 1.0, 0.0), -QUARTER),
    Lying.BACK: about((1.0, 0.0, 0.0), math.pi),
}
MAX_DURATION = 200.0  # [s] that all tries together may take
SWINGING = StateParameters(get_up_swings=True)


def lying(side: Lying) -> ImuSample:
    """Return the attitude of a body that lies still on a side."""
    return replace(UPRIGHT, orientation=ATTITUDES[side])


def fallen(side: Lying, controller: Controller | None = None) -> Rig:
    """Return a robot that fell while it stood, and lies on a side."""
    rig = Rig(controller or Controller(ROBOT, GaitParameters(), SWINGING))
    rig.step()
    rig.ask('stand')
    rig.until(State.STAND)
    rig.imu = lying(side)
    rig.until(State.FAULT)
    return rig


def joints_of(stage: Stage) -> list[float]:
    """Return the targets of all joints of a stage."""
    return [angle for leg in stage.legs for angle in leg]


def gives_up(rig: Rig) -> str:
    """Run a robot until it gives up; return the fault."""
    for _ in range(round(MAX_DURATION / PERIOD)):
        rig.step()
        if rig.is_in(State.FAULT):
            return rig.controller.status.faults[0]
    raise AssertionError(f'it tries for ever; {rig.log}')


angles = st.floats(-math.pi, math.pi)


@given(roll=angles, pitch=angles, yaw=angles)
def test_left_and_right_are_mirror_images(roll: float, pitch: float, yaw: float) -> None:
    """And the heading does not matter; each attitude has a side within 55 degrees of down."""
    down = ImuSample(from_rpy(roll, pitch, yaw), None, None).down
    mirrored = ImuSample(from_rpy(-roll, pitch, 0.0), None, None).down
    ranked = sorted(map(abs, down))
    if ranked[2] - ranked[1] > 1e-6:  # on the edge between two sides it may be either
        assert lying_on(mirrored) is lying_on(down).mirrored
    below = {
        Lying.BELLY: (0.0, 0.0, -1.0), Lying.BACK: (0.0, 0.0, 1.0), Lying.LEFT: (0.0, 1.0, 0.0),
        Lying.RIGHT: (0.0, -1.0, 0.0), Lying.NOSE: (1.0, 0.0, 0.0), Lying.TAIL: (-1.0, 0.0, 0.0),
    }[lying_on(down)]  # fmt: skip
    assert sum(a * b for a, b in zip(below, down, strict=True)) >= 1 / math.sqrt(3) - 1e-9
    world = rotate(from_rpy(roll, pitch, yaw), below)
    assert world[2] <= -1 / math.sqrt(3) + 1e-9


def test_recoveries_are_within_the_joints_and_mirrored() -> None:
    """Of every preset."""
    stages = [stage for tried in RECOVERIES.values() for recovery in tried for stage in recovery]
    for preset in PRESETS:
        robot = quadruped(robot_urdf(preset))
        for stage in stages:
            for indices, leg in zip(robot.leg_indices, stage.legs, strict=True):
                for index, angle in zip(indices, leg, strict=True):
                    limits = robot.limits[index]
                    assert limits.lower - 0.006 <= angle <= limits.upper + 0.006
    for side, tried in RECOVERIES.items():
        mirrored = tuple(tuple(stage.mirrored for stage in recovery) for recovery in tried)
        assert side.mirrored is side or mirrored == RECOVERIES[side.mirrored]
    assert all(stage.mirrored.mirrored == stage for stage in stages)


def test_a_robot_that_fell_gets_up_and_stands() -> None:
    """Asking for it clears the fall; it folds its legs when it lies on its belly, and stands."""
    rig = fallen(Lying.LEFT)
    assert 'get_up' in rig.controller.status.faults[0]
    assert not rig.controller.set_mode('stand').accepted
    assert rig.ask('get_up') == 'get_up, coming from fault'
    assert not rig.controller.status.faults
    before = rig.positions
    rig.run(1.5)
    assert rig.is_in(State.GET_UP)
    assert rig.controller.status.title == 'get_up'
    assert rig.positions != before
    rig.imu = UPRIGHT
    rig.until(State.STAND)
    rig.run(2.0)
    assert rig.controller.status.title == 'stand'
    assert rig.positions == pytest.approx(STAND)
    assert any('on its left side' in line for line in rig.log)
    assert rig.largest_step <= 10.0 * 1.5 * PERIOD + 1e-9


@pytest.mark.parametrize('mode', ['relax', 'lie', 'stand', 'walk'])
def test_it_may_be_asked_for_in_any_mode(mode: str) -> None:
    """A robot on its feet stays as it is; one that lies stands up."""
    rig = Rig()
    rig.step()
    rig.ask(mode)
    rig.until(State(mode))
    on_its_feet = mode in {'stand', 'walk'}
    answer = rig.ask('recovery_stand')
    assert answer == (
        f'{mode}: it is on its feet' if on_its_feet else f'get_up, coming from {mode}'
    )
    rig.run(8.0)
    assert rig.controller.status.title == (mode if on_its_feet else 'stand')


def test_on_its_back_it_moves_nothing_unless_that_is_allowed() -> None:
    """Neither at the request, nor when it rolls there while it gets up."""
    rig = fallen(Lying.BACK, Controller(ROBOT, GaitParameters(), StateParameters()))
    held = rig.positions
    answer = rig.controller.set_mode('get_up')
    assert not answer.accepted
    assert 'allow that by the parameter get_up_swings' in answer.message
    rig.run(1.0)
    assert rig.positions == held
    rig.imu = lying(Lying.LEFT)
    rig.step()
    rig.ask('get_up')
    rig.run(1.5)
    rig.imu = lying(Lying.BACK)
    assert 'allow that by the parameter get_up_swings' in gives_up(rig)


@pytest.mark.parametrize('swings', [True, False])
def test_with_an_arm_on_its_back_it_says_so_and_moves_nothing(swings: bool) -> None:
    """With what a person has to do; on its feet again, the fall is cleared."""
    controller = Controller(ARM_ROBOT, GaitParameters(), StateParameters(get_up_swings=swings))
    rig = Rig(controller, FOLDED + (0.0,) * (len(ARM_ROBOT.names) - len(FOLDED)))
    rig.imu = lying(Lying.BACK)
    rig.step()
    held = rig.positions
    answer = controller.set_mode('get_up')
    assert answer.accepted is swings
    words = gives_up(rig) if swings else answer.message
    assert re.search('it lies on its back and its arm.* put it on its feet', words)
    rig.run(2.0)
    assert rig.positions == held
    if not swings:
        return
    rig.imu = UPRIGHT
    rig.step()
    assert rig.controller.clear_fault().message == 'cleared; the mode is relax'


def test_swings_go_on_wherever_the_body_is_and_end_in_rest() -> None:
    """Off the back: what it does next is asked only when the body is at rest behind them."""
    first, *_, last = RECOVERIES[Lying.BACK][0]
    rig = fallen(Lying.BACK)
    rig.ask('get_up')
    while rig.positions != pytest.approx(joints_of(first)):
        rig.step()
    while rig.positions == pytest.approx(joints_of(first)):
        rig.step()
    rig.imu = lying(Lying.TAIL)
    while rig.positions != pytest.approx(joints_of(last)):
        rig.step()
    assert not any(f'lies {Lying.TAIL.value}' in line for line in rig.log)
    rig.run(1.0)
    assert any(f'lies {Lying.TAIL.value}' in line for line in rig.log)


@pytest.mark.parametrize('side', Lying)
def test_it_gives_up_after_some_tries(side: Lying) -> None:
    """It says where it lies, what was tried, and what a person has to do; then it may be asked.

    On its belly, a heap of legs that keeps it askew is no stand.
    """
    if side is Lying.BELLY:
        rig = Rig()
        rig.imu = tilted(0.6)
        rig.step()
    else:
        rig = fallen(side)
    rig.ask('get_up')
    words, tilt = gives_up(rig), {Lying.BACK: 180, Lying.BELLY: 34}.get(side, 90)
    assert f'it lies {side.value}, tilted by {tilt} deg, after {MAX_TRIES} tries' in words
    assert f'({side.value} {MAX_TRIES})' in words
    assert 'by hand' in words
    held = rig.positions
    rig.run(1.0)
    assert rig.positions == held
    rig.ask('get_up')
    rig.run(0.5)
    assert rig.is_in(State.GET_UP)


def test_a_tumbling_robot_is_waited_for() -> None:
    """Nothing moves before the body is at rest, or that takes too long."""
    rig = fallen(Lying.LEFT)
    rig.ask('get_up')
    held = rig.positions
    for step in range(round(2.0 / PERIOD)):
        rig.imu = tilted(-1.5 + 0.3 * (-1) ** step)
        rig.step()
    assert rig.positions == held
    rig.imu = lying(Lying.LEFT)
    rig.run(1.0)
    assert rig.positions != held


@pytest.mark.parametrize('what', ['battery', 'joints', 'imu'])
def test_other_faults_come_first(what: str) -> None:
    """Getting up clears a fall and nothing else; what fails on the way stops the legs."""
    rig = fallen(Lying.LEFT)
    rig.ask('get_up')
    rig.run(1.0)
    if what == 'battery':
        rig.battery = 0.01
    elif what == 'joints':
        rig.joints = False
    else:
        rig.imu = None
    rig.run(3.5)
    assert rig.is_in(State.FAULT)
    held = rig.positions
    rig.run(1.0)
    assert rig.positions == held
    answer = rig.controller.set_mode('get_up')
    assert not answer.accepted
    assert 'clear_fault' in answer.message
    rig.battery, rig.joints, rig.imu = 0.9, True, lying(Lying.LEFT)
    rig.run(1.0)
    assert not rig.controller.set_mode('get_up').accepted
    answer = rig.controller.clear_fault()
    assert not answer.accepted
    assert re.match('cleared .*; still fall: ', answer.message)
    rig.ask('get_up')
    rig.imu = UPRIGHT
    rig.until(State.STAND)


def test_without_a_sound_attitude_it_does_not_begin() -> None:
    """Even where a robot may walk without one; a body that spins tumbles, or its gyro is wrong."""
    controller = Controller(ROBOT, GaitParameters(), StateParameters(require_imu=False))
    rig = Rig(controller)
    rig.imu = None
    rig.run(0.1)
    assert 'attitude' in controller.set_mode('get_up').message
    rig.imu = replace(lying(Lying.LEFT), angular_velocity=(0.0, 0.0, 20.0))
    rig.run(0.1)
    assert 'max_turn_rate' in controller.set_mode('get_up').message
    rig.imu = lying(Lying.LEFT)
    rig.run(0.1)
    rig.ask('get_up')
    rig.run(1.0)
    rig.imu = None
    rig.run(BLIND_DEADLINE + 0.5)
    assert 'how it lies is not measured' in controller.status.faults[0]


def test_stop_ends_it_where_it_is() -> None:
    """No posture is half-way for a robot that lies."""
    rig = fallen(Lying.TAIL)
    rig.ask('get_up')
    rig.run(1.0)
    assert rig.controller.stop().message == 'stopped: get_up; the mode is relax'
    held = rig.positions
    rig.run(1.0)
    assert rig.positions == held
    assert rig.is_in(State.RELAX)


def test_stop_lets_a_robot_stand_whose_legs_bear_it() -> None:
    """Half-way nobody would watch it; a fall is watched again."""
    rig = Rig()
    rig.step()
    rig.ask('get_up')
    for _ in range(round(10.0 / PERIOD)):
        if any('stands up' in line for line in rig.log):
            break
        rig.step()
    assert rig.controller.stop().message == 'stopped: get_up; the mode is stand'
    rig.until(State.STAND)
    rig.imu = lying(Lying.LEFT)
    rig.until(State.FAULT)


@pytest.mark.parametrize('mode', ['stand', 'walk'])
def test_a_robot_on_its_legs_does_not_get_up(mode: str) -> None:
    """Tilted as it may be: a fall is watched as ever, and stops it."""
    rig = Rig()
    rig.step()
    rig.ask(mode)
    rig.until(State(mode))
    rig.run(1.0)
    rig.imu = tilted(0.5)
    rig.run(0.5)
    answer = rig.controller.set_mode('get_up')
    assert not answer.accepted
    assert 'on its legs' in answer.message
    rig.imu = lying(Lying.LEFT)
    rig.run(0.3)
    assert rig.is_in(State.FAULT)


sides = st.sampled_from([*Lying, None])


@settings(max_examples=30)
@given(
    script=st.lists(st.tuples(sides, st.floats(0.05, 3.0)), min_size=1, max_size=12),
    ends=st.sampled_from(['stop', 'lie', 'relax', None]),
)
def test_whatever_it_rolls_to_it_ends(
    script: list[tuple[Lying | None, float]], ends: str | None
) -> None:
    """Standing, or in a fault that says why; targets are bounded and within the limits."""
    rig = fallen(Lying.LEFT)
    rig.ask('get_up')
    for side, duration in script:
        rig.imu = lying(side) if side is not None else None
        rig.run(duration)
        for target, limits in zip(rig.positions, ROBOT.limits, strict=True):
            assert limits.lower - 1e-9 <= target <= limits.upper + 1e-9
    assert rig.largest_step <= 10.0 * 1.5 * PERIOD + 1e-9
    if ends == 'stop':
        rig.controller.stop()
    elif ends is not None:
        rig.ask(ends)
    for _ in range(round(MAX_DURATION / PERIOD)):
        if not rig.is_in(State.GET_UP):
            break
        rig.step()
    rig.run(0.5)
    state = rig.controller.status.state
    assert state in {State.STAND, State.FAULT, State.RELAX, State.LIE}
    assert state is not State.FAULT or rig.controller.status.faults
