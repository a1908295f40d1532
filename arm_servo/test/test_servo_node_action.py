# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The trajectory controller: unforeseen goals end with a code; what a pause does, in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from servo_commands import Drives, jog, SteppedWorker
from servo_nodes import GoalNode
from std_srvs.srv import Trigger

from arm_servo import Source, SpeedRequest, StopRequest, TargetRequest
from arm_servo.controllers.controller import Outcome
from arm_servo.core.gateway import MotionCommand
from arm_servo.ros import motion_goals
from arm_servo.ros import trajectory as controller
from arm_servo.ros.trajectory import TrajectoryAction, TrajectoryPause
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal


def action(monkeypatch: pytest.MonkeyPatch, drives: Drives, follow: Any) -> GoalNode:
    """Return the node of an action whose goals have trajectories for requests."""
    node: Any = GoalNode(monkeypatch)
    TrajectoryAction(
        node,
        drives.gateway,
        20.0,
        lambda request, number: follow(request.goal, number=number),
        0.01,
    )
    return cast('GoalNode', node)


def message(goal: object) -> Any:
    """Return a goal message."""
    return SimpleNamespace(goal=goal, trajectory=SimpleNamespace(points=[]))


def on_its_way(monkeypatch: pytest.MonkeyPatch) -> tuple[Drives, GoalNode, Any]:
    """Send a goal in the time of simulated drives, and let them follow it for 100 cycles."""
    drives = Drives().following()
    clock = SimpleNamespace(monotonic=lambda: drives.now)
    monkeypatch.setattr(motion_goals, 'time', clock)
    node = action(monkeypatch, drives, drives.gateway.request)
    there = [axis.setpoint + 0.5 for axis in drives.axes]
    goal = node.send(message(TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(5.0, there)])))
    drives.run(100)
    return drives, node, goal


def test_an_unexpected_error_at_the_start_of_a_goal_is_its_result(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It does not leave the callback, where it would end the master and all drives with it."""

    def follow(_goal: TrajectoryGoal, number: int) -> MotionCommand:
        raise ZeroDivisionError(f'no such luck with {number}')

    node = action(monkeypatch, Drives().following(), follow)
    goal = node.send(message(None))
    assert goal.ending == 'aborted'
    assert goal.result.error_code == GoalCode.INVALID_GOAL
    assert 'ZeroDivisionError' in goal.result.error_string
    assert node.logged


@pytest.mark.parametrize('when', ['at the end', 'while it is watched'])
def test_an_unexpected_error_is_the_result_of_a_goal(
    monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    """Rclpy would answer with code 0, which is SUCCESSFUL, or never; the arm comes to rest."""
    drives = Drives().following()
    node = action(monkeypatch, drives, drives.gateway.request)
    there = [axis.setpoint + 0.5 for axis in drives.axes]
    goal = node.send(message(TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(5.0, there)])))
    if when == 'at the end':
        drives.run(600)
        monkeypatch.setattr(Outcome, 'code', property(lambda _: 1 // 0))
    else:
        drives.run(100)
        monkeypatch.setattr(goal, 'publish_feedback', lambda _: 1 // 0)
        node.watch()
        drives.run()
        node.watch()
        assert goal.ending == ''  # the arm still brakes
        drives.run(300)
    node.watch()
    assert goal.ending == 'aborted'
    assert goal.result.error_code == GoalCode.INVALID_GOAL
    assert 'ZeroDivisionError' in goal.result.error_string
    drives.run(300)
    assert drives.gateway.snapshot.source is Source.NONE
    assert (drives.path[-1][0] < there[0] - 0.1) == (when == 'while it is watched')


def test_the_answer_to_a_goal_whose_arm_moves_on_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """It failed while it was watched, and no cycle comes in which the arm is at rest."""
    drives, node, goal = on_its_way(monkeypatch)
    monkeypatch.setattr(goal, 'publish_feedback', lambda _: 1 // 0)
    node.watch()
    assert goal.ending == ''
    drives.now += 11.0
    node.watch()
    assert goal.ending == 'aborted'
    assert 'not seen at rest for 10 s and may still move' in goal.result.error_string


@pytest.mark.parametrize('rests', [True, False])
def test_a_canceled_goal_is_answered_when_rest_was_seen(
    monkeypatch: pytest.MonkeyPatch, rests: bool
) -> None:
    """Drives come to rest later than their set-points; where they do not, the answer says so."""
    drives, node, goal = on_its_way(monkeypatch)
    node.cancel(goal)
    drives.run(300)
    drives.axes = [replace(axis, velocity=0.1) for axis in drives.axes]
    drives.run()
    node.watch()
    assert goal.ending == ''
    if rests:
        drives.run()
    else:
        drives.now += 11.0
    node.watch()
    assert goal.ending == 'canceled'
    assert ('not seen at rest for 10 s' in goal.result.error_string) is not rests


def test_an_unexpected_error_of_the_planning_is_its_result(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The next goal is planned as ever."""
    drives = Drives().following()
    node = action(monkeypatch, drives, drives.gateway.request)
    there = [axis.setpoint + 0.05 for axis in drives.axes]
    goal = TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(2.0, there)])
    with monkeypatch.context() as patch:
        patch.setattr(drives.gateway._core, 'plan', lambda *_: 1 // 0)
        bad = node.send(message(goal))
        drives.run(5)
        node.watch()
        assert bad.result.error_code == GoalCode.INVALID_GOAL
    good = node.send(message(goal))
    drives.run(300)
    node.watch()
    assert good.ending == 'succeeded'
    assert good.result.error_code == GoalCode.SUCCESSFUL


def test_a_stop_between_the_request_of_a_goal_and_its_acceptance_counts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The acceptance is delayed for the client; the next goal moves the arm again."""
    drives = Drives().following()
    node = action(monkeypatch, drives, drives.gateway.request)
    before = drives.path[-1].tolist()
    there = [axis.setpoint + 0.05 for axis in drives.axes]
    wanted = message(TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(2.0, there)]))
    goal = node.send(wanted, lambda: drives.gateway.command(StopRequest()))
    drives.run(20)
    node.watch()
    assert goal.ending == 'aborted'
    assert 'stopped before it had begun' in goal.result.error_string
    assert drives.path[-1].tolist() == before
    node.send(wanted)
    drives.run(300)
    assert drives.path[-1].tolist() == pytest.approx(there)


def test_a_cancel_in_the_middle_of_the_planning_ends_the_goal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As canceled, and nothing moves."""
    worker = SteppedWorker()
    drives = Drives(worker=worker).following()
    node = action(monkeypatch, drives, drives.gateway.request)
    before = drives.path[-1].tolist()
    there = [axis.setpoint + 0.05 for axis in drives.axes]
    goal = node.send(message(TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(2.0, there)])))
    drives.run(1)
    node.cancel(goal)
    worker.run()
    drives.run(20)
    node.watch()
    assert goal.ending == 'canceled'
    assert goal.result.error_code == GoalCode.SUCCESSFUL
    assert drives.path[-1].tolist() == before


def trajectory(drives: Drives) -> None:
    """Follow a trajectory."""
    there = [axis.setpoint + 0.5 for axis in drives.axes]
    drives.gateway.request(TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(5.0, there)]))


def jogging(drives: Drives) -> None:
    """Jog a joint."""
    jog(drives.gateway, {'panda_joint1': 0.1}, drives.now, 5.0)


def target(drives: Drives) -> None:
    """Move a joint to a place."""
    drives.gateway.request(TargetRequest({'panda_joint1': 0.5}, 0.1))


@pytest.mark.parametrize(
    ('begin', 'paused', 'resumed'),
    [
        (lambda _: None, 'nothing is under way', 'takes commands again'),
        (jogging, 'the jog ends', 'takes commands again'),
        (trajectory, 'the trajectory comes to rest on its path', 'the trajectory goes on'),
        (target, 'the single target comes to rest on its path', 'the single target goes on'),
    ],
)
def test_a_pause_says_what_becomes_of_what_moves_the_arm(
    monkeypatch: pytest.MonkeyPatch, begin: Callable[[Drives], None], paused: str, resumed: str
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

    begin(drives)
    drives.run(20)
    assert paused in call('~/pause')
    assert not np.ptp(np.array(drives.path[-10:]), axis=0).any()
    assert 'is paused already' in call('~/pause')
    assert resumed in call('~/resume')
    assert 'was not paused' in call('~/resume')
    drives.gateway.command(SpeedRequest(0.0))
    call('~/pause')
    assert 'the speed override is 0' in call('~/resume')
