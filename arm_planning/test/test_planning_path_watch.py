# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is left of a trajectory when an object enters the scene."""

from __future__ import annotations

from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import numpy as np
from planning_messages import box, panda
import pytest
from trajectory_msgs.msg import JointTrajectory

from arm_model import Array, frozen, RobotState
from arm_model.ros import scene_change
from arm_planning import PlanningCode
from arm_planning.nodes.move_group import contact_ahead, passed_time, PathWatch
from arm_planning.ros.execution import Execution, INVALIDATED
from arm_planning.ros.scene import SceneSnapshot
from arm_planning.ros.scene_changes import apply_scene
from arm_planning.ros.trajectories import from_start, trajectory_message
from arm_trajectory import build_path, GoalPoint, GoalRules, TrajectoryGoal

MODEL = panda().model('panda_arm')
READY = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
TURN = np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
GOAL = TrajectoryGoal(MODEL.joints, [GoalPoint(4.0, READY + TURN)])
PATH = build_path(GOAL, MODEL.limits, RobotState.at_rest(READY), GoalRules()).path
EMPTY = SceneSnapshot(panda().scene)


def places(arm: Array) -> Array:
    """Return where all joints are."""
    return panda().positions(dict(zip(MODEL.joints, arm.tolist(), strict=True)))


def motion(kinds: str = 'va') -> JointTrajectory:
    """Return a turn about the first joint by 2 rad, with velocities and accelerations."""
    trajectory = trajectory_message(MODEL.joints, PATH, 'panda_link0').joint_trajectory
    for point in trajectory.points:
        point.velocities = point.velocities if 'v' in kinds else []
        point.accelerations = point.accelerations if 'a' in kinds else []
    return trajectory


def crate_at(share: float) -> Any:
    """Return the scene with a crate where the tip is at a share of the turn."""
    x, y, z = MODEL.kinematics.link_pose('panda_link8', frozen(READY + share * TURN)).position
    return apply_scene(EMPTY, scene_change(box('crate', x, y, z, edge=0.1)), places(READY)).scene


def test_an_object_ahead_is_seen_and_one_behind_is_not() -> None:
    """The pair is named, and when it would touch."""
    halfway, here = places(PATH.at(0.5 * PATH.duration).position), places(READY)
    ahead, behind = crate_at(0.9), crate_at(0.02)
    assert 'crate' in contact_ahead(motion(), halfway, ahead)
    assert contact_ahead(motion(), halfway, behind) == ''
    assert contact_ahead(JointTrajectory(), halfway, ahead) == ''
    # the last point may lack velocities; a controller may move what no description has
    lacking, wider = motion(), motion()
    lacking.points[-1].velocities = []
    wider.joint_names.append('tool_changer')
    for point in wider.points:
        for row in (point.positions, point.velocities, point.accelerations):
            row.append(0.0)
    for trajectory in (motion(), lacking, wider):
        assert 'crate' in contact_ahead(trajectory, here, ahead)
    for trajectory in (motion(), wider):
        assert contact_ahead(trajectory, here, EMPTY.scene) == ''


def test_what_begins_in_a_scene_that_has_changed_meanwhile_is_stopped() -> None:
    """Also where a look at what had begun before is not done yet."""
    monitor = SimpleNamespace(snapshot=SimpleNamespace(scene=crate_at(0.9)))
    monitor.positions = lambda: places(READY)
    work, stopped = list[tuple[Any, Any]](), list[tuple[Execution, PlanningCode, str]]()
    later = SimpleNamespace(submit=lambda *each: work.append(each))

    def stop(execution: Execution, code: PlanningCode, reason: str) -> None:
        executions.running = [each for each in executions.running if each is not execution]
        stopped.append((execution, code, reason))

    def start() -> Execution:
        execution = Execution(motion(), lambda *_: None, way=motion())
        executions.running = [*executions.running, execution]
        executions.on_start()
        return execution

    def look() -> None:
        while work:
            task, then = work.pop(0)
            done: Future[Any] = Future()
            done.set_result(task())
            then(done)

    executions: Any = SimpleNamespace(running=[], stop=stop)
    PathWatch(monitor, executions, later)  # type: ignore[arg-type]
    started = [start(), start()]
    look()
    assert [each for each, _, _ in stopped] == started
    for _, code, reason in stopped:
        assert code is INVALIDATED
        assert 'crate' in reason
    monitor.snapshot.scene = EMPTY.scene
    start()
    look()
    assert len(stopped) == len(started)


@pytest.mark.parametrize('kinds', ['va', 'v', ''])
def test_the_way_to_the_first_point_counts(kinds: str) -> None:
    """A trajectory of one point is what the controller makes up from where the arm is."""
    trajectory = motion(kinds)
    del trajectory.points[:-1]
    way = from_start(trajectory, READY.tolist())
    assert 'crate' in contact_ahead(way, places(READY), crate_at(0.9))
    assert contact_ahead(way, places(READY), crate_at(-0.2)) == ''


@pytest.mark.parametrize('share', [0.0, 0.3, 1.0])
def test_the_arm_is_found_on_its_path(share: float) -> None:
    """Never before where it is: something in between would not be seen."""
    time = share * PATH.duration
    found = passed_time(PATH, PATH.at(time).position)
    assert time - 0.6 <= found <= time
