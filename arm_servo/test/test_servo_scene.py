# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A scene reaches jogs, targets and trajectories, and nothing that moves meets what is in it."""

from __future__ import annotations

from concurrent.futures import Executor

from model_robots import ready, robot, table, texts
import numpy as np
import pytest
from servo_commands import Drives, jog, move_by, PERIOD, SteppedWorker

import arm_model
from arm_servo import Source
from arm_servo.core.gateway import MAX_ATTEMPTS, MotionCommand
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

JOINT = 'panda_joint1'


def started(worker: Executor | None = None) -> Drives:
    """Return drives of an arm of its own that follow."""
    return Drives(
        worker=worker, model=arm_model.RobotModel(*texts('panda'), table('panda'))
    ).following()


def box(turned: float, name: str = 'box') -> arm_model.CollisionObject:
    """Return a box where the hand would be with the first joint turned."""
    at = ready('panda').copy()
    at[0] += turned
    return arm_model.CollisionObject(
        name, arm_model.Box(0.1, 0.1, 0.1), pose=robot('panda').pose(at, 'panda_hand')
    )


def use(drives: Drives, *things: arm_model.CollisionObject) -> arm_model.PlanningScene:
    """Use a scene with some objects at once."""
    scene = use_later(drives, *things)
    drives.run()
    assert drives.gateway.model.scene is scene
    return scene


def use_later(drives: Drives, *things: arm_model.CollisionObject) -> arm_model.PlanningScene:
    """Use a scene with some objects from the next cycle on."""
    scene = drives.gateway.model.scene.with_contents(
        objects={thing.name: thing for thing in things}, attached_bodies={}
    )
    drives.gateway.use_scene(scene)
    return scene


def swing(drives: Drives, time: float = 3.0) -> TrajectoryGoal:
    """Return a trajectory that turns the first joint."""
    there = ready('panda').copy()
    there[0] += 1.6
    return TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(time, there.tolist())])


def violated(command: MotionCommand) -> str:
    """Return why a motion has ended off its way."""
    outcome = command.ended.result(0.0)
    assert outcome.code is GoalCode.PATH_TOLERANCE_VIOLATED
    return outcome.reason


def under_way(drives: Drives, cycles: int) -> MotionCommand:
    """Begin to swing, and run some cycles."""
    command = drives.gateway.request(swing(drives))
    drives.run(cycles)
    assert command.future.result(0.0) is not None
    return command


def least(scene: arm_model.PlanningScene, path: list[arm_model.Array]) -> float:
    """Return the least distance on a path."""
    model = arm_model.RobotModel(*texts('panda'), table('panda'))
    model.use_scene(arm_model.Clearances(scene))
    return min(model.clearance(positions, 0.2) for positions in path)


@pytest.mark.parametrize('kind', ['jog', 'target'])
def test_what_the_servo_moves_stops_before_a_new_obstacle(kind: str) -> None:
    """It slows down, and the report or the end of the motion names the pair."""
    drives, command = started(), None
    if kind == 'jog':
        jog(drives.gateway, {JOINT: 0.6}, drives.now, 60.0)
    else:
        command = move_by(drives.gateway, {JOINT: 1.2})
    drives.run(30)
    scene, begin = use(drives, box(1.1)), len(drives.path)
    drives.run(300)
    assert least(scene, drives.path[begin:]) > 0.0
    assert drives.path[-1][0] - drives.path[0][0] > 0.1
    assert abs(drives.path[-1][0] - drives.path[-2][0]) < 0.05 * PERIOD
    point = drives.gateway.snapshot.set_point
    assert point is not None
    assert 'box' in (str(point.report) if command is None else violated(command))


@pytest.mark.parametrize('ahead', [0.85, 1.2])
def test_a_trajectory_stops_on_its_path_before_a_new_obstacle(ahead: float) -> None:
    """The result names the pair, and that the scene has changed."""
    drives = started()
    command = under_way(drives, 60)
    here = drives.path[-1][0] - ready('panda')[0]
    assert 0.0 < here < 0.35
    scene, begin = use(drives, box(here + ahead)), len(drives.path)
    drives.run(200)
    assert 'box would collide at' in violated(command)
    assert 'the scene changed' in violated(command)
    assert least(scene, drives.path[begin:]) > 0.0
    assert drives.path[-1].tolist() == drives.path[-2].tolist()
    other = [row[1:] - ready('panda')[1:] for row in drives.path[begin:]]
    assert np.abs(other).max() < 1e-9  # on the path: the first joint alone moves
    assert np.diff([row[0] for row in drives.path[begin:]]).min() > -1e-5


def test_a_trajectory_goes_on_where_a_new_obstacle_is_not_in_its_way() -> None:
    """Beside the path, and behind the arm."""
    drives = started()
    command = under_way(drives, 100)
    use(drives, box(-1.0, 'behind'), box(2.6, 'beyond'))
    drives.run(300)
    assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL


def test_until_its_path_is_checked_the_safety_filter_watches_a_trajectory() -> None:
    """The thread that checks is busy; the arm comes to rest before the obstacle, with room."""
    worker = SteppedWorker()
    drives = started(worker)
    command = drives.gateway.request(swing(drives, time=8.0))
    drives.run()
    assert worker.run()
    drives.run(160)
    scene, begin = use(drives, box(1.1)), len(drives.path)
    drives.run(1000)  # the worker does nothing
    # with room for what is planned from there: a start in contact would be refused
    assert least(scene, drives.path[begin:]) > 0.0015
    assert 'box' in violated(command)
    assert 'the scene changed' in violated(command)
    while worker.run():
        drives.run()
    assert drives.gateway.snapshot.source is Source.NONE


@pytest.mark.parametrize('is_blocked', [False, True])
def test_what_was_prepared_in_an_old_scene_is_prepared_again(is_blocked: bool) -> None:
    """It begins where it is clear in the new one, too."""
    worker = SteppedWorker()
    drives = started(worker)
    command = drives.gateway.request(swing(drives))
    drives.run()
    use_later(drives, box(0.8 if is_blocked else -1.0))
    assert worker.run()  # prepared for the scene without the box
    for _ in range(5):
        worker.run()
        drives.run()
    if is_blocked:
        with pytest.raises(arm_model.CommandError, match='box would collide'):
            command.future.result(0.0)
        assert drives.path[-1].tolist() == ready('panda').tolist()
    else:
        assert command.future.result(0.0) is not None


@pytest.mark.parametrize('is_blocked', [False, True])
def test_a_scene_that_never_rests_keeps_no_motion_from_starting(is_blocked: bool) -> None:
    """After a few attempts it begins, and is checked on its way: it meets nothing."""
    worker = SteppedWorker()
    drives = started(worker)
    command = drives.gateway.request(swing(drives))
    drives.run()
    for number in range(MAX_ATTEMPTS):
        is_last = number == MAX_ATTEMPTS - 1
        scene = use_later(drives, box(0.8 if is_blocked and is_last else -1.0, f'box_{number}'))
        while worker.run():
            pass
        drives.run(2)
    assert command.future.result(0.0) is not None
    begin = len(drives.path)
    if not is_blocked:  # it goes on while scenes come, of which one at a time is looked at
        for number in range(20):
            scene = use_later(drives, box(-1.0, f'later_{number}'))
            drives.run(2)
        assert drives.gateway.snapshot.source is Source.TRAJECTORY
        while worker.run():
            pass
    for _ in range(500):
        worker.run()
        drives.run(2)
    outcome = command.ended.result(0.0)
    assert (outcome.code is GoalCode.SUCCESSFUL) is not is_blocked, outcome
    assert not is_blocked or 'the scene changed' in outcome.reason
    assert least(scene, drives.path[begin:]) > 0.0


@pytest.mark.parametrize('is_allowed', [False, True])
def test_a_grasp_that_the_planner_allowed_passes(is_allowed: bool) -> None:
    """The hand goes to an object that it may touch, and takes it along."""
    drives = started()
    scene = use(drives, box(0.8))
    if is_allowed:
        scene = scene.allowing('box', 'panda_*')
        drives.gateway.use_scene(scene)
    command = move_by(drives.gateway, {JOINT: 0.8})
    drives.run(300)
    if not is_allowed:
        with pytest.raises(arm_model.CommandError, match='box would collide'):
            command.future.result(0.0)
        return
    assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL
    held = scene.attached('box', 'panda_hand', drives.path[-1], ['panda_link7', 'panda_link6'])
    drives.gateway.use_scene(held.with_object(box(-0.8, 'post')))
    drives.run()
    back = move_by(drives.gateway, {JOINT: -0.8})
    against = move_by(drives.gateway, {JOINT: -0.8})
    drives.run(300)
    assert back.ended.result(0.0).code is GoalCode.SUCCESSFUL
    with pytest.raises(arm_model.CommandError, match='post would collide'):
        against.future.result(0.0)


def test_the_scene_of_another_arm_is_refused() -> None:
    """And the one before goes on to count."""
    drives = started()
    before = drives.gateway.model.scene
    with pytest.raises(arm_model.SceneError, match='not that of panda_arm'):
        drives.gateway.use_scene(robot('prbt').scene)
    drives.run()
    assert drives.gateway.model.scene is before
