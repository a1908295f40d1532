# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The servo's status: what an arm that is jogged somewhere reports, to tools and to people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from model_robots import ready, robot, STRAIGHT
import pytest
from servo_commands import InlineWorker, jog, move_by, twist
from servo_drives import Drives, PERIOD

from arm_canopen import Refusal, RefusalCause
from arm_servo import (
    Cause,
    CoreSettings,
    IkSettings,
    Limiter,
    MotionCore,
    MotionReport,
    PauseRequest,
    ServoSettings,
    Source,
    VelocityBoundsSettings,
)
from arm_servo.core.gateway import CommandGateway
from arm_servo.ros.servo.status import code_of, status_of, StatusCode


def attached(name: str = 'panda', at: Sequence[float] = ()) -> Drives:
    """Return drives that follow, in a pose."""
    drives = Drives(name)
    if at:
        drives.place(at)
    drives.attach()
    drives.run(2)
    return drives


def codes(drives: Drives, cycles: int) -> list[tuple[int, str]]:
    """Run cycles, and return the status of each that is another than the one before."""
    found: list[tuple[int, str]] = []
    for _ in range(cycles):
        drives.run()
        status = status_of(drives.gateway.snapshot, '', '', '')
        if not found or found[-1][0] != status[0]:
            found.append(status)
    return found


def test_a_free_jog_has_no_warning() -> None:
    """And the message says that nothing limits it."""
    drives = attached()
    twist(drives.gateway, [0.0, 0.02, 0.0, 0.0, 0.0, 0.0], drives.now, 60.0)
    assert codes(drives, 60)[-1] == (StatusCode.NO_WARNING, 'free')


def test_a_jog_to_a_joint_limit_is_reported() -> None:
    """With the joint, as soon as it is slowed down."""
    drives = attached()
    jog(drives.gateway, {'panda_joint1': 2.0}, drives.now, 60.0)
    code, words = codes(drives, 300)[-1]
    assert code == StatusCode.JOINT_BOUND
    assert 'panda_joint1' in words


def test_a_jog_into_contact_is_slowed_down_and_then_halted() -> None:
    """With the two links."""
    drives = attached()
    jog(drives.gateway, {'panda_joint6': -1.0}, drives.now, 60.0)
    found = codes(drives, 300)
    assert StatusCode.DECELERATE_FOR_COLLISION in [code for code, _ in found]
    code, words = found[-1]
    assert code == StatusCode.HALT_FOR_COLLISION
    assert 'panda_link5' in words
    assert 'panda_hand' in words


def test_a_direction_that_is_lost_is_reported() -> None:
    """The straight arm cannot go sideways without its elbow."""
    drives = attached('gp110', STRAIGHT['gp110'].tolist())
    twist(drives.gateway, [0.0, 0.1, 0.0, 0.0, 0.0, 0.0], drives.now, 60.0)
    code, words = codes(drives, 60)[-1]
    assert code == StatusCode.HALT_FOR_SINGULARITY
    assert 'y is lost' in words


def test_a_stop_of_the_safety_filter_is_no_free_motion() -> None:
    """Where nothing else brakes in front of contact, it does, with code and links."""
    core = MotionCore(
        robot('panda'),
        CoreSettings(servo=ServoSettings(ik=IkSettings(brakes=VelocityBoundsSettings(pairs=0)))),
    )
    gateway = CommandGateway(core, InlineWorker(), lambda: 100.0)
    core.reset(ready('panda'))
    gateway.update(100.0, PERIOD, core.state, core.state.position, '')
    jog(gateway, {'panda_joint6': -1.0}, 100.0, 60.0)
    reported = set()
    for cycle in range(250):
        state = core.state
        gateway.update(100.0 + cycle * PERIOD, PERIOD, state, state.position, '')
        code, words = status_of(gateway.snapshot, '', '', '')
        reported.add(code)
        if code == StatusCode.HALT_FOR_COLLISION:
            assert 'panda_link5' in words
            assert 'panda_hand' in words
    assert StatusCode.HALT_FOR_COLLISION in reported
    assert core.model.clearance(core.state.position) > 0.004


def test_what_stops_a_trajectory_is_reported_too() -> None:
    """The safety filter holds whatever moves the arm; its code is not only the jog's."""
    drives = attached()
    move_by(drives.gateway, {'panda_joint1': 0.3})
    drives.run(5)
    snapshot = drives.gateway.snapshot
    assert snapshot.set_point is not None
    report = MotionReport(0.0, (Limiter(Cause.COLLISION, 'hand - arm', 0.01, 0.0),))
    for source in (Source.TARGET, Source.TRAJECTORY):
        point = replace(snapshot.set_point, source=source, report=report)
        code, words = status_of(replace(snapshot, source=source, set_point=point), '', '', '')
        assert code == StatusCode.HALT_FOR_COLLISION
        assert 'hand - arm' in words


def test_the_strongest_limit_is_the_one_that_counts() -> None:
    """In whatever order they were found."""
    slowed = Limiter(Cause.COLLISION, 'hand - arm', 0.03, 0.6)
    halted = Limiter(Cause.JOINT_POSITION, 'elbow', 0.0, 0.0)
    for limiters in ((slowed, halted), (halted, slowed)):
        report = MotionReport(0.0, limiters)
        assert report.limiters[0] is halted
        assert code_of(report) is StatusCode.JOINT_BOUND
    assert MotionReport(0.6, (slowed,)).with_limiter(halted).limiters[0] is halted


def test_a_refusal_comes_before_everything_else() -> None:
    """A person whose command was refused sees why, whatever else goes on."""
    drives = attached()
    assert status_of(drives.gateway.snapshot, 'stale', 'paused', 'cut') == (-1, 'stale')


def test_a_cycle_that_stands_still_is_reported() -> None:
    """What the last cycle said is not repeated for ever."""
    drives = attached()
    code, words = status_of(drives.gateway.snapshot, '', '', '', 3.0)
    assert code == StatusCode.INVALID
    assert '3.0 s ago' in words


def test_a_blocked_arm_says_so() -> None:
    """Without drives the status is invalid, and names the remedy."""
    drives = attached()
    drives.source.released('panda_joint1', Refusal(RefusalCause.SINGLE_TARGET))
    drives.run(3)
    code, words = status_of(drives.gateway.snapshot, '', '', '')
    assert code == StatusCode.INVALID
    assert 'panda_joint1' in words


def test_it_reports_what_moves_the_arm() -> None:
    """Also while nobody jogs."""
    drives = attached()
    assert status_of(drives.gateway.snapshot, '', '', '') == (StatusCode.NO_WARNING, 'ready')
    move_by(drives.gateway, {'panda_joint1': 0.3})
    drives.run(5)
    assert 'target' in status_of(drives.gateway.snapshot, '', '', '')[1]
    twist(drives.gateway, [0.0, 0.02, 0.0, 0.0, 0.0, 0.0], drives.now, 60.0)
    drives.run(2)
    assert status_of(drives.gateway.snapshot, '', '', 'cut to 1')[1].startswith('cut to 1')


@pytest.mark.parametrize('paused', [False, True])
def test_a_pause_of_the_arm_is_reported(paused: bool) -> None:
    """Jogging is refused then, and the message names the service that ends it."""
    drives = attached()
    if paused:
        drives.gateway.command(PauseRequest())
    drives.run(2)
    words = status_of(drives.gateway.snapshot, '', '', '')[1]
    assert ('~/resume' in words) == paused


def test_a_joint_at_its_limit_has_nothing_left() -> None:
    """What rounding leaves beyond the limit is no negative zero."""
    at_limit = Limiter(Cause.JOINT_POSITION, 'elbow', -1e-9, 0.0)
    assert str(at_limit) == 'joint limit: elbow, 0.000 left, 0.00x'
