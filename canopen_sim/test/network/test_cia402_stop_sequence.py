# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A drive whose part of the cycle fails: quick stop, rest, disable, in this order and once."""

from __future__ import annotations

from itertools import count

from diagnostic_msgs.msg import DiagnosticStatus
from drive_samples import PERIOD, SCALE
from moving_drive import JOINT, MovingDrive, NODE_ID, RAMP, STANDING
import pytest

from arm_canopen import DriveError, DriveState
from arm_canopen.cia402.drive_objects import DriveObjects
from arm_canopen.cia402.status import drive_status
from arm_canopen.cia402.stop_sequence import SHUTDOWN_MAX
from arm_canopen.library.canopen_master import leave_device
from arm_canopen.nodes.diagnostics import drive_diagnostic

pytestmark = pytest.mark.slow

RPDOS = {0x200 + NODE_ID, 0x300 + NODE_ID, 0x400 + NODE_ID}
OPTIONS = pytest.mark.parametrize('option', [2, 6], ids=['605A=2', '605A=6'])


def inject(
    monkeypatch: pytest.MonkeyPatch,
    owner: object,
    attribute: str,
    *,
    times: float = float('inf'),
) -> None:
    """Let something fail from now on, with another text each time."""
    original, number = getattr(owner, attribute), count()

    def broken(*args: object, **settings: object) -> object:
        failures = next(number)
        if failures < times:
            raise ZeroDivisionError(f'injected {failures}')
        return original(*args, **settings)

    monkeypatch.setattr(owner, attribute, broken)


def owner_of(failing: MovingDrive, place: str) -> tuple[object, str]:
    """Return the object and its attribute that a failure is injected into."""
    drive = failing.net.drives[JOINT]
    rpdo = failing.net.network.nodes[JOINT].image.rpdos[-1]
    return {
        'mode': (drive.control.mode, 'step'),
        'write': (drive, 'write'),
        'read': (drive, 'read'),
        'controlword': (drive.objects.controlword, 'write'),
        'RPDO': (rpdo, '_pack'),
    }[place]


def assert_stopped_once(failing: MovingDrive) -> None:
    """Quick stop, rest, disable; never without power at speed, and reported once."""
    assert failing.states == [
        DriveState.OPERATION_ENABLED,
        DriveState.QUICK_STOP_ACTIVE,
        DriveState.SWITCH_ON_DISABLED,
    ]
    assert failing.fastest < STANDING
    assert len(failing.errors) == 1, failing.errors


@OPTIONS
@pytest.mark.parametrize('times', [1, float('inf')], ids=['once', 'for ever'])
@pytest.mark.parametrize('place', ['mode', 'write', 'controlword', 'RPDO'])
def test_the_power_goes_when_the_axis_stands(
    place: str, times: float, option: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever 0x605A says: it is never without power at speed, nor powered for good."""
    failing = MovingDrive(option)
    inject(monkeypatch, *owner_of(failing, place), times=times)
    failing.run(RAMP + 2.0)
    assert_stopped_once(failing)
    unreachable = place == 'RPDO' or (place == 'controlword' and times > 1)
    assert failing.controlwords_by_sdo == ([2, 0] if unreachable else [])


def test_a_drive_that_cannot_be_seen_loses_its_power_at_the_deadline(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is not waited for for ever that it stands."""
    failing = MovingDrive(6)
    inject(monkeypatch, *owner_of(failing, 'read'))
    failing.run(RAMP + 3.0)
    assert failing.states[-1] is DriveState.SWITCH_ON_DISABLED
    assert failing.fastest < STANDING
    assert len([text for text in failing.errors if 'injected' in text]) == 1


@OPTIONS
def test_a_deaf_drive_is_stopped_by_sdo_and_not_enabled_by_what_comes_later(
    option: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its RPDOs are kept back before the SDO leaves: none that gets through ends the stop."""
    failing = MovingDrive(option)
    failing.net.wire.loses = lambda sender, frame: frame.can_id in RPDOS
    inject(monkeypatch, *owner_of(failing, 'mode'), times=1)
    failing.run(0.4)
    assert not failing.controlwords_by_sdo
    failing.run(0.4)
    failing.net.wire.loses = lambda sender, frame: False
    failing.run(RAMP + 2.0)
    assert failing.states[-1] is DriveState.SWITCH_ON_DISABLED
    assert DriveState.OPERATION_ENABLED not in failing.states[1:]
    assert failing.controlwords_by_sdo == [2, 0]
    failing.net.do(JOINT, 'enable')
    assert failing.device.state is DriveState.OPERATION_ENABLED


def test_an_axis_is_stopped_whose_rpdo_is_kept_back_with_another_axis(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It would go on with the last controlword that it got; enabling it frees no RPDO."""
    failing = MovingDrive(6)
    other = DriveObjects(failing.net.network.nodes[JOINT])
    other.mute_controlword()
    failing.run(RAMP + 1.0)
    assert failing.states[-1] is DriveState.SWITCH_ON_DISABLED
    assert failing.fastest < STANDING
    assert failing.controlwords_by_sdo == [2, 0]
    assert len(failing.errors) == 1
    with pytest.raises(DriveError, match='did not reach Operation enabled'):
        failing.net.do(JOINT, 'enable')
    assert other.controlword_muted, 'the RPDO carries what the other axis must not get'
    other.unmute_controlword()
    failing.net.do(JOINT, 'enable')


def test_a_drive_that_could_not_be_stopped_is_stopped_by_the_next_request(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Neither RPDO nor SDO reaches it at first, which is reported with the remedy."""
    failing = MovingDrive(6)
    inject(monkeypatch, *owner_of(failing, 'controlword'))
    failing.net.wire.loses = lambda sender, frame: frame.can_id == 0x600 + NODE_ID
    failing.run(RAMP + 6.0)
    assert failing.states == [DriveState.OPERATION_ENABLED]
    assert 'Cut its power' in failing.errors[-1]
    reported = len(failing.errors)
    failing.run(2.0)
    assert len(failing.errors) == reported
    failing.net.wire.loses = lambda sender, frame: False
    failing.net.do(JOINT, 'disable', preempt=True)
    assert failing.device.state is DriveState.SWITCH_ON_DISABLED
    assert abs(failing.device.velocity) / SCALE < STANDING


def test_a_drive_that_is_gone_is_not_said_to_move_on() -> None:
    """As long as its heartbeat is not overdue, it is silent: that is what is reported."""
    failing = MovingDrive(6)
    others = {0x180 + NODE_ID, 0x280 + NODE_ID, 0x380 + NODE_ID, 0x480 + NODE_ID, 0x580 + NODE_ID}
    failing.net.wire.loses = lambda sender, frame: frame.can_id in others
    with pytest.raises(DriveError, match='no TPDOs for'):
        failing.net.do(JOINT, 'shutdown', preempt=True)
    assert not [text for text in failing.net.reported() if 'did not come to rest' in text]
    (silent,) = [text for text in failing.errors if 'has sent no TPDO for' in text]
    assert 'Check its power and cable' in silent


def test_a_stop_by_sdo_waits_for_no_other_sdo(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither for those in the queue nor for answers that get lost."""
    failing = MovingDrive(6)
    failing.net.wire.loses = lambda sender, frame: frame.can_id == 0x580 + NODE_ID
    node = failing.net.network.nodes[JOINT]
    for _ in range(30):
        node.sdo.read(0x1018, 1, 0.2)
    inject(monkeypatch, *owner_of(failing, 'RPDO'))
    failing.run(2 * PERIOD)
    assert failing.device.state is DriveState.QUICK_STOP_ACTIVE
    failing.run(RAMP + 0.5)
    assert failing.states[-1] is DriveState.SWITCH_ON_DISABLED
    assert failing.fastest < STANDING


@pytest.mark.parametrize('verb', ['', 'shutdown'])
def test_a_stop_whose_sdo_is_not_answered_goes_by_rpdo_again(
    verb: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What kept its RPDO back was over at once; a shutdown ends the stop as well."""
    failing = MovingDrive(6)
    inject(monkeypatch, *owner_of(failing, 'controlword'), times=2)
    failing.net.wire.loses = lambda sender, frame: frame.can_id == 0x600 + NODE_ID
    if verb:
        failing.net.begin(JOINT, verb, preempt=True)
    failing.run(RAMP + 3.0)
    assert_stopped_once(failing)


def test_a_shutdown_begins_by_rpdo_and_says_when_the_drive_keeps_its_power(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The stop before has ended with the RPDO kept back, and no SDO is answered."""
    failing = MovingDrive(6)
    failing.net.wire.loses = lambda sender, frame: frame.can_id in {*RPDOS, 0x600 + NODE_ID}
    inject(monkeypatch, *owner_of(failing, 'controlword'), times=2)
    failing.run(10.0)
    with pytest.raises(DriveError, match='joint1 is not disabled; cut its power'):
        failing.net.do(JOINT, 'shutdown', preempt=True)
    failing.net.drives[JOINT].objects.mute_controlword()
    failing.net.wire.loses = lambda sender, frame: frame.can_id == 0x600 + NODE_ID
    failing.net.do(JOINT, 'shutdown', preempt=True)
    assert failing.device.state is DriveState.SWITCH_ON_DISABLED


@pytest.mark.parametrize('lost', [set(), {*RPDOS, 0x600 + NODE_ID}], ids=['receives', 'deaf'])
def test_a_device_whose_drive_keeps_its_power_goes_on_to_watch_the_master(
    lost: set[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the master ends, its heartbeat is the last that can stop the drive."""
    failing = MovingDrive(6)
    failing.net.wire.loses = lambda sender, frame: frame.can_id in lost
    node, scheduler = failing.net.network.nodes[JOINT], failing.net.network.scheduler
    node.watch_slot = 1
    leaving = scheduler.spawn(leave_device(node, [failing.net.commands[JOINT]], scheduler))
    failing.net.run_until(lambda: leaving.done, SHUTDOWN_MAX)
    assert (leaving.error is not None) is bool(lost)
    requests = failing.net.frames(0x600 + NODE_ID, since=failing.began)
    assert any(data[1:4] == b'\x16\x10\x01' for data in requests) is not bool(lost)


def test_a_drive_that_could_not_be_stopped_is_not_said_to_be_enabled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is still in Operation Enabled; and the next failure stops it as the first one would."""
    failing = MovingDrive(6)
    inject(monkeypatch, *owner_of(failing, 'controlword'), times=3)
    failing.net.wire.loses = lambda sender, frame: frame.can_id in {*RPDOS, 0x600 + NODE_ID}
    failing.run(10.0)
    with pytest.raises(DriveError, match='could not be stopped; cut its power'):
        failing.net.do(JOINT, 'enable')
    failing.net.wire.loses = lambda sender, frame: False
    failing.net.do(JOINT, 'enable')
    failing.net.commands[JOINT].set_target(50.0)
    failing.net.run(0.6)
    assert failing.device.velocity / SCALE == pytest.approx(1.0, rel=0.05)
    failing.states = [DriveState.OPERATION_ENABLED]
    reported = len(failing.errors)
    failing.net.drives[JOINT].fail(ZeroDivisionError())
    failing.run(RAMP + 1.0)
    assert failing.states[1:] == [DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED]
    assert failing.fastest < STANDING
    assert len(failing.errors) == reported + 1


def test_a_drive_that_keeps_its_power_is_stopped_again_and_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As soon as an SDO reaches it the stop works; that it failed is reported once."""
    failing = MovingDrive(6)
    inject(monkeypatch, *owner_of(failing, 'controlword'))
    failing.net.wire.loses = lambda sender, frame: frame.can_id == 0x600 + NODE_ID
    failing.run(20.0)
    assert failing.states == [DriveState.OPERATION_ENABLED]
    assert len(failing.errors) == 3, failing.errors
    failing.net.wire.loses = lambda sender, frame: False
    failing.run(8.0)
    assert failing.states[-1] is DriveState.SWITCH_ON_DISABLED
    assert failing.fastest < STANDING
    assert len(failing.errors) == 3, failing.errors


@pytest.mark.parametrize('cycles', range(1, 4))
def test_a_failure_while_it_is_enabled_stays_named_until_the_next_enabling(
    cycles: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the drive comes to Operation Enabled by a command that was on its way."""
    failing = MovingDrive(6)
    failing.net.do(JOINT, 'shutdown', preempt=True)
    enabling = failing.net.begin(JOINT, 'enable')
    drive = failing.net.drives[JOINT]
    failing.net.run_until(lambda: bool(drive.control._controlword & 0x8))
    failing.net.run(PERIOD * (cycles - 1))
    drive.fail(ZeroDivisionError('injected'))
    failing.run(RAMP + 1.0)
    with pytest.raises(DriveError, match='injected'):
        enabling.result()
    assert failing.device.state is DriveState.SWITCH_ON_DISABLED
    assert 'injected' in drive.failure
    assert len(failing.errors) == 1, failing.errors


def test_nothing_enables_a_drive_while_it_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """A command is refused, a stop waits for the end; then a command does."""
    failing = MovingDrive(6)
    inject(monkeypatch, *owner_of(failing, 'mode'), times=1)
    failing.run(0.2)
    for verb in ('init', 'enable', 'recover', 'home'):
        with pytest.raises(DriveError, match='being stopped'):
            failing.net.do(JOINT, verb)
    status = drive_status(failing.net.drives[JOINT], failing.net.now)
    assert drive_diagnostic('bus', status).level == DiagnosticStatus.ERROR
    assert 'injected' in status.summary
    failing.net.do(JOINT, 'disable', preempt=True)
    assert failing.device.state == DriveState.SWITCH_ON_DISABLED
    assert abs(failing.device.velocity) / SCALE < STANDING
    failing.net.do(JOINT, 'enable')
    assert failing.net.drives[JOINT].view.state is DriveState.OPERATION_ENABLED
    assert not drive_status(failing.net.drives[JOINT], failing.net.now).failure


def test_what_goes_wrong_after_it_was_enabled_again_is_named_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each enabling may fail once in the log."""
    failing = MovingDrive(2)
    for number in (1, 2):
        inject(monkeypatch, *owner_of(failing, 'mode'))
        failing.run(RAMP + 1.0)
        assert len(failing.errors) == number
        monkeypatch.undo()
        failing.net.do(JOINT, 'enable')
        failing.run(0.5)


def test_texts_with_values_do_not_flood_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither those of devices without a drive nor those of the cycle."""
    failing = MovingDrive(2)
    node = failing.net.network.nodes[JOINT]
    node.on_failed.clear()
    inject(monkeypatch, node, 'expect_answers')
    inject(monkeypatch, failing.net.network._heartbeat, 'advance')
    failing.run(1.0)
    assert len(failing.errors) == 2, failing.errors
