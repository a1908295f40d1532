# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Goals of a gripper: a pause is no stall, an end is an end, and the newest goal counts."""

from __future__ import annotations

from dataclasses import replace
import math
from types import SimpleNamespace
from typing import Any

import pytest
from sensor_msgs.msg import JointState
from servo_commands import Drives, PERIOD
from servo_nodes import GoalNode

from arm_model import CommandError
from arm_servo import PauseRequest, SpeedRequest
from arm_servo.controllers.controller import Source
from arm_servo.ros import gripper as controller
from arm_servo.ros import motion_goals
from arm_servo.ros.gripper import GripperController, GripperParameters, PARALLEL, SINGLE

pytestmark = pytest.mark.slow

JOINT = 'panda_joint1'


class Gripper:
    """The controller without ROS, of drives that stand still where they are blocked."""

    def __init__(self, clock: Any, *, allow_stalling: bool = False) -> None:
        self.drives = Drives().following()  # the drives
        clock.monotonic = lambda: self.drives.now
        self.node = clock.node
        self._goals: dict[str, Any] = {}
        parameters = GripperParameters(0.002, 0.001, 1.0, allow_stalling)
        GripperController(self.node, self.drives.gateway, parameters, lambda: None)

    @property
    def ended(self) -> dict[str, str]:
        """How the goals ended, by their names."""
        return {name: goal.ending for name, goal in self._goals.items() if goal.ending}

    @property
    def position(self) -> float:
        """Where the joint is commanded to be in [rad]."""
        return float(self.drives.path[-1][0])

    def send(self, name: str, position: float, *, effort: bool = False) -> Any:
        """Send a goal; return its handle."""
        command = JointState(name=[JOINT], position=[position], velocity=[0.1])
        command.effort = [5.0] * effort
        self._goals[name] = self.node.send(PARALLEL.action.Goal(command=command))
        return self._goals[name]

    def run(
        self,
        duration: float,
        *,
        blocked: bool = False,
        has_speeds: bool = True,
        drift: float = 0.0,  # measured velocity whatever is commanded in [rad/s]
    ) -> None:
        """Advance the time by a duration in [s]."""
        before = list(self.drives.axes)
        for _ in range(round(duration / PERIOD)):
            self.drives.run()
            if blocked:
                self.drives.axes = [
                    replace(now, position=was.position, velocity=0.0)
                    for now, was in zip(self.drives.axes, before, strict=True)
                ]
            elif drift or not has_speeds:
                self.drives.axes = [replace(each, velocity=drift) for each in self.drives.axes]
            self.node.watch()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Give the controller the clock of the drives, and a node."""
    made = SimpleNamespace(monotonic=lambda: 0.0, node=GoalNode(monkeypatch))
    monkeypatch.setattr(controller, 'time', made)
    monkeypatch.setattr(motion_goals, 'time', made)
    return made


@pytest.mark.parametrize('allow_stalling', [False, True])
def test_a_goal_that_is_held_does_not_stall(clock: Any, allow_stalling: bool) -> None:
    """By a pause or by the speed override: it goes on afterwards, and is reached.

    Joint states of other drivers may have no velocities; blocked, it stalls as with them.
    """
    gripper = Gripper(clock, allow_stalling=allow_stalling)
    gateway = gripper.drives.gateway
    gripper.send('goal', 0.2)
    gripper.run(0.5)
    for hold, go_on in (
        (PauseRequest(), PauseRequest(is_paused=False)),
        (SpeedRequest(0.0), SpeedRequest(1.0)),
    ):
        gateway.command(hold)
        gripper.run(3.0)
        assert not gripper.ended
        gateway.command(go_on)
        gripper.run(0.3, has_speeds=False)
    gripper.run(3.0, has_speeds=False)
    assert gripper.ended == {'goal': 'succeeded'}
    assert gripper.position == pytest.approx(0.2)
    gripper.send('blocked', 1.0)
    gripper.run(2.0, blocked=True)
    assert gripper.ended['blocked'] == ('succeeded' if allow_stalling else 'aborted')


@pytest.mark.parametrize('end', ['canceled', 'aborted', 'succeeded', 'taken over'])
@pytest.mark.parametrize('goal', [0.05, 1.0])
def test_the_drive_holds_where_it_is_once_a_goal_has_ended(
    clock: Any, end: str, goal: float
) -> None:
    """It is blocked, and does not push on towards the place of the last set-point.

    Where a stall is a success it does: something is held by that. A goal right after a cancel
    is not taken back for it. Set-points that are there already make no cancel a success.
    """
    gripper = Gripper(clock, allow_stalling=end == 'succeeded')
    begin = gripper.position
    handle = gripper.send('goal', goal)
    gripper.run(0.8, blocked=True)
    assert gripper.position > begin + 0.02
    if end in {'canceled', 'taken over'}:
        gripper.node.cancel(handle)
    if end == 'taken over':
        gripper.send('new', 0.2)
        gripper.run(5.0)
        assert gripper.ended == {'goal': 'canceled', 'new': 'succeeded'}
        assert gripper.position == pytest.approx(0.2, abs=1e-6)
        return
    gripper.run(2.0, blocked=True)
    assert gripper.ended == {'goal': end}
    if end != 'succeeded':
        assert gripper.position == pytest.approx(begin, abs=1e-6)
    elif goal < 0.1:
        assert gripper.position == pytest.approx(goal, abs=1e-6)


@pytest.mark.parametrize('end', ['canceled', 'aborted'])
def test_a_goal_is_answered_when_rest_was_seen(clock: Any, end: str) -> None:
    """Of the set-points: neither a cancel nor a stall is an end before that."""
    gripper, is_stalled = Gripper(clock), end == 'aborted'
    handle = gripper.send('goal', 1.0)
    gripper.run(0.9 if is_stalled else 0.5, blocked=is_stalled)
    if not is_stalled:
        gripper.node.cancel(handle)
    braking = 0
    while not gripper.ended:
        gripper.run(PERIOD, blocked=is_stalled)
        point = gripper.drives.gateway.snapshot.set_point
        assert point is not None
        is_braking = point.source is Source.NONE and point.state.moving
        assert not (is_braking and gripper.ended)
        braking += is_braking
    assert gripper.ended == {'goal': end}
    assert braking


def test_jaws_that_move_on_delay_the_answer_and_are_named_in_the_log(clock: Any) -> None:
    """Ten seconds after the cancel, during which they have not come to rest."""
    gripper = Gripper(clock)
    handle = gripper.send('goal', 1.0)
    gripper.run(0.5, drift=0.1)
    gripper.node.cancel(handle)
    for second in range(12):
        assert bool(gripper.ended) == (second > 10)
        gripper.run(1.0, drift=0.1)
    assert gripper.ended == {'goal': 'canceled'}
    assert 'not seen at rest for 10 s' in gripper.node.logged[-1]


@pytest.mark.parametrize('allow_stalling', [False, True])
def test_a_newer_goal_ends_the_one_before(clock: Any, allow_stalling: bool) -> None:
    """As aborted and at once, also where the gripper passes its place or stalls later."""
    gripper = Gripper(clock, allow_stalling=allow_stalling)
    gripper.send('old', 0.2)
    gripper.run(0.5)
    gripper.send('new', 0.3)
    gripper.run(0.2)
    assert gripper.ended == {'old': 'aborted'}
    gripper.run(5.0)
    assert gripper.ended == {'old': 'aborted', 'new': 'succeeded'}


@pytest.mark.parametrize(
    ('names', 'positions', 'velocities', 'words'),
    [
        (['a'], [0.1], [math.nan], 'velocity nan'),
        (['a'], [0.1], [-0.1], 'velocity -0.1'),
        (['a', 'a'], [0.1, 0.2], [], "'a' is named twice"),
        (['a'], [math.inf], [], 'inf is no position'),
        (['c'], [0.1], [], "no joint 'c'"),
        (['a'], [0.1, 0.2], [], '2 positions'),
    ],
)
def test_a_goal_with_wrong_numbers_is_refused(
    names: list[str], positions: list[float], velocities: list[float], words: str
) -> None:
    """A speed that is no number is not taken for none."""
    command = SimpleNamespace(name=names, position=positions, velocity=velocities)
    with pytest.raises(CommandError, match=words):
        PARALLEL.request(SimpleNamespace(command=command), ['a', 'b'])


@pytest.mark.parametrize('effort', [False, True])
def test_an_effort_is_warned_of_once(clock: Any, effort: bool) -> None:
    """By both actions; it limits nothing, the object that does is named. 0 is none."""
    gripper = Gripper(clock)
    gripper.send('goal', 0.03, effort=effort)
    gripper.run(2.0)
    gripper.send('next', 0.02, effort=effort)
    gripper.run(2.0)
    assert gripper.ended == {'goal': 'succeeded', 'next': 'succeeded'}
    assert ['0x6072' in text for text in gripper.node.logged] == [True] * effort
    single, parallel = SINGLE.action.Goal(), PARALLEL.action.Goal()
    single.command.max_effort = 5.0 * effort
    parallel.command.effort = [0.0, 5.0 * effort]
    assert SINGLE.asks_effort(single) is PARALLEL.asks_effort(parallel) is effort
