# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A halt wins over everything, and ends only with a new target; rest is seen, not believed."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import cycle
import math
import struct

from bus_rig import booted, JOINT, SetPointKind, SetPoints, VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    every_mode,
    MOTION_WRITES,
    pdo,
    PERIOD,
    SCALE,
    sdo_write,
)
from hypothesis import given, Phase, settings
from hypothesis import strategies as st
import pytest

from arm_canopen import DriveError, DriveState, OperationMode, Severity
from arm_canopen.cia402.modes import Move
from arm_canopen.cia402.state import WINDOW
from arm_canopen.cia402.stop import UNDER_HALT_TIME
from arm_canopen.config import RecoveryPolicy
from canopen_core.standard import ObjectDictionary, Statusword

pytestmark = pytest.mark.slow


NODE_ID = 2
COMMAND_PDO = 0x200 + NODE_ID
RESTS_AFTER = 0.7  # [s] without a motion; longer than a set-point waits under a halt
STANDING = 0.02  # [rad/s]
BRAKING_MAX = 0.15  # [rad] from 1 rad/s at 5 rad/s^2, with the time to see it


def running_in(mode: OperationMode, **changes: object) -> VirtualNetwork:
    """Return a network with one drive that is enabled in a mode."""
    net = booted(every_mode(drive_config(JOINT, NODE_ID, **changes)))
    net.enable(mode)
    return net


def go(net: VirtualNetwork, duration: float) -> float:
    """Run until the drive has rested for a while; return its highest position in [rad].

    Args:
        net: The network.
        duration: Longest time of the motion in [s].
    """
    highest, last, still = net.motor(), math.nan, 0
    for _ in range(round(duration / PERIOD)):
        net.run(PERIOD)
        still = still + 1 if net.motor() == last else 0
        if still * PERIOD > RESTS_AFTER:
            break
        last = net.motor()
        highest = max(highest, last)
    return highest


def assert_rests(net: VirtualNetwork, duration: float = 0.5) -> None:
    """Check that the motor stays where it is for a time in [s]."""
    begin = net.motor()
    net.run(duration)
    assert net.motor() == pytest.approx(begin, abs=2e-3)


@pytest.mark.parametrize('kind', [SetPointKind.ALWAYS, SetPointKind.UNLESS_FULL])
def test_an_immediate_move_does_not_wait_for_a_full_drive(kind: SetPointKind) -> None:
    """What is said to go at once goes at once, and what the drive held is discarded.

    A drive that ignores set-points while its buffer is full makes its moves first.
    """
    net = running_in(OperationMode.PROFILE_POSITION)
    for target in (0.5, 1.0, 1.5):
        net.commands[JOINT].move(Move(target, immediate=False))
    net.run(0.3)
    assert net.motor() > 0.05
    assert net.drives[JOINT].view.statusword & Statusword.SET_POINT_ACKNOWLEDGE
    SetPoints(net, kind)
    assert 'at once' in net.commands[JOINT].move(Move(-0.2))
    highest = go(net, 6.0)
    assert (highest < 0.5) is (kind is SetPointKind.ALWAYS)
    assert net.motor() == pytest.approx(-0.2, abs=2e-3)
    assert highest > 0.5 or not net.reported(Severity.WARNING)


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
    assert net.motor() == pytest.approx(9.1, abs=2e-3)


def test_a_drive_without_acknowledge_is_reported_once() -> None:
    """It goes to every target, and queued moves wait for the one before (bit 10)."""
    net = running_in(OperationMode.PROFILE_POSITION)
    SetPoints(net, SetPointKind.NEVER_ACKNOWLEDGES)
    for target in (0.3, 0.6, 0.1):
        net.target(target)
        go(net, 2.5)
        assert net.motor() == pytest.approx(target, abs=2e-3)
    turns = [0.8, 0.2, 0.7, 0.3, 0.6]  # more than a drive keeps
    for turn in turns:
        net.commands[JOINT].move(Move(turn, immediate=False))
    reached: list[float] = []
    for _ in range(700):
        net.run(PERIOD)
        left = turns[len(reached) :]
        reached += [turn for turn in left[:1] if abs(net.motor() - turn) < 3e-3]
    assert reached == turns
    assert net.motor() == pytest.approx(turns[-1], abs=2e-3)
    assert len([text for text in net.reported(Severity.WARNING) if 'bit 12' in text]) == 1


TAKES, BLIND, SILENT = SetPointKind.ALWAYS, SetPointKind.NEVER, SetPointKind.NEVER_ACKNOWLEDGES


@pytest.mark.parametrize(
    'targets',
    [
        [(TAKES, 0.1), (SILENT, 0.5), (BLIND, 0.1)],
        [(BLIND, 0.5), (SILENT, 0.0), (SILENT, 0.3)],  # the second is where it stands
    ],
    ids=['acknowledges no more', 'sees none at first'],
)
def test_a_drive_without_acknowledge_is_judged_by_its_motion(
    targets: list[tuple[SetPointKind, float]],
) -> None:
    """A target that moves it is answered as taken, and one that does not as refused."""
    net = running_in(OperationMode.PROFILE_POSITION)
    commands = net.commands[JOINT]
    for kind, target in targets:
        SetPoints(net, kind)
        answered = commands.deliver(partial(commands.set_target, target))
        if kind is BLIND:
            with pytest.raises(DriveError, match=r'has not taken its target .*bit 12'):
                net.result(answered)
            assert_rests(net)
        else:
            net.result(answered)
            go(net, 2.5)
            assert net.motor() == pytest.approx(target, abs=2e-3)


def test_relative_moves_count_from_what_the_drive_has_or_gets() -> None:
    """An immediate one that waits is not lost by the next, and the answers are where they end."""
    net = running_in(OperationMode.PROFILE_POSITION)
    commands = net.commands[JOINT]
    assert 'to 1,' in commands.move(Move(1.0))
    assert 'to 1.5,' in commands.move(Move(0.5, relative=True))
    go(net, 4.0)
    assert net.motor() == pytest.approx(1.5, abs=2e-3)
    for destination in ('1.6', '1.7', '1.8'):
        assert f'to {destination},' in commands.move(Move(0.1, relative=True))
    go(net, 3.0)
    assert net.motor() == pytest.approx(1.8, abs=2e-3)
    assert net.drives[JOINT].setpoint == pytest.approx(1.8)
    commands.move(Move(0.1, relative=True))
    commands.move(Move(0.5))
    assert 'to 0.4,' in commands.move(Move(-0.1, relative=True))
    go(net, 4.0)
    assert net.motor() == pytest.approx(0.4, abs=2e-3)


def test_a_halt_has_ended_the_moves_before_it() -> None:
    """A relative one would count from what was given up; a queued one has nothing to wait for."""
    net = running_in(OperationMode.PROFILE_POSITION)
    commands = net.commands[JOINT]
    net.target(2.0)
    net.run(0.4)
    net.do(JOINT, 'halt', preempt=True)
    rest = net.motor()
    with pytest.raises(DriveError, match=r'joint1: a relative move counts.*absolute'):
        commands.move(Move(0.1, relative=True))
    assert_rests(net)
    assert 'at once' in commands.move(Move(0.0, immediate=False))
    assert 'after the moves' in commands.move(Move(0.1, relative=True, immediate=False))
    highest = go(net, 4.0)
    assert highest < rest + 5e-3
    assert net.motor() == pytest.approx(0.1, abs=2e-3)


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
    net.target(target)
    net.run(1.0)
    begin = net.motor()
    net.keep_mode(mode)
    with pytest.raises(DriveError, match='did not reach mode'):
        net.select(JOINT, other)
    assert net.motor() - begin < BRAKING_MAX
    assert_rests(net, 3.0)
    assert 'halted' in net.drives[JOINT].describe()
    net.target(-0.5)
    net.run(1.0)
    assert net.drives[JOINT].view.velocity < -0.3


def test_a_mode_that_goes_by_sdo_and_gets_lost_does_not_let_the_old_move_go_on() -> None:
    """However long 0x6060 takes, the halt lasts until 0x6061 shows the new mode."""
    config = drive_config(JOINT, NODE_ID)
    controlword = pdo(1, COMMAND_PDO, (0x6040, 0))
    net = running_in(OperationMode.PROFILE_POSITION, rpdos=(controlword, *config.rpdos[1:]))
    net.target(3.0)
    net.run(0.5)
    begin, position = net.now, net.motor()
    net.wire.loses = lambda sender, frame: (
        frame.can_id == 0x600 + NODE_ID
        and frame.data[1:3] == b'\x60\x60'
        and net.now < begin + 1.5
    )
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    assert net.now > begin + 1.5
    assert net.motor() - position < BRAKING_MAX
    assert_rests(net)


@pytest.mark.parametrize('verb', ['', 'disable', 'quick_stop', 'halt', 'shutdown', 'fault'])
def test_recovery_does_not_undo_a_stop(verb: str) -> None:
    """A drive that was stopped while it was away, or is faulted, is not enabled by itself."""
    net = running_in(OperationMode.CYCLIC_POSITION, scales={'recovery': RecoveryPolicy.AUTO})
    net.power_off(JOINT)
    net.run(1.0)
    if verb not in {'', 'fault'}:
        with pytest.raises(DriveError, match='cut its power: offline'):
            net.do(JOINT, verb, preempt=True)
    net.power_on(JOINT)
    if verb == 'fault':
        net.simulated().raise_fault(0x4310, net.now)
    net.run(3.0)
    enabled = net.drives[JOINT].view.state is DriveState.OPERATION_ENABLED
    assert enabled is not bool(verb)
    assert any('not enabled again' in text for text in net.reported()) is (verb == 'fault')


@pytest.mark.parametrize('cycles', range(4, 60, 4))
def test_homing_that_is_cancelled_leaves_the_axis_at_rest(cycles: int) -> None:
    """While it brakes the move of before, while it switches, while it homes: it stops."""
    net = running_in(OperationMode.PROFILE_POSITION)
    net.target(2.0)
    net.run(0.5)
    begin = net.motor()
    commands = net.commands[JOINT]
    running = net.home(17)
    net.run(cycles * PERIOD)
    commands.cancel('cancelled')
    assert running.done
    net.run(0.5)
    assert abs(net.motor() - begin) < BRAKING_MAX
    assert_rests(net)
    net.run_until(lambda: net.drives[JOINT].accepts_targets)
    net.target(begin)
    go(net, 2.0)
    assert net.drives[JOINT].view.position == pytest.approx(begin, abs=2e-3)


OLD = 3.0  # [rad] the target that a halt gives up; the axis never gets there
BRAKING = 0.1  # [rad] from the profile velocity, 1 rad/s, at 5 rad/s^2
ACCURACY = 5e-3  # [rad]
ANSWER_MAX = 3.5  # [s] to the answer and the end of the move
ANSWERED_FOR = 0.3  # [s] without a motion after the answer
HALT_OPTION = 0x605D


UNSHRUNK = (Phase.explicit, Phase.reuse, Phase.generate)  # an example takes long


REFUSE_AFTER_HALT = (SetPointKind.WORD_AFTER_HALT, SetPointKind.NEVER)
REFUSE_WHEN_FULL = (
    SetPointKind.UNLESS_FULL,
    SetPointKind.AFTER_HALT,
    SetPointKind.EDGE_AFTER_HALT,
)


def halting(kind: SetPointKind, option: int = 1, *, leads: bool = False) -> VirtualNetwork:
    """Return a network whose drive begins to go to a target in mode 1."""
    writes = (*MOTION_WRITES, sdo_write(HALT_OPTION, 0, option))
    config = drive_config(JOINT, NODE_ID, sdo_writes=writes)
    if leads:
        config = drive_config(JOINT, NODE_ID, sdo_writes=writes, rpdos=config.rpdos[::-1])
    net = booted(config)
    SetPoints(net, kind)
    net.enable(OperationMode.PROFILE_POSITION)
    net.target(OLD)
    return net


def answer(net: VirtualNetwork, target: float) -> tuple[str, float]:
    """Command a target as ~/target does, and let the axis come to rest.

    Returns:
        The answer, empty when it was refused, and how far the axis went towards the old target,
        beyond the way to the new one, in [rad].
    """
    begin = net.motor()
    allowed = max(0.0, target - begin)
    commands = net.commands[JOINT]
    promise = commands.deliver(lambda: commands.set_target(target))
    beyond, last, still = 0.0, math.nan, 0
    for _ in range(round(ANSWER_MAX / PERIOD)):
        net.run(PERIOD)
        still = still + 1 if promise.done and net.motor() == last else 0
        if still * PERIOD > ANSWERED_FOR:
            break
        last = net.motor()
        beyond = max(beyond, last - begin - allowed)
    assert promise.done
    return ('' if promise.error is not None else str(promise.result())), beyond


@pytest.mark.parametrize('kind', SetPointKind)
@settings(max_examples=6, phases=UNSHRUNK)
@given(
    new=st.floats(-0.5, 0.5),
    option=st.sampled_from([1, 2, 3, 4]),
    under_way=st.floats(0.05, 1.5),
    queued=st.integers(0, 4),
    leads=st.booleans(),
)
def test_a_halt_ends_with_the_new_target_or_with_an_error(
    kind: SetPointKind, new: float, option: int, under_way: float, queued: int, *, leads: bool
) -> None:
    """The axis goes to the new target and never on to an old one; else the answer says so."""
    net = halting(TAKES if kind is BLIND else kind, option, leads=leads)
    for n in range(queued):
        net.commands[JOINT].move(Move(OLD + n, immediate=False))
    net.run(under_way)
    net.do(JOINT, 'halt', preempt=True)
    for target in (new, -new):  # what was learned of the drive holds the second time, too
        if kind is BLIND:
            SetPoints(net, BLIND)
        reported, beyond = answer(net, target)
        if reported:
            assert net.motor() == pytest.approx(target, abs=ACCURACY)
            assert beyond < ACCURACY
            assert not net.drives[JOINT].halt.held
        else:
            assert kind in REFUSE_AFTER_HALT or (queued and kind in REFUSE_WHEN_FULL)
            assert beyond < BRAKING
            assert net.drives[JOINT].halt.held
            assert abs(net.drives[JOINT].view.velocity) < ACCURACY
            assert any('stays halted' in text for text in net.reported(Severity.WARNING))
        if kind is BLIND:
            SetPoints(net, TAKES)
        net.target(OLD)
        net.run(0.5)
        net.do(JOINT, 'halt', preempt=True)


def test_only_the_first_target_waits_for_an_acknowledge_under_halt() -> None:
    """That a drive sees set-points only after a halt is learned, and no warning is due."""
    net = halting(SetPointKind.EDGE_AFTER_HALT)
    commands = net.commands[JOINT]
    waited = []
    for target in (-0.1, 0.1):
        net.run(0.3)
        net.do(JOINT, 'halt', preempt=True)
        begin = net.now
        net.result(commands.deliver(partial(commands.set_target, target)))
        waited.append(net.now - begin)
    assert waited[0] > UNDER_HALT_TIME
    assert waited[1] < 10 * PERIOD
    assert not net.reported(Severity.WARNING)


@pytest.mark.parametrize('period', [0.002, PERIOD, 0.05])
@pytest.mark.parametrize('speed', [0.5, -0.02])
def test_the_velocity_is_that_of_the_position_where_no_pdo_carries_it(
    speed: float, period: float
) -> None:
    """Shown to motion sources and in /joint_states, a few cycles late, whatever the cycle is."""
    config = drive_config(JOINT, NODE_ID)
    has = config.dictionary
    seen = replace(
        config,
        dictionary=ObjectDictionary(entry for entry in has if entry.index != 0x606C),
        tpdos=(config.tpdos[0], pdo(2, 0x280 + NODE_ID, (0x6064, 0))),
    )
    bus = bus_config(seen, sync_period=period, cycle_period=period)
    net = VirtualNetwork(bus, dictionaries={JOINT: has})
    net.boot()
    net.enable(OperationMode.PROFILE_VELOCITY)
    net.target(speed)
    net.run(0.8)
    assert net.speed() == pytest.approx(speed, rel=0.02)
    resolution = 2.0 / WINDOW / SCALE  # what one increment makes in the window
    for _ in range(20):
        net.run(period)
        shown = net.drives[JOINT].view.velocity
        assert shown == pytest.approx(speed, rel=1e-3, abs=resolution)


METRE = 1_000_000.0  # [inc/m]
METRES = {'scale_pos_to_dev': METRE, 'scale_pos_from_dev': 1 / METRE}
METRES |= {'scale_vel_to_dev': METRE, 'scale_vel_from_dev': 1 / METRE}


def sliding(*writes: tuple[int, int, int]) -> VirtualNetwork:
    """Return an enabled network with one drive that counts micrometres, and holds these values."""
    values = tuple(sdo_write(*write) for write in ((0x60C2, 1, 10), *writes))
    net = booted(drive_config(JOINT, NODE_ID, scales=METRES, sdo_writes=values))
    net.do(JOINT, 'init')
    return net


def test_rest_is_by_the_limits_of_the_axis() -> None:
    """A joint in metres with 2 m/s is not at rest at 20 mm/s."""
    ramps = ((index, 0, 2_000_000) for index in (0x6083, 0x6084, 0x6085))
    net = sliding((0x607F, 0, 4_000_000), (0x6081, 0, 2_000_000), *ramps)
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    net.target(0.018)
    net.run(1.0)
    drive = net.simulated()
    assert drive.velocity / METRE == pytest.approx(0.018, rel=0.02)
    assert not net.drives[JOINT].view.stands
    net.do(JOINT, 'halt')
    assert abs(drive.velocity) / METRE <= 0.004


@pytest.mark.parametrize(
    ('writes', 'speed_limit'),
    [
        ([(0x607F, 0, 200_000)], 0.02),  # a tenth of its greatest speed
        ([(0x607F, 0, 0), (0x607D, 1, 0), (0x607D, 2, 40_000)], 0.004),  # its range in 10 s
        ([(0x607F, 0, 10_000), (0x6081, 0, 50_000)], 0.01),  # never above its greatest speed
    ],
)
def test_the_speed_of_single_targets_is_by_the_limits_of_the_axis(
    writes: list[tuple[int, int, int]], speed_limit: float
) -> None:
    """Where 0x6081 does not say it; half a metre per second is none for an axis of 40 mm."""
    ramps = ((index, 0, 1_000_000) for index in (0x6083, 0x6084))
    net = sliding((0x6081, 0, 0), *ramps, *writes)
    net.select(JOINT, OperationMode.CYCLIC_POSITION)
    net.target(0.03)
    fastest = 0.0
    for _ in range(100):
        net.run(PERIOD)
        fastest = max(fastest, net.drives[JOINT].view.velocity)
    assert fastest == pytest.approx(speed_limit, rel=0.02)


def test_a_coarse_unit_of_velocity_hides_no_motion() -> None:
    """2 rpm of a joint without gear are noise of 0x606C, and no rest where the position moves."""
    rpm = 2.0 * math.pi / 60.0
    scales = {'scale_vel_to_dev': 1.0 / rpm, 'scale_vel_from_dev': rpm}
    writes = ((0x60C2, 1, 10), (0x6081, 0, 10), *((index, 0, 20) for index in (0x6083, 0x6084)))
    config = drive_config(
        JOINT, NODE_ID, scales=scales, sdo_writes=tuple(sdo_write(*write) for write in writes)
    )
    net = VirtualNetwork(bus_config(config), rate_units={0: (rpm * SCALE, rpm * SCALE)})
    net.boot()
    net.enable(OperationMode.PROFILE_VELOCITY)
    net.target(2.0 * rpm)
    net.run(1.0)
    assert abs(net.speed()) == pytest.approx(2.0 * rpm, rel=0.02)
    assert not net.drives[JOINT].view.stands
    net.do(JOINT, 'halt')
    assert abs(net.speed()) <= STANDING


def test_noise_is_standstill() -> None:
    """A slow profile and an encoder that flickers: a halt ends, and the mode can be switched."""
    net = running_in(
        OperationMode.PROFILE_POSITION, sdo_writes=(*MOTION_WRITES, sdo_write(0x6081, 0, 500))
    )
    noise = cycle((-10, 10))

    def flickers(data: bytes) -> bytes:
        position, velocity = struct.unpack('<ii', data)
        return struct.pack('<ii', position, velocity + next(noise))

    net.alter(0x280 + NODE_ID, flickers)
    net.do(JOINT, 'halt', preempt=True)
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
