# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Two arms that move at the same time stay apart, whatever each is asked to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from functools import cache
import math

import core_commands
from core_commands import ending, goal_to
import numpy as np
import pytest

import arm_model
from arm_servo import MotionCore, Outcome, SetPoint
from arm_servo.core.safety_filter import MovingArms, SafetyFilter
from arm_trajectory import GoalCode, OnlineTrajectoryGenerator

PERIOD = 0.01
CLEARANCE = 0.005
"""What jogs keep from other links by default, and all else from arms that move, in [m]."""
TOLERANCE = 2e-4
ARMS = {'left': ('left_1', 'left_2'), 'right': ('right_1', 'right_2')}
OUT = (0.9, 0.0)  # away from the other arm


def _joint(name: str, parent: str, xyz: str) -> str:
    return (
        f'<link name="{name}_link"><collision><origin xyz="0.15 0 0"/><geometry>'
        f'<box size="0.3 0.04 0.04"/></geometry></collision></link><joint name="{name}" '
        f'type="revolute"><parent link="{parent}"/><child link="{name}_link"/>'
        f'<origin xyz="{xyz}"/><axis xyz="0 0 1"/>'
        '<limit lower="-2.5" upper="2.5" velocity="2" effort="1"/></joint>'
    )


@cache
def texts() -> tuple[str, str]:
    """Return two arms of two joints that meet in one plane."""
    joints = [
        _joint(name, f'{side}_1_link' if number else 'base', '0.32 0 0' if number else place)
        for side, place in (('left', '0 0.35 0'), ('right', '0 -0.35 0'))
        for number, name in enumerate(ARMS[side])
    ]
    chains = {
        side: f'<chain base_link="base" tip_link="{names[-1]}_link"/>'
        for side, names in ARMS.items()
    }
    groups = ''.join(f'<group name="{side}">{chain}</group>' for side, chain in chains.items())
    groups += ''.join(f'<group name="{n}"><joint name="{n}"/></group>' for n in ARMS['right'])
    both = '<group name="both"><group name="left"/><group name="right"/></group>'
    touching = ''.join(
        f'<disable_collisions link1="{one}_link" link2="{other}_link"/>'
        for one, other in ARMS.values()
    )
    return (
        f'<robot name="two"><link name="base"/>{"".join(joints)}</robot>',
        f'<robot name="two">{groups}{both}{touching}</robot>',
    )


def model(group: str, others: Mapping[str, Sequence[str]] | None = None) -> arm_model.RobotModel:
    """Return one arm, or both."""
    names = [name for arm in ARMS.values() for name in arm]
    limits = {name: {'max_acceleration': 5.0, 'max_jerk': 50.0} for name in names}
    return arm_model.RobotModel(*texts(), limits, group, moved_by_others=others)


class Pair:
    """Both arms, each under a core of its own."""

    def __init__(self, left: Sequence[float] = OUT, right: Sequence[float] = OUT) -> None:
        self.cores = {
            'left': MotionCore(model('left', {'right': ARMS['right']})),
            'right': MotionCore(model('right', {'left': ARMS['left']})),
        }
        # what they know of each other
        self.moving = MovingArms([core.model for core in self.cores.values()])
        self._whole = model('both')
        assert self._whole.joints == (*ARMS['left'], *ARMS['right'])
        for core in self.cores.values():
            core.keep_apart(self.moving.neighbours(core.model.joints))
        self.cores['left'].reset(left)
        self.cores['right'].reset([-place for place in right])
        self.points: dict[str, SetPoint] = {}  # the last of each
        self.now = 10.0  # steady time in [s]
        self.nearest = math.inf  # least distance of the two so far in [m]

    def jog(self, side: str, *velocities: float) -> None:
        """Jog the joints of an arm from now on, for a minute at most."""
        velocities_of = dict(zip(ARMS[side], velocities, strict=True))
        core_commands.jog(self.cores[side], velocities_of, self.now, 60.0)

    def go(self, side: str, positions: Sequence[float], seconds: float) -> None:
        """Make an arm follow a trajectory."""
        core_commands.follow(self.cores[side], goal_to(self.cores[side], positions, seconds))

    def at(self, side: str) -> arm_model.Array:
        """Return where an arm is commanded to be."""
        return self.cores[side].state.position

    def distance(self) -> float:
        """Return the distance of the two arms where they are, by all shapes of the robot."""
        return self._whole.clearance(np.concatenate([self.at('left'), self.at('right')]))

    def run(self, seconds: float) -> None:
        """Advance the time."""
        for _ in range(round(seconds / PERIOD)):
            for side, core in self.cores.items():
                self.points[side] = core.step(self.now, PERIOD)
            self.now += PERIOD
            self.nearest = min(self.nearest, self.distance())

    def named(self, side: str) -> str:
        """Return what limits an arm."""
        return str(self.points[side].report)

    def ending(self, side: str) -> Outcome:
        """Return how the trajectory of an arm has ended."""
        execution = self.cores[side].execution
        assert execution is not None
        return ending(execution)

    def met(self) -> bool:
        """Return whether both stand, as near as they may."""
        stand = not any(core.state.moving for core in self.cores.values())
        return stand and self.nearest >= CLEARANCE - TOLERANCE


def test_jogs_towards_each_other_stop_and_may_part() -> None:
    """Both name the pair; neither touches; away from each other they go at once."""
    pair = Pair()
    pair.jog('left', -0.8, 0.0)
    pair.jog('right', 0.8, 0.0)
    pair.run(4.0)
    assert pair.met()
    assert pair.nearest < 0.03
    for side in ARMS:
        assert 'collision: ' in pair.named(side)
        assert {'left', 'right'} <= {word.split('_')[0] for word in pair.named(side).split()}
    begin = pair.at('left').copy()
    pair.jog('left', 0.8, 0.0)
    pair.run(0.5)
    assert pair.at('left')[0] > begin[0] + 0.2
    assert pair.named('left') == 'free'


@pytest.mark.parametrize('is_target', [False, True])
def test_motions_towards_each_other_end_before_they_touch(is_target: bool) -> None:
    """Trajectories with the pair, at least one of them; single targets as well."""
    pair = Pair(right=(0.1, 0.0) if is_target else OUT)
    if is_target:
        core_commands.move_to(pair.cores['left'], {'left_1': -0.9})
        pair.jog('right', 0.8, 0.0)
    else:
        pair.go('left', [-0.9, 0.0], 2.0)
        pair.go('right', [0.9, 0.0], 2.0)
    pair.run(4.0)
    assert pair.met()
    assert pair.at('left')[0] > -0.8
    if not is_target:
        endings = [pair.ending(side) for side in ARMS]
        ended = [each for each in endings if each.code is GoalCode.PATH_TOLERANCE_VIOLATED]
        assert ended, endings
        for each in ended:
            assert all(word in each.reason for word in ('left_', 'right_', 'to another arm'))


def test_a_trajectory_behind_an_arm_that_gives_way_is_not_held_up() -> None:
    """What counts is where the other is at the same time, not where it was."""
    pair = Pair(left=(-0.2, 0.0), right=(0.6, 0.0))
    assert pair.distance() > 0.0
    pair.go('left', [0.9, 0.0], 2.0)
    pair.go('right', [0.2, 0.0], 2.0)
    pair.run(3.0)
    assert [pair.ending(side).code for side in ARMS] == [GoalCode.SUCCESSFUL] * 2
    assert pair.at('right')[0] == pytest.approx(0.2, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(4))
def test_arms_that_are_moved_at_random_never_touch(seed: int) -> None:
    """By jogs and trajectories that change in the middle of each other."""
    rng = np.random.default_rng(seed)
    pair = Pair(left=(0.5, 0.0), right=(0.5, 0.0))
    held_up = 0
    for _ in range(10):
        for side, inwards in (('left', -1.0), ('right', 1.0)):
            if rng.random() < 0.7:
                pair.jog(side, inwards * rng.uniform(-0.8, 2.0), rng.uniform(-2.0, 2.0))
            else:
                with suppress(arm_model.ArmError):  # too fast from where it is
                    pair.go(side, [inwards * rng.uniform(-0.2, 1.2), rng.uniform(-1, 1)], 1.5)
        for _ in range(rng.integers(1, 6)):
            pair.run(0.1)
            held_up += any('collision: ' in pair.named(side) for side in ARMS)
    assert held_up  # they did meet
    assert pair.nearest >= CLEARANCE - TOLERANCE


def test_an_arm_of_which_nothing_is_known_does_not_hold_up_the_others() -> None:
    """What else it would move is left out, and nothing else."""
    arms = [model(group) for group in ('left', 'right_1', 'right_2')]
    moving = MovingArms(arms)
    left, *others = (moving.neighbours(arm.joints) for arm in arms)
    stop = OnlineTrajectoryGenerator(arms[0].limits).brake(
        arm_model.RobotState.at_rest(np.array([-0.3, 0]))
    )
    assert stop is not None
    for other, place, link in zip(
        others, (0.3, 0.0), ('right_1_link', 'right_2_link'), strict=True
    ):
        other.stands(arm_model.RobotState.at_rest(np.array([place])))
        assert set(left.least(stop, 0.0, 1.0).links) == {'left_2_link', link}


@pytest.mark.parametrize('is_known', [True, False])
def test_an_arm_whose_drives_others_have_counts_where_it_is(is_known: bool) -> None:
    """Also while these move it; an arm whose place is not known does not count."""
    pair = Pair()
    left, right = pair.cores['left'], pair.cores['right']
    pair.jog('left', -0.8, 0.0)
    for cycle in range(300):
        place = arm_model.RobotState.at_rest(np.array([0.2 + 0.001 * cycle, 0.0]))
        right.abandon('', place if is_known else None)
        point = left.step(pair.now, PERIOD)
        pair.now += PERIOD
    assert ('right_' in str(point.report)) == is_known
    assert left.state.moving != is_known


def test_what_an_arm_holds_counts() -> None:
    """It is named, and kept from the other arm."""
    pair = Pair()
    end = arm_model.Pose(np.eye(3), np.array([0.28, 0.0, 0.0]))
    held = arm_model.CollisionObject('bar', arm_model.Box(0.04, 0.3, 0.04), pose=end)
    body = arm_model.AttachedBody(held, 'left_2_link', frozenset({'left_1_link'}))
    arm = pair.cores['left'].model
    pair.moving.use_scene(arm.scene.with_allowed(arm.allowed).with_attached(body))
    pair.jog('left', -0.8, 0.0)
    pair.jog('right', 0.8, 0.0)
    pair.run(4.0)
    assert 'bar' in pair.named('left') or 'bar' in pair.named('right')
    assert pair.nearest > 0.03


class NearArm:
    """Another arm that is always so far away, whatever one does, in [m]."""

    version = 0

    def __init__(self, distance: float) -> None:
        self.lock, self._distance = nullcontext(), distance
        self.stops = self.stands = lambda *_: None

    def least(self, _stop: object, _begin: float, within: float) -> arm_model.LeastClearance:
        """Return the distance, if it is of interest."""
        return arm_model.LeastClearance(
            min(self._distance, within), ('left_2_link', 'right_2_link')
        )


@pytest.mark.parametrize(('distance', 'passes'), [(1.0, True), (0.05, False)])
def test_near_another_arm_a_path_is_left_only_where_that_is_clear(
    distance: float, passes: bool
) -> None:
    """A path may bend around a box; a stop for the other arm goes straight on, into it."""
    arm = model('left')
    pose = arm_model.Pose(np.eye(3), np.array([0.0, 0.85, 0.0]))
    box = arm_model.CollisionObject('box', arm_model.Box(0.1, 0.1, 0.1), pose=pose)
    arm.use_scene(arm_model.Clearances(arm.scene.with_object(box)))
    safety = SafetyFilter(arm, OnlineTrajectoryGenerator(arm.limits))
    safety.keep_apart(NearArm(distance))  # type: ignore[arg-type]
    at, speed = np.array([1.3, 0.0]), np.array([1.5, 0.0])
    assert arm.clearance(at) > 0.01
    state = arm_model.RobotState(
        at, 0.3 * speed, np.zeros(2)
    )  # its stop is clear, that behind a step not
    safety.reset(arm_model.RobotState.at_rest(at))
    wanted = arm_model.RobotState(at + speed * PERIOD, speed, np.zeros(2))
    after, limiter = safety.step(state, wanted, PERIOD, None, apart=CLEARANCE)
    assert (after is wanted) is (limiter is None) is passes
