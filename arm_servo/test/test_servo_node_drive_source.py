# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The core in the CANopen cycle: taking over, dropping out and coming back."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest
from servo_commands import Drives, outcome, PERIOD

from arm_canopen import CanopenError, Refusal, RefusalCause
from arm_servo import MotionCore, NotReadyError, Phase, Source, SpeedRequest
from arm_servo.core.gateway import MotionCommand
from arm_servo.drive_source import NOT_ATTACHED, why_not
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal


def swing(drives: Drives, far: float = 0.4, time: float = 2.0) -> MotionCommand:
    """Order a trajectory of all joints."""
    to = [axis.setpoint + far for axis in drives.axes]
    to[3] -= 2 * far  # the fourth joint of the Panda has little room upwards
    goal = TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(time, to)])
    return drives.gateway.request(goal)


def test_it_begins_where_the_set_points_are() -> None:
    """The first set-points are those of the drives, not their measured positions."""
    drives = Drives()
    drives.axes = [replace(axis, position=axis.position + 0.02) for axis in drives.axes]
    before = [axis.setpoint for axis in drives.axes]
    drives.attach()
    answer = drives.run()
    assert [point.position for point in answer if point] == pytest.approx(before, abs=1e-12)


def test_nothing_moves_before_it_is_attached() -> None:
    """Without its drives it answers no set-points, and refuses commands."""
    drives = Drives()
    command = swing(drives)
    assert drives.run() == [None] * 7
    with pytest.raises(NotReadyError, match='not attached yet'):
        command.future.result(0.0)


@pytest.mark.parametrize(
    ('cause', 'code', 'words'),
    [
        (RefusalCause.OFFLINE, GoalCode.INVALID_GOAL, 'is offline; look after its power'),
        (RefusalCause.FAULT, GoalCode.INVALID_GOAL, 'is faulted; call its ~/recover'),
        (RefusalCause.NOT_ENABLED, GoalCode.INVALID_GOAL, '~/init'),
        (RefusalCause.OTHER_MODE, GoalCode.INVALID_GOAL, '~/cyclic_position_mode'),
        (RefusalCause.HALTED, GoalCode.INVALID_GOAL, 'is halted; the next command'),
        (RefusalCause.SHUTDOWN, GoalCode.INVALID_GOAL, 'is shut down'),
        (RefusalCause.NOT_FOLLOWING, GoalCode.PATH_TOLERANCE_VIOLATED, 'does not follow'),
    ],
)
def test_the_others_stop_on_the_path_when_a_drive_drops_out(
    cause: RefusalCause, code: GoalCode, words: str
) -> None:
    """The six others come to rest smoothly on the path; the trajectory names the one cause."""
    drives = Drives().following(1)
    begin = drives.path[-1]
    command = swing(drives)
    drives.run(60)
    before = len(drives.path)
    drives.axes[2] = replace(drives.axes[2], followable=False, refusal=Refusal(cause))
    answer = drives.run()
    assert [point is None for point in answer] == [number == 2 for number in range(7)]
    drives.run(200)
    ending = outcome(command)
    assert command.execution is not None
    assert command.execution.phase is Phase.DONE
    assert ending.code is code
    assert ending.reason.startswith('panda_joint3 ')
    assert 'panda_joint4' not in ending.reason
    assert words in ending.reason
    others = [0, 1, 3, 4, 5, 6]
    path = np.array(drives.path)[:, others] - begin[others]
    ratio = path[before:] / path[before:, :1]  # all joints swing in proportion on the path
    assert np.abs(np.abs(ratio) - 1.0).max() < 1e-6
    speeds = np.diff(path, axis=0) / PERIOD
    jumps = np.abs(np.diff(speeds, axis=0)) / PERIOD
    assert (jumps.max(axis=0) < 1.01 * drives.gateway.model.limits.acceleration[others]).all()
    assert np.abs(speeds[-1]).max() == 0.0


def test_a_silent_drive_is_led_to_rest_on_the_path_with_the_others() -> None:
    """Its set-points are still sent: the whole arm stops in step, and the trajectory names it."""
    drives = Drives().following(1)
    begin = drives.path[-1]
    command = swing(drives)
    drives.run(60)
    before = len(drives.path)
    silent = Refusal(RefusalCause.SILENT, 'the last is 0.5 s old')
    drives.axes[2] = replace(drives.axes[2], refusal=silent, age=0.5)
    assert None not in drives.run()
    drives.run(200)
    ending = outcome(command)
    assert ending.reason.startswith('panda_joint3 does not send its TPDOs')
    path = np.array(drives.path) - begin
    ratio = path[before:] / path[before:, :1]
    assert np.abs(np.abs(ratio) - 1.0).max() < 1e-6
    assert np.abs(np.diff(path, axis=0)[-1]).max() == 0.0


def test_drives_that_are_cut_off_together_are_named_together() -> None:
    """One of them is silent a cycle before the others, whose last TPDOs are nearly as old."""
    drives = Drives().following(1)
    command = swing(drives)
    drives.run(60)
    silent = Refusal(RefusalCause.SILENT, 'the last is 0.5 s old')
    drives.axes = [replace(axis, age=0.495) for axis in drives.axes]
    drives.axes[2] = replace(drives.axes[2], refusal=silent, age=0.505)
    drives.axes[6] = replace(drives.axes[6], age=0.02)
    drives.run(200)
    ending = outcome(command)
    for axis in drives.axes[:6]:
        assert axis.name in ending.reason
    assert drives.axes[6].name not in ending.reason


def test_a_drive_that_was_taken_away_comes_back_when_attached_again() -> None:
    """Another client's target is left alone until the next attach; then all goes on from there."""
    drives = Drives().following(1)
    drives.source.released('panda_joint5', Refusal(RefusalCause.SINGLE_TARGET))
    assert drives.run(3) == [None] * 7
    assert 'single target' in drives.gateway.snapshot.blocked
    drives.axes[4] = replace(drives.axes[4], position=0.3, setpoint=0.3)
    drives.attach()
    answer = drives.run()
    assert answer[4] is not None
    assert answer[4].position == pytest.approx(0.3, abs=1e-12)


def test_an_attach_that_failed_is_tried_again() -> None:
    """Nothing waits for the bus; where it refuses, the source is detached with the old reason."""
    drives = Drives()
    pending = Future[None]()
    attach, drives.source._attach = drives.source._attach, lambda _: pending
    drives.attach()
    pending.set_exception(CanopenError('the cycle has ended'))
    drives.source._attach = attach
    assert drives.run() == [None] * 7
    assert 'not attached yet' in drives.gateway.snapshot.blocked
    drives.attach()
    assert None not in drives.run()


def test_a_drive_that_was_faulted_follows_again_when_it_can() -> None:
    """It takes over by itself where nobody took the drive away, at rest."""
    drives = Drives().following(1)
    whole = drives.axes[1]
    drives.axes[1] = replace(whole, followable=False)
    assert drives.run(3) == [None] * 7
    drives.axes[1] = whole
    assert None not in drives.run()
    assert drives.gateway.snapshot.source is Source.NONE


def test_a_drive_that_is_slower_than_its_limits_is_not_led() -> None:
    """It would refuse the path half-way, and stop beside it; the others are not led alone."""
    drives = Drives()
    drives.axes[2] = replace(drives.axes[2], speed_limit=0.767)
    drives.attach()
    command = swing(drives, 0.01)
    assert drives.run(3) == [None] * 7
    allowed = f'{drives.gateway.model.limits.velocity[2]:.4g}'
    words = f'panda_joint3 is limited to 0.767 per second by 0x607F, .* allows {allowed}; lower'
    with pytest.raises(NotReadyError, match=words):
        command.future.result(0.0)
    drives.axes[2] = replace(drives.axes[2], speed_limit=drives.gateway.model.limits.velocity[2])
    assert None not in drives.run()


def test_a_command_that_waited_too_long_is_refused() -> None:
    """After a pause of the cycle an old command moves nothing."""
    drives = Drives().following(1)
    command = swing(drives)
    drives.now += 1.0
    drives.run()
    with pytest.raises(NotReadyError, match='stood still'):
        command.future.result(0.0)


def test_a_defect_of_the_core_is_reported_and_latched(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bus learns of it and detaches the source, which then has to be attached again."""
    drives = Drives().following(1)

    def broken(*_: object) -> None:
        raise ArithmeticError('no solution')

    monkeypatch.setattr(MotionCore, 'step', broken)
    with pytest.raises(ArithmeticError):
        drives.run()
    monkeypatch.undo()
    assert drives.run() == [None] * 7
    drives.attach()
    assert None not in drives.run()


def test_settings_are_taken_while_the_arm_does_not_follow() -> None:
    """Speed and pause can be set before the drives are there."""
    drives = Drives()
    future = drives.gateway.command(SpeedRequest(0.3))
    drives.run()
    future.result(0.0)
    assert drives.gateway.snapshot.speed == 0.3


def test_where_the_arm_is_to_be_is_known_before_it_follows() -> None:
    """It is where the drives stand, at rest; later what is commanded."""
    drives = Drives()
    assert drives.gateway.snapshot.reference is None
    drives.attach()
    drives.axes[0] = replace(drives.axes[0], followable=False, position=0.3)
    drives.run()
    reference = drives.gateway.snapshot.reference
    assert reference is not None
    assert reference.position[0] == 0.3
    assert not reference.moving
    drives.axes[0] = replace(drives.axes[0], followable=True)
    drives.run()
    point = drives.gateway.snapshot.set_point
    assert point is not None
    assert drives.gateway.snapshot.reference is point.state


def test_drives_with_the_same_trouble_are_named_together() -> None:
    """In one sentence, with the verb of several; others have their own."""
    drives = Drives()
    offline, disabled = Refusal(RefusalCause.OFFLINE), Refusal(RefusalCause.NOT_ENABLED)
    off = [replace(axis, followable=False, refusal=offline) for axis in drives.axes[:2]]
    third = replace(drives.axes[2], followable=False, refusal=disabled)
    assert why_not([*off, third], {}) == (
        'panda_joint1, panda_joint2 are offline; look after their power and their cable;'
        ' panda_joint3 is not enabled; call its ~/init'
    )
    assert why_not(drives.axes[:2], dict.fromkeys(drives.source.axes, NOT_ATTACHED)) == (
        'panda_joint1, panda_joint2 were not attached yet; the next command takes them back'
    )


@pytest.mark.parametrize('cause', [RefusalCause.COMMANDED, RefusalCause.MODE_SELECTED])
def test_before_the_first_command_nothing_is_taken_over(cause: RefusalCause) -> None:
    """Who enables the drives takes them from nobody; later it is named."""
    drives = Drives().following(1)
    ready = 'are ready; the next command takes them back'
    for moved, words in ((False, ready), (True, ': init; ')):
        if moved:
            drives.attach()
            drives.run(2)
            swing(drives)
            drives.run(10)
        for name in drives.source.axes:
            drives.source.released(name, Refusal(cause, 'init'))
        drives.run(500)
        blocked = drives.gateway.snapshot.blocked
        assert words in blocked
        assert blocked.endswith(ready) is not moved


def test_a_drive_on_its_way_to_a_single_target_is_waited_for_or_halted() -> None:
    """The command that is refused is the next one already: it does not take the drive back."""
    drives = Drives()
    single = Refusal(RefusalCause.SINGLE_TARGET)
    axes = [replace(axis, followable=False, refusal=single) for axis in drives.axes[:2]]
    assert why_not(axes[:1], {}) == (
        'panda_joint1 moves to a single target; wait until it stands, or call its ~/halt; then the'
        ' next command takes it back'
    )
    assert why_not(axes, {}) == (
        'panda_joint1, panda_joint2 move to a single target; wait until they stand, or call their'
        ' ~/halt; then the next command takes them back'
    )


def test_the_cause_is_reported_and_not_what_followed_from_it() -> None:
    """A master that shuts down disables the drives: that they are disabled is a consequence."""
    drives = Drives().following(1)
    command = swing(drives)
    drives.run(60)
    for number, axis in enumerate(drives.axes):
        drives.source.released(axis.name, Refusal(RefusalCause.SHUTDOWN))
        drives.axes[number] = replace(
            axis, followable=False, refusal=Refusal(RefusalCause.NOT_ENABLED)
        )
    drives.run(3)
    ending = outcome(command)
    assert ending.code is GoalCode.INVALID_GOAL
    assert 'shut down' in ending.reason
    assert 'not enabled' not in ending.reason


def test_a_trajectory_ends_at_once_when_no_drive_is_left() -> None:
    """As at the end of the master: there is nothing to be brought to rest on the path."""
    drives = Drives().following(1)
    command = swing(drives)
    drives.run(60)
    whole = drives.axes
    drives.axes = [
        replace(axis, followable=False, refusal=Refusal(RefusalCause.FAULT)) for axis in whole
    ]
    assert drives.run() == [None] * 7
    ending = outcome(command)
    assert command.execution is not None
    assert command.execution.phase is Phase.DONE
    assert 'are faulted' in ending.reason
    drives.axes = [replace(axis, setpoint=axis.position) for axis in whole]
    before = [axis.position for axis in drives.axes]
    assert [point.position for point in drives.run() if point] == pytest.approx(before, abs=1e-12)
