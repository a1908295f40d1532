# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A halt wins over everything: over targets on their way, mode switches, streams and old moves."""

from __future__ import annotations

from dataclasses import replace
import math

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, pdo, PERIOD, SCALE, sdo_write
import pytest

from arm_canopen import DriveError, DriveState, OperationMode, Severity
from arm_canopen.can import Frame
from arm_canopen.cia402.position_modes import Move
from arm_canopen.config.model.drive import RecoveryPolicy
from arm_canopen.standard import Controlword, Statusword

pytestmark = pytest.mark.slow

JOINT = 'joint1'
NODE_ID = 2
STATUS_PDO = 0x180 + NODE_ID
COMMAND_PDO = 0x200 + NODE_ID
RESTS_AFTER = 0.7  # [s] without a motion; longer than a set-point waits under a halt


def running_in(mode: OperationMode, **changes: object) -> VirtualNetwork:
    """Return a network with one drive that is enabled in a mode."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, NODE_ID, **changes)))
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, mode)
    return net


def motor(net: VirtualNetwork) -> float:
    """Return where the motor really is in [rad]."""
    drive = net.devices[JOINT].drive
    assert drive is not None
    return drive.position / SCALE


def go(net: VirtualNetwork, duration: float) -> float:
    """Let the drive move until it has rested for a while; return its highest place in [rad].

    Args:
        net: The network.
        duration: Longest time of the motion in [s].
    """
    highest, last, still = motor(net), math.nan, 0
    for _ in range(round(duration / PERIOD)):
        net.run(PERIOD)
        still = still + 1 if motor(net) == last else 0
        if still * PERIOD > RESTS_AFTER:
            break
        last = motor(net)
        highest = max(highest, last)
    return highest


def assert_rests(net: VirtualNetwork, duration: float = 0.5) -> None:
    """Check that the motor stays where it is for a time in [s]."""
    begin = motor(net)
    net.run(duration)
    assert motor(net) == pytest.approx(begin, abs=2e-3)


@pytest.mark.parametrize('delay', [0.0, 0.005, 0.01, 0.02, 0.03, 0.05])
@pytest.mark.parametrize(
    ('mode', 'target'),
    [
        (OperationMode.PROFILE_POSITION, 1.0),
        (OperationMode.PROFILE_VELOCITY, 0.3),
        (OperationMode.CYCLIC_POSITION, 1.0),
    ],
)
def test_a_halt_right_after_a_target_holds(
    mode: OperationMode, target: float, delay: float
) -> None:
    """Wherever the hand-over of the target stands: it is halted, and it stays halted."""
    net = running_in(mode)
    net.commands[JOINT].set_target(target)
    net.run(0.3)
    net.do(JOINT, 'halt', preempt=True)
    net.run(0.5)
    net.commands[JOINT].set_target(2.0 if mode is not OperationMode.PROFILE_VELOCITY else 0.3)
    net.run(delay)
    assert 'halted' in net.do(JOINT, 'halt', preempt=True)
    assert_rests(net)
    assert net.drives[JOINT].control.halted
    net.commands[JOINT].set_target(-0.2)
    go(net, 4.0 if mode is not OperationMode.PROFILE_VELOCITY else 0.5)
    assert not net.drives[JOINT].control.halted
    if mode is not OperationMode.PROFILE_VELOCITY:
        assert motor(net) == pytest.approx(-0.2, abs=2e-3)


def test_a_halt_drops_the_moves_that_the_drive_holds() -> None:
    """Five moves queued, two of them in the drive: the next target goes straight to its place."""
    net = running_in(OperationMode.PROFILE_POSITION)
    for n in range(5):
        net.commands[JOINT].move(Move(0.5 * (n + 1), immediate=False))
    net.run(0.4)
    net.do(JOINT, 'halt', preempt=True)
    rest = motor(net)
    net.run(0.5)
    net.commands[JOINT].set_target(0.0)
    highest = rest
    for _ in range(300):
        net.run(PERIOD)
        highest = max(highest, motor(net))
    assert highest < rest + 5e-3, 'it went on with an old move'
    assert motor(net) == pytest.approx(0.0, abs=2e-3)


def full(net: VirtualNetwork) -> None:
    """Have the drive move, with its buffer full."""
    for target in (0.5, 1.0, 1.5):
        net.commands[JOINT].move(Move(target, immediate=False))
    net.run(0.3)
    assert motor(net) > 0.05
    assert net.drives[JOINT].view.statusword & Statusword.SET_POINT_ACKNOWLEDGE


def test_an_immediate_move_does_not_wait_for_a_full_drive() -> None:
    """What is said to go at once goes at once, and what the drive held is discarded."""
    net = running_in(OperationMode.PROFILE_POSITION)
    full(net)
    assert 'at once' in net.commands[JOINT].move(Move(-0.2))
    highest = go(net, 3.0)
    assert highest < 0.5
    assert motor(net) == pytest.approx(-0.2, abs=2e-3)
    assert not net.reported(Severity.WARNING)


def test_a_move_that_was_answered_as_failed_does_not_follow_later() -> None:
    """A relative move behind a full drive is withdrawn with its answer, and what is behind it."""
    net = running_in(OperationMode.PROFILE_POSITION)
    commands = net.commands[JOINT]
    for turn in (3.0, 6.0, 9.0):
        commands.move(Move(turn, immediate=False))
    failed = commands.deliver(lambda: commands.move(Move(0.5, relative=True)))
    commands.move(Move(0.5, relative=True, immediate=False))
    with pytest.raises(DriveError, match='withdrawn'):
        net.result(failed)
    assert any('withdrawn, and 1 behind it' in text for text in net.reported(Severity.WARNING))
    assert 'to 9.1,' in commands.move(Move(0.1, relative=True))
    go(net, 12.0)
    assert motor(net) == pytest.approx(9.1, abs=2e-3)


class DeafWhileFull:
    """A drive that ignores bit 4 where it rises while bit 12 is set."""

    def __init__(self, net: VirtualNetwork) -> None:
        """Watch both words from now on."""
        self._full = True
        self._offered = self._ignored = False
        net.wire.alters = self

    def __call__(self, sender: str, frame: Frame) -> Frame:
        """Take the bit out of the controlword."""
        if frame.can_id == 0x180 + NODE_ID:
            self._full = bool(frame.data[1] & Statusword.SET_POINT_ACKNOWLEDGE >> 8)
        if frame.can_id != COMMAND_PDO:
            return frame
        offered = bool(frame.data[0] & Controlword.NEW_SET_POINT)
        rising, self._offered = offered and not self._offered, offered
        self._ignored = offered and (self._ignored or (rising and self._full))
        word = frame.data[0] & ~int(Controlword.NEW_SET_POINT) if self._ignored else frame.data[0]
        return frame._replace(data=bytes((word,)) + frame.data[1:])


def test_a_full_drive_that_receives_nothing_gets_the_move_later() -> None:
    """A drive that ignores set-points while its buffer is full makes its moves, then the new."""
    net = running_in(OperationMode.PROFILE_POSITION)
    full(net)
    DeafWhileFull(net)
    net.commands[JOINT].move(Move(-0.2))
    go(net, 6.0)
    assert motor(net) == pytest.approx(-0.2, abs=2e-3)


def test_a_queued_move_after_a_halt_goes_at_once() -> None:
    """The halt has ended the moves before it, so there is nothing that it could wait for."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(2.0)
    net.run(0.4)
    net.do(JOINT, 'halt', preempt=True)
    rest = motor(net)
    assert 'at once' in net.commands[JOINT].move(Move(0.0, immediate=False))
    assert 'after the moves' in net.commands[JOINT].move(Move(0.1, immediate=False))
    highest = go(net, 4.0)
    assert highest < rest + 5e-3
    assert motor(net) == pytest.approx(0.1, abs=2e-3)


def test_a_target_that_is_not_taken_does_not_end_the_halt() -> None:
    """Without an acknowledge it stays halted but for 50 ms, and both answer and log say so."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(2.0)
    net.run(0.4)
    net.do(JOINT, 'halt', preempt=True)

    def deaf(sender: str, frame: Frame) -> Frame:
        if frame.can_id != COMMAND_PDO:
            return frame
        return frame._replace(data=bytes((frame.data[0] & ~0x10,)) + frame.data[1:])

    net.wire.alters = deaf
    commands, begin = net.commands[JOINT], motor(net)
    with pytest.raises(DriveError, match='stays halted'):
        net.result(commands.deliver(lambda: commands.set_target(0.0)))
    net.run(0.2)
    assert abs(motor(net) - begin) < BRAKING_MAX / 5
    assert_rests(net, 4.0)
    assert net.drives[JOINT].control.halted
    assert any('stays halted' in text for text in net.reported(Severity.WARNING))


def without_acknowledge(sender: str, frame: Frame) -> Frame:
    """Clear bit 12 in the statusword of the drive."""
    if frame.can_id != STATUS_PDO or sender == 'master':
        return frame
    return frame._replace(data=frame.data[:1] + bytes((frame.data[1] & ~0x10,)) + frame.data[2:])


@pytest.mark.parametrize('before', [0.3, 2.0], ids=['not known yet', 'known'])
def test_a_drive_without_acknowledge_moves_after_a_halt(before: float) -> None:
    """The halt ends with the new set-point, and the old one does not revive."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.wire.alters = without_acknowledge
    net.commands[JOINT].set_target(5.0)
    net.run(before)
    net.do(JOINT, 'halt', preempt=True)
    rest = motor(net)
    net.commands[JOINT].set_target(rest - 0.2)
    highest = go(net, 4.0)
    assert highest < rest + 5e-3
    assert motor(net) == pytest.approx(rest - 0.2, abs=2e-3)
    assert not net.drives[JOINT].control.halted


def test_a_drive_without_acknowledge_is_reported_once() -> None:
    """It goes to every target, and queued moves wait for the one before (bit 10)."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.wire.alters = without_acknowledge
    for target in (0.3, 0.6, 0.1):
        net.commands[JOINT].set_target(target)
        go(net, 2.5)
        assert motor(net) == pytest.approx(target, abs=2e-3)
    turns = [0.8, 0.2, 0.7, 0.3, 0.6]  # more than a drive keeps
    for turn in turns:
        net.commands[JOINT].move(Move(turn, immediate=False))
    reached: list[float] = []
    for _ in range(700):
        net.run(PERIOD)
        left = turns[len(reached) :]
        reached += [turn for turn in left[:1] if abs(motor(net) - turn) < 3e-3]
    assert reached == turns
    assert motor(net) == pytest.approx(turns[-1], abs=2e-3)
    assert len([text for text in net.reported(Severity.WARNING) if 'bit 12' in text]) == 1


def test_relative_moves_count_from_what_the_drive_has_or_gets() -> None:
    """An immediate one that waits is not lost by the next, and the answers are where they end."""
    net = running_in(OperationMode.PROFILE_POSITION)
    commands = net.commands[JOINT]
    assert 'to 1,' in commands.move(Move(1.0))
    assert 'to 1.5,' in commands.move(Move(0.5, relative=True))
    go(net, 4.0)
    assert motor(net) == pytest.approx(1.5, abs=2e-3)
    for destination in ('1.6', '1.7', '1.8'):
        assert f'to {destination},' in commands.move(Move(0.1, relative=True))
    go(net, 3.0)
    assert motor(net) == pytest.approx(1.8, abs=2e-3)
    assert net.drives[JOINT].control.setpoint == pytest.approx(1.8)
    commands.move(Move(0.1, relative=True))
    commands.move(Move(0.5))
    assert 'to 0.4,' in commands.move(Move(-0.1, relative=True))
    go(net, 4.0)
    assert motor(net) == pytest.approx(0.4, abs=2e-3)


def test_a_relative_move_after_a_halt_is_refused() -> None:
    """It would count from the target that was given up; after an absolute one it is taken."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(2.0)
    net.run(0.5)
    net.do(JOINT, 'halt', preempt=True)
    with pytest.raises(DriveError, match=r'joint1: a relative move counts.*absolute'):
        net.commands[JOINT].move(Move(0.1, relative=True))
    assert_rests(net)
    net.commands[JOINT].move(Move(0.5))
    net.commands[JOINT].move(Move(0.1, relative=True))
    go(net, 3.0)
    assert motor(net) == pytest.approx(0.6, abs=2e-3)


BRAKING_MAX = 0.15  # [rad] from 1 rad/s at 5 rad/s^2, with the time to see it


class StuckMode:
    """A drive that keeps the mode that it has, whatever 0x6060 says."""

    def __init__(self, net: VirtualNetwork, mode: OperationMode) -> None:
        """Alter the mode in each RPDO from now on."""
        self._mode = mode
        net.wire.alters = self

    def __call__(self, sender: str, frame: Frame) -> Frame:
        """Put the old mode into the frame."""
        if frame.can_id != COMMAND_PDO:
            return frame
        return frame._replace(data=frame.data[:2] + bytes((self._mode,)))


@pytest.mark.parametrize(
    ('mode', 'target', 'other'),
    [
        (OperationMode.PROFILE_POSITION, 3.0, OperationMode.PROFILE_VELOCITY),
        (OperationMode.PROFILE_VELOCITY, 1.0, OperationMode.PROFILE_POSITION),
    ],
)
def test_a_refused_mode_switch_does_not_let_the_old_move_go_on(
    mode: OperationMode, target: float, other: OperationMode
) -> None:
    """Braked for the switch, it stays braked when the switch fails; the next target goes on."""
    net = running_in(mode)
    net.commands[JOINT].set_target(target)
    net.run(1.0)
    begin = motor(net)
    StuckMode(net, mode)
    with pytest.raises(DriveError, match='did not reach mode'):
        net.select(JOINT, other)
    assert motor(net) - begin < BRAKING_MAX
    assert_rests(net, 3.0)
    assert 'halted' in net.drives[JOINT].describe()
    net.commands[JOINT].set_target(-0.5)
    net.run(1.0)
    assert net.drives[JOINT].view.velocity < -0.3


def test_a_mode_that_goes_by_sdo_and_gets_lost_does_not_let_the_old_move_go_on() -> None:
    """However long 0x6060 takes, the halt lasts until 0x6061 shows the new mode."""
    config = drive_config(JOINT, NODE_ID)
    controlword = pdo(1, COMMAND_PDO, (0x6040, 0))
    net = running_in(OperationMode.PROFILE_POSITION, rpdos=(controlword, *config.rpdos[1:]))
    net.commands[JOINT].set_target(3.0)
    net.run(0.5)
    begin, position = net.now, motor(net)
    net.wire.loses = lambda sender, frame: (
        frame.can_id == 0x600 + NODE_ID
        and frame.data[1:3] == b'\x60\x60'
        and net.now < begin + 1.5
    )
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    assert net.now > begin + 1.5
    assert motor(net) - position < BRAKING_MAX
    assert_rests(net)


def test_init_in_motion_does_not_let_the_old_move_go_on() -> None:
    """Also for a drive that does not take mode 0."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(3.0)
    net.run(0.5)
    begin = motor(net)
    StuckMode(net, OperationMode.PROFILE_POSITION)
    net.do(JOINT, 'init')
    net.run(1.0)
    assert motor(net) - begin < BRAKING_MAX
    assert_rests(net)


@pytest.mark.parametrize('cycles', range(4, 60, 4))
def test_homing_that_is_cancelled_leaves_the_axis_at_rest(cycles: int) -> None:
    """While it brakes the move of before, while it switches, while it homes: it stops."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(2.0)
    net.run(0.5)
    begin = motor(net)
    commands = net.commands[JOINT]
    running = commands.run('home', commands.home(17))
    net.run(cycles * PERIOD)
    commands.cancel('cancelled')
    assert running.done
    net.run(0.5)
    assert abs(motor(net) - begin) < BRAKING_MAX
    assert_rests(net)
    net.run_until(lambda: net.drives[JOINT].control.accepts_targets)
    net.commands[JOINT].set_target(begin)
    go(net, 2.0)
    assert net.drives[JOINT].view.position == pytest.approx(begin, abs=2e-3)


def test_a_switch_that_is_cancelled_stays_halted() -> None:
    """A stop that ends it has the drive halted in the mode of before."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(3.0)
    net.run(0.5)
    StuckMode(net, OperationMode.PROFILE_POSITION)
    commands = net.commands[JOINT]
    running = commands.run('select', commands.select_mode(OperationMode.PROFILE_VELOCITY))
    net.run(1.0)
    assert not running.done
    assert 'halted' in net.do(JOINT, 'halt', preempt=True)
    assert_rests(net)
    assert net.drives[JOINT].control.mode.number is OperationMode.PROFILE_POSITION


@pytest.mark.parametrize('verb', ['halt', 'quick_stop', 'disable'])
def test_a_stop_at_any_moment_of_init_is_answered_truly(verb: str) -> None:
    """What the answer says of the state still holds later, whenever the stop came."""
    for millisecond in range(0, 80, 3):  # which meets the cycle of 10 ms at each of its moments
        net = VirtualNetwork(bus_config(drive_config(JOINT, NODE_ID)))
        net.boot()
        net.begin(JOINT, 'init')
        net.run(0.001 * millisecond)
        answer = net.do(JOINT, verb, preempt=True)
        net.run(0.1)
        drive = net.drives[JOINT]
        reported = 'Operation enabled' in answer
        assert reported == (drive.view.state is DriveState.OPERATION_ENABLED), (
            millisecond,
            answer,
        )
        assert reported == (verb == 'halt' and drive.control.halted), (millisecond, answer)


@pytest.mark.parametrize('cycles', range(16))
def test_a_halt_in_a_mode_switch_is_answered_truly(cycles: int) -> None:
    """Where the switch disables the drive: it stays as it is said to be, and nothing is wrong."""
    drive = drive_config(JOINT, NODE_ID)
    axis = replace(drive.axes[0], switching_state=DriveState.SWITCHED_ON)
    net = running_in(OperationMode.PROFILE_VELOCITY, axes=(axis,))
    commands = net.commands[JOINT]
    commands.run('select', commands.select_mode(OperationMode.PROFILE_POSITION))
    net.run(cycles * PERIOD)
    answer = net.do(JOINT, 'halt', preempt=True)
    net.run(0.2)
    enabled = net.drives[JOINT].view.state is DriveState.OPERATION_ENABLED
    assert ('Operation enabled' in answer) == enabled, answer
    assert not net.reported(Severity.ERROR)


@pytest.mark.parametrize('verb', ['halt', 'quick_stop'])
def test_a_lesser_stop_does_not_end_a_quick_stop(verb: str) -> None:
    """While its ramp runs the drive keeps its power, and so it does where 0x605A holds it."""
    writes = (*MOTION_WRITES, sdo_write(0x6085, 0, 10_000), sdo_write(0x605A, 0, 6))
    net = running_in(OperationMode.PROFILE_POSITION, sdo_writes=writes)
    net.commands[JOINT].set_target(3.0)
    net.run(0.8)
    net.begin(JOINT, 'quick_stop', preempt=True)
    net.run(0.1)
    assert 'Quick stop active' in net.do(JOINT, verb, preempt=True)
    assert abs(net.drives[JOINT].view.velocity) < 0.01
    assert 'nothing to' in net.do(JOINT, verb, preempt=True)
    net.run(3.0)
    assert net.drives[JOINT].view.state is DriveState.QUICK_STOP_ACTIVE


@pytest.mark.parametrize('verb', ['', 'disable', 'quick_stop', 'halt', 'shutdown'])
def test_recovery_does_not_undo_a_stop(verb: str) -> None:
    """A drive that was commanded to stop while it was away is not enabled when it comes back."""
    drive = drive_config(JOINT, NODE_ID)
    axis = replace(drive.axes[0], recovery=RecoveryPolicy.AUTO)
    net = running_in(OperationMode.CYCLIC_POSITION, axes=(axis,))
    net.power_off(JOINT)
    net.run(1.0)
    if verb:
        with pytest.raises(DriveError, match='cut its power: offline'):
            net.do(JOINT, verb, preempt=True)
    net.power_on(JOINT)
    net.run(3.0)
    enabled = net.drives[JOINT].view.state is DriveState.OPERATION_ENABLED
    assert enabled is not bool(verb)
