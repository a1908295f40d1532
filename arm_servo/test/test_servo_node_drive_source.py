# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The core in the CANopen cycle: taking over, dropping out and coming back."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest
from servo_commands import Drives, no_speed_jumps, outcome

from arm_canopen import CanopenError, Refusal, RefusalCause
from arm_model import Array
from arm_servo import NotReadyError, Phase, Source, SpeedRequest
from arm_servo.core.gateway import MotionCommand
from arm_servo.drive_source import NOT_ATTACHED, why_not
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal

NOTHING = [None] * 7  # what is answered where no drive is led


def swing(drives: Drives, far: float = 0.4, time: float = 2.0) -> MotionCommand:
    """Order a trajectory of all joints."""
    to = [axis.setpoint + far for axis in drives.axes]
    to[3] -= 2 * far  # the fourth joint of the Panda has little room upwards
    goal = TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(time, to)])
    return drives.gateway.request(goal)


def swinging() -> tuple[Drives, MotionCommand]:
    """Return drives that follow a trajectory of all joints, and its command."""
    drives = Drives().following(1)
    command = swing(drives)
    drives.run(60)
    return drives, command


def refuse(drives: Drives, number: int, cause: RefusalCause) -> None:
    """Let a drive drop out."""
    axis = drives.axes[number]
    drives.axes[number] = replace(axis, followable=False, refusal=Refusal(cause))


def rests_on_the_path(drives: Drives, begin: Array, before: int, joints: list[int]) -> None:
    """Make sure that joints came to rest smoothly, in proportion as on their path."""
    path = np.array(drives.path)[:, joints] - begin[joints]
    ratio = path[before:] / path[before:, :1]
    assert np.abs(np.abs(ratio) - 1.0).max() < 1e-6
    no_speed_jumps(path, drives.gateway.model.limits.acceleration[joints])
    assert np.abs(path[-1] - path[-2]).max() == 0.0


def test_it_begins_where_the_set_points_are() -> None:
    """The first set-points are those of the drives, not their measured positions."""
    drives = Drives()
    drives.axes = [replace(axis, position=axis.position + 0.02) for axis in drives.axes]
    before = [axis.setpoint for axis in drives.axes]
    drives.attach()
    answer = drives.run()
    assert [point.position for point in answer if point] == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize(
    ('cause', 'words'),
    [
        (RefusalCause.OFFLINE, 'is offline; look after its power'),
        (RefusalCause.FAULT, 'is faulted; call its ~/recover'),
        (RefusalCause.NOT_ENABLED, '~/init'),
        (RefusalCause.OTHER_MODE, '~/cyclic_position_mode'),
        (RefusalCause.HALTED, 'is halted; the next command'),
        (RefusalCause.SHUTDOWN, 'is shut down'),
        (RefusalCause.NOT_FOLLOWING, 'does not follow'),
        (RefusalCause.SILENT, 'does not send its TPDOs'),
    ],
)
def test_the_others_stop_on_the_path_when_a_drive_drops_out(
    cause: RefusalCause, words: str
) -> None:
    """Smoothly, and the trajectory names the one cause; to a silent drive set-points go on."""
    drives, command = swinging()
    begin, before, is_silent = drives.path[0], len(drives.path), cause is RefusalCause.SILENT
    refuse(drives, 2, cause)
    if is_silent:
        drives.axes[2] = replace(drives.axes[2], followable=True, age=0.5)
    answer = drives.run()
    led = [number for number in range(7) if number != 2 or is_silent]
    assert [number for number, point in enumerate(answer) if point is not None] == led
    drives.run(200)
    ended, is_off = outcome(command), cause is RefusalCause.NOT_FOLLOWING
    assert command.execution is not None
    assert command.execution.phase is Phase.DONE
    assert ended.code is (GoalCode.PATH_TOLERANCE_VIOLATED if is_off else GoalCode.INVALID_GOAL)
    assert ended.reason.startswith('panda_joint3 ')
    assert 'panda_joint4' not in ended.reason
    assert words in ended.reason
    rests_on_the_path(drives, begin, before, led)


def test_drives_that_are_cut_off_together_are_named_together() -> None:
    """One of them is silent a cycle before the others, whose last TPDOs are nearly as old."""
    drives, command = swinging()
    silent = Refusal(RefusalCause.SILENT, 'the last is 0.5 s old')
    drives.axes = [replace(axis, age=0.495) for axis in drives.axes]
    drives.axes[2] = replace(drives.axes[2], refusal=silent, age=0.505)
    drives.axes[6] = replace(drives.axes[6], age=0.02)
    drives.run(200)
    named = [axis.name in outcome(command).reason for axis in drives.axes]
    assert named == [True] * 6 + [False]


def test_a_drive_that_was_taken_away_comes_back_when_attached_again() -> None:
    """Another client's target is left alone until then; after a fault it comes back by itself."""
    drives = Drives().following(1)
    whole = drives.axes[1]
    drives.axes[1] = replace(whole, followable=False)
    assert drives.run(3) == NOTHING
    drives.axes[1] = whole
    assert None not in drives.run()
    assert drives.gateway.snapshot.source is Source.NONE
    drives.source.released('panda_joint5', Refusal(RefusalCause.SINGLE_TARGET))
    assert drives.run(3) == NOTHING
    assert 'single target' in drives.gateway.snapshot.blocked
    drives.axes[4] = replace(drives.axes[4], position=0.3, setpoint=0.3)
    drives.attach()
    answer = drives.run()
    assert answer[4] is not None
    assert answer[4].position == pytest.approx(0.3, abs=1e-12)


def test_nothing_moves_before_it_is_attached() -> None:
    """Commands are refused; nothing waits for the bus; an attach that failed is tried again."""
    drives = Drives()
    command = swing(drives)
    assert drives.run() == NOTHING
    with pytest.raises(NotReadyError, match='not attached yet'):
        command.future.result(0.0)
    pending = Future[None]()
    attach, drives.source._attach = drives.source._attach, lambda _: pending
    drives.attach()
    pending.set_exception(CanopenError('the cycle has ended'))
    drives.source._attach = attach
    assert drives.run() == NOTHING
    assert 'not attached yet' in drives.gateway.snapshot.blocked
    drives.attach()
    assert None not in drives.run()


def test_a_drive_that_is_slower_than_its_limits_is_not_led() -> None:
    """It would refuse the path half-way, and stop beside it; the others are not led alone."""
    drives = Drives()
    drives.axes[2] = replace(drives.axes[2], speed_limit=0.767)
    drives.attach()
    command = swing(drives, 0.01)
    assert drives.run(3) == NOTHING
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


def test_where_the_arm_is_to_be_is_known_before_it_follows() -> None:
    """It is where the drives stand, at rest; later what is commanded. Settings count already."""
    drives = Drives()
    assert drives.gateway.snapshot.reference is None
    set_speed = drives.gateway.command(SpeedRequest(0.3))
    drives.attach()
    drives.axes[0] = replace(drives.axes[0], followable=False, position=0.3)
    drives.run()
    assert set_speed.exception(0.0) is None
    assert drives.gateway.snapshot.speed == 0.3
    reference = drives.gateway.snapshot.reference
    assert reference is not None
    assert reference.position[0] == 0.3
    assert not reference.moving
    drives.axes[0] = replace(drives.axes[0], followable=True)
    drives.run()
    point = drives.gateway.snapshot.set_point
    assert point is not None
    assert drives.gateway.snapshot.reference is point.state


@pytest.mark.parametrize(
    ('causes', 'words'),
    [
        (
            [RefusalCause.OFFLINE, RefusalCause.OFFLINE, RefusalCause.SINGLE_TARGET],
            (
                'panda_joint1, panda_joint2 are offline; look after their power and their cable;'
                ' panda_joint3 moves to a single target; wait until it stands, or call its'
                ' ~/halt; then the next command takes it back'
            ),
        ),
        (
            [None, None],
            'panda_joint1, panda_joint2 were not attached yet; the next command takes them back',
        ),
    ],
)
def test_drives_with_the_same_trouble_are_named_together(
    causes: list[RefusalCause | None], words: str
) -> None:
    """In one sentence, with the verb of several, and the remedy; others have their own."""
    axes = [
        axis if cause is None else replace(axis, followable=False, refusal=Refusal(cause))
        for axis, cause in zip(Drives().axes, causes, strict=False)
    ]
    detached = dict.fromkeys([axis.name for axis in axes], NOT_ATTACHED)
    assert why_not(axes, detached if None in causes else {}) == words


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


def test_the_cause_is_reported_and_not_what_followed_from_it() -> None:
    """A master that shuts down disables the drives: that they are disabled is a consequence."""
    drives, command = swinging()
    for number, axis in enumerate(drives.axes):
        drives.source.released(axis.name, Refusal(RefusalCause.SHUTDOWN))
        refuse(drives, number, RefusalCause.NOT_ENABLED)
    drives.run(3)
    assert outcome(command).code is GoalCode.INVALID_GOAL
    assert 'shut down' in outcome(command).reason
    assert 'not enabled' not in outcome(command).reason


def test_a_trajectory_ends_at_once_when_no_drive_is_left() -> None:
    """As at the end of the master: there is nothing to be brought to rest on the path."""
    drives, command = swinging()
    whole = list(drives.axes)
    for number in range(7):
        refuse(drives, number, RefusalCause.FAULT)
    assert drives.run() == NOTHING
    assert 'are faulted' in outcome(command).reason
    drives.axes = [replace(axis, setpoint=axis.position) for axis in whole]
    before = [axis.position for axis in drives.axes]
    assert [point.position for point in drives.run() if point] == pytest.approx(before, abs=1e-12)
