# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The trajectory controller: unforeseen goals end with a code; what a pause does, in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from servo_commands import Drives, jog, SteppedWorker
from servo_nodes import GoalNode
from std_srvs.srv import Trigger

from arm_servo import Source, SpeedRequest, StopRequest, TargetRequest
from arm_servo.controllers.controller import Outcome
from arm_servo.ros import motion_goals
from arm_servo.ros import trajectory as controller
from arm_servo.ros.trajectory import TrajectoryAction, TrajectoryPause
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal


def away(drives: Drives, far: float = 0.5, time: float = 5.0) -> TrajectoryGoal:
    """Return a trajectory that moves all joints."""
    there = [axis.setpoint + far for axis in drives.axes]
    return TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(time, there)])


class Bench:
    """Simulated drives, and the node of an action whose goals have trajectories for requests."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.worker = SteppedWorker()
        self.drives = Drives(worker=self.worker).following()
        clock = SimpleNamespace(monotonic=lambda: self.drives.now)
        monkeypatch.setattr(motion_goals, 'time', clock)
        node: Any = GoalNode(monkeypatch)
        self.node: GoalNode = node
        self.request = self.drives.gateway.request
        TrajectoryAction(
            node,
            self.drives.gateway,
            20.0,
            lambda request, number: self.request(request.goal, number=number),
            0.01,
        )

    def send(
        self, far: float = 0.5, time: float = 5.0, meanwhile: Callable[[], object] = lambda: None
    ) -> Any:
        """Send a goal that moves all joints; something happens before it is accepted."""
        goal = away(self.drives, far, time)
        message = SimpleNamespace(goal=goal, trajectory=SimpleNamespace(points=[]))
        return self.node.send(message, meanwhile)

    def run(self, cycles: int) -> None:
        """Run cycles, and prepare what was requested."""
        for _ in range(cycles):
            self.worker.run()
            self.drives.run()

    def on_its_way(self) -> Any:
        """Send a goal, and let it be followed for 100 cycles."""
        goal = self.send()
        self.run(100)
        return goal


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    """An action."""
    return Bench(monkeypatch)


def stumble(*_: object) -> Any:
    """Raise what is not foreseen."""
    raise ZeroDivisionError('no such luck')


@pytest.mark.parametrize('when', ['at the start', 'planned', 'watched', 'at the end'])
def test_an_unexpected_error_is_the_result_of_a_goal(
    monkeypatch: pytest.MonkeyPatch, bench: Bench, when: str
) -> None:
    """Rclpy would answer with code 0, which is SUCCESSFUL, or never; the arm comes to rest.

    It does not leave a callback, where it would end the master and all drives with it. The next
    goal is as ever.
    """
    begin = bench.drives.path[-1][0]
    with monkeypatch.context() as patch:
        if when == 'at the start':
            patch.setattr(bench, 'request', lambda *_, **__: stumble())
        elif when == 'planned':
            patch.setattr(bench.drives.gateway._core, 'plan', stumble)
        goal = bench.on_its_way()
        if when == 'watched':
            goal.publish_feedback = stumble
            bench.node.watch()
            bench.run(1)
            bench.node.watch()
            assert goal.ending == ''  # the arm still brakes
            bench.run(300)
        elif when == 'at the end':
            bench.run(500)
            patch.setattr(Outcome, 'code', property(stumble))
        bench.node.watch()
    assert goal.ending == 'aborted'
    assert goal.result.error_code == GoalCode.INVALID_GOAL
    assert 'ZeroDivisionError: no such luck' in goal.result.error_string
    assert bench.node.logged
    bench.run(300)
    assert bench.drives.gateway.snapshot.source is Source.NONE
    moved = {'watched': 0.4, 'at the end': 0.5}.get(when, 0.0)
    assert begin <= bench.drives.path[-1][0] <= begin + moved + 1e-6
    good = bench.send(0.05, 2.0)
    bench.run(300)
    bench.node.watch()
    assert (good.ending, good.result.error_code) == ('succeeded', GoalCode.SUCCESSFUL)


@pytest.mark.parametrize(
    ('ending', 'rests'), [('canceled', True), ('canceled', False), ('aborted', False)]
)
def test_a_goal_is_answered_when_rest_was_seen(bench: Bench, ending: str, rests: bool) -> None:
    """Drives come to rest later than their set-points; where they do not, the answer says so.

    Of a goal that was canceled, and of one that failed while it was watched.
    """
    goal, drives = bench.on_its_way(), bench.drives
    if ending == 'canceled':
        bench.node.cancel(goal)
    else:
        goal.publish_feedback = stumble
        bench.node.watch()
    drives.run(300)
    drives.axes = [replace(axis, velocity=0.1) for axis in drives.axes]
    drives.run()
    bench.node.watch()
    assert goal.ending == ''
    if rests:
        drives.run()
    else:
        drives.now += 11.0
    bench.node.watch()
    assert goal.ending == ending
    words = 'not seen at rest for 10 s and may still move' in goal.result.error_string
    assert words is not rests


def test_a_stop_between_the_request_of_a_goal_and_its_acceptance_counts(bench: Bench) -> None:
    """The acceptance is delayed for the client."""
    before = bench.drives.path[-1].tolist()
    goal = bench.send(meanwhile=lambda: bench.drives.gateway.command(StopRequest()))
    bench.run(20)
    bench.node.watch()
    assert goal.ending == 'aborted'
    assert 'stopped before it had begun' in goal.result.error_string
    assert bench.drives.path[-1].tolist() == before


def test_a_cancel_in_the_middle_of_the_planning_ends_the_goal(bench: Bench) -> None:
    """As canceled, and nothing moves."""
    before = bench.drives.path[-1].tolist()
    goal = bench.send()
    bench.drives.run(1)
    bench.node.cancel(goal)
    bench.run(20)
    bench.node.watch()
    assert goal.ending == 'canceled'
    assert goal.result.error_code == GoalCode.SUCCESSFUL
    assert bench.drives.path[-1].tolist() == before


BEGIN: dict[str, Callable[[Drives], object]] = {
    'nothing': lambda _: None,
    'jog': lambda drives: jog(drives.gateway, {'panda_joint1': 0.1}, drives.now, 5.0),
    'trajectory': lambda drives: drives.gateway.request(away(drives)),
    'single target': lambda drives: drives.gateway.request(
        TargetRequest({'panda_joint1': 0.5}, 0.1)
    ),
}


@pytest.mark.parametrize(
    ('kind', 'paused', 'resumed'),
    [
        ('nothing', 'nothing is under way', 'takes commands again'),
        ('jog', 'the jog ends', 'takes commands again'),
        ('trajectory', 'the trajectory comes to rest on its path', 'the trajectory goes on'),
        ('single target', 'the single target comes to rest on', 'the single target goes on'),
    ],
)
def test_a_pause_says_what_becomes_of_what_moves_the_arm(
    monkeypatch: pytest.MonkeyPatch, kind: str, paused: str, resumed: str
) -> None:
    """Each answer is of what the arm does at the call; a second call changes nothing."""
    drives, services = Drives().following(), dict[str, Any]()
    monkeypatch.setattr(controller, 'time', SimpleNamespace(monotonic=lambda: drives.now))
    node: Any = SimpleNamespace(
        create_service=lambda _, name, callback: services.update({name: callback})
    )
    TrajectoryPause(node, drives.gateway)

    def call(name: str) -> str:
        answer: Trigger.Response = services[name](None, Trigger.Response())
        drives.run(100)
        assert answer.success
        return str(answer.message)

    BEGIN[kind](drives)
    drives.run(20)
    assert paused in call('~/pause')
    assert not np.ptp(np.array(drives.path[-10:]), axis=0).any()
    assert 'is paused already' in call('~/pause')
    assert resumed in call('~/resume')
    assert 'was not paused' in call('~/resume')
    drives.gateway.command(SpeedRequest(0.0))
    call('~/pause')
    assert 'the speed override is 0' in call('~/resume')
