# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Every mode and every command of a drive: what it answers, and where the motor is then."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
import math
import struct
from typing import Any

from bus_rig import booted, JOINT, Leader, VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    drive_dictionary,
    every_mode,
    MOTION_WRITES,
    PERIOD,
    SCALE,
    sdo_write,
    with_defaults,
)
import pytest

from arm_canopen import DriveError, DriveState, NodeConfig, OperationMode, Severity
from arm_canopen.cia402.modes.profile_position import Move, QUEUE_MAX
from arm_canopen.cia402.sequences import HomingProgress
from arm_canopen.config import DriveConfig
from canopen_core.can import Frame
from canopen_core.standard import (
    DataType,
    NmtCommand,
    ObjectDictionary,
    ObjectEntry,
    TORQUE_MODES,
)
from canopen_sim import Fault, FaultInjection

pytestmark = pytest.mark.slow

CLEAR = b'\xc4\x60\x06'  # 0x60C4:06 in an SDO
NODE_ID = 2


def by_name(value: object) -> str:
    """Name a mode in the id of a test."""
    return value.name if isinstance(value, OperationMode) else str(value)


def full_drive(**changes: Any) -> NodeConfig:
    """Return a drive whose RPDOs carry the targets of all modes."""
    return every_mode(drive_config(JOINT, NODE_ID, **changes))


def with_modes(**changes: Any) -> VirtualNetwork:
    """Return a network with such a drive, booted."""
    return booted(full_drive(**changes))


@pytest.mark.parametrize('mapped', [True, False], ids=['TPDO', 'SDO'])
def test_a_switch_to_torque_keeps_the_load(*, mapped: bool) -> None:
    """Mode 10 begins with the torque that holds the axis, not with zero."""
    config = full_drive()
    net = booted(config if mapped else replace(config, tpdos=config.tpdos[:2]))
    net.enable(OperationMode.CYCLIC_POSITION)
    drive = net.simulated()
    drive.set_load(150, net.now)
    net.run(1.0)
    held = net.motor()
    net.select(JOINT, OperationMode.CYCLIC_TORQUE)
    first = struct.unpack('<h', net.frames(0x400 + NODE_ID)[-1][4:6])[0]
    assert abs(first) == pytest.approx(150, abs=30)
    net.run(0.2)
    assert net.motor() == pytest.approx(held, abs=0.05)
    net.do(JOINT, 'halt')
    assert not net.reported(Severity.WARNING)  # bit 12 goes with bit 8, as commanded
    net.run(0.2)
    halted = struct.unpack('<h', net.frames(0x400 + NODE_ID)[-1][4:6])[0]
    assert halted == pytest.approx(first, abs=30)  # the next target begins with the load, too


@pytest.mark.parametrize('mode', TORQUE_MODES, ids=by_name)
@pytest.mark.parametrize('fault', [Fault.SDO_ABORT, Fault.SDO_SILENCE, None])
def test_a_torque_that_cannot_be_read_drops_no_load(
    mode: OperationMode, fault: Fault | None
) -> None:
    """The switch is refused with object and remedy; the mode of before goes on to hold.

    A drive that has no such object has no other way than to drop its load, which is a warning.
    """
    config = full_drive()
    config = replace(config, tpdos=config.tpdos[:2])
    if fault is None:
        entries = ObjectDictionary(each for each in config.dictionary if each.index != 0x6077)
        config = replace(config, dictionary=entries)
    net = booted(config)
    net.enable(OperationMode.CYCLIC_POSITION)
    assert not net.reported(Severity.WARNING)
    if fault is not None:
        net.simulated().set_load(150, net.now)
        net.run(1.0)
        held, faults = net.motor(), net.devices[JOINT].faults
        faults.inject(FaultInjection(fault, object=(0x6077, 0)), net.now)
        with pytest.raises(DriveError, match=r'drop its load.*0x6077.*map 0x6077 into a TPDO'):
            net.select(JOINT, mode)
        net.run(0.5)
        assert net.drives[JOINT].view.mode == OperationMode.CYCLIC_POSITION
        assert net.motor() == pytest.approx(held, abs=1e-3)
        faults.end(net.now)
    assert 'Operation enabled' in net.select(JOINT, mode)
    warned = any('without torque' in text for text in net.reported(Severity.WARNING))
    assert warned is (fault is None)


def test_moves_are_for_mode_1_and_within_the_limits() -> None:
    """Another mode, a limit and a full queue are refused in words."""
    net = with_modes(sdo_writes=LIMITS)
    net.enable(OperationMode.CYCLIC_POSITION)
    with pytest.raises(DriveError, match='only in mode 1'):
        net.commands[JOINT].move(Move(0.1))
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    with pytest.raises(DriveError, match=r'software limits -0\.5 to 0\.5'):
        net.commands[JOINT].move(Move(0.6))
    net.commands[JOINT].move(Move(0.4))
    with pytest.raises(DriveError, match='software limits'):
        net.commands[JOINT].move(Move(0.2, relative=True))
    for _ in range(QUEUE_MAX - 1):
        net.commands[JOINT].move(Move(0.1, immediate=False))
    with pytest.raises(DriveError, match='moves wait'):
        net.commands[JOINT].move(Move(0.1, immediate=False))


LIMITS = (*MOTION_WRITES, sdo_write(0x607D, 1, -5_000), sdo_write(0x607D, 2, 5_000))


@pytest.mark.parametrize(
    ('home', 'ends', 'low', 'high'),
    [
        (2_000, (0, 0), -0.7, 0.3),  # 0x607D counts from home
        (0, (0, 0), -0.5, 0.5),
        (0, (-3_000, 3_000), -0.3, 0.3),
        (0, (-9_000, 9_000), -0.5, 0.5),
        (0, (-(2**31), 2**31 - 1), -0.5, 0.5),
    ],
)
def test_no_target_leads_beyond_the_limits(
    home: int, ends: tuple[int, int], low: float, high: float
) -> None:
    """0x607D less the home offset 0x607C, also when that is written, and the range 0x607B.

    Behind the ends of that range positions wrap: an axis is not seen where it is.
    """
    config = drive_config(JOINT, NODE_ID, sdo_writes=(*LIMITS, sdo_write(0x607C, 0, home)))
    added = [
        ObjectEntry(0x607B, number, 'Position range limit', DataType.INTEGER32, default=end)
        for number, end in enumerate(ends, 1)
    ]
    net = booted(replace(config, dictionary=ObjectDictionary([*config.dictionary, *added])))
    net.enable(OperationMode.CYCLIC_POSITION)
    words = f'is beyond the software limits {low:g} to {high:g} '
    for limit, beyond in ((low, low - 0.1), (high, high + 0.1)):
        with pytest.raises(DriveError, match=f'{beyond:g} {words}'):
            net.target(beyond)
        net.target(limit)
        net.run(2.0)
        assert net.motor() == pytest.approx(limit, abs=1e-3)
    if home:
        net.result(net.commands[JOINT].axis.node.objects.write_object(0x607C, 0, -home))
        net.run(0.5)
        with pytest.raises(DriveError, match=r'software limits -0\.3 to 0\.7'):
            net.target(0.8)


def test_home_is_a_command_of_its_own() -> None:
    """It enables, reports its phases, sets the reference and returns to the mode of before."""
    net = with_modes(sdo_writes=(*MOTION_WRITES, sdo_write(0x607C, 0, 2_000)))
    phases: list[HomingProgress] = []
    commands = net.commands[JOINT]
    answer = net.result(commands.run('home', commands.home(35, phases.append)))
    assert 'homed by method 35' in answer
    assert phases == list(HomingProgress)
    assert net.drives[JOINT].view.state is DriveState.OPERATION_ENABLED
    assert net.drives[JOINT].mode.number is OperationMode.NO_MODE
    net.run(0.1)
    assert net.drives[JOINT].view.position == pytest.approx(0.2, abs=1e-3)


@pytest.mark.parametrize(('period', 'every'), [(0.05, 1), (0.1, 1), (0.2, 1), (0.01, 40)])
def test_the_bits_of_the_last_homing_end_no_other(period: float, every: int) -> None:
    """With a slow SYNC, or a statusword that answers few of them; a fault is reset there, too."""
    fast = (*MOTION_WRITES, sdo_write(0x6099, 1, 2_000), sdo_write(0x6099, 2, 1_000))
    config = full_drive(sdo_writes=fast)
    slow = replace(config.tpdos[0], transmission=every)
    config = replace(config, tpdos=(slow, *config.tpdos[1:]))
    net = booted(config, sync_period=period, cycle_period=period)
    net.enable(OperationMode.PROFILE_POSITION)
    for _ in range(2):
        assert 'homed by method 17' in net.result(net.home(17), 60.0)
        assert net.motor() == pytest.approx(0.05, abs=0.01)
        net.target(0.5)
        net.run(3.0)
    with pytest.raises(DriveError, match='failed to home by method 99'):
        net.result(net.home(99), 60.0)
    net.devices[JOINT].faults.inject(FaultInjection(Fault.ENCODER_LOSS, duration=1.5), net.now)
    net.run(1.0)
    assert 'Operation enabled' in net.do(JOINT, 'recover')


@pytest.mark.parametrize('every', [2, 3, 4])
def test_a_fault_reset_reaches_a_drive_that_looks_less_often(every: int) -> None:
    """The pulse lasts several cycles, so that no rate of the drive misses it each time."""
    net = with_modes()
    net.do(JOINT, 'init')
    words = count(1)

    def loses(sender: str, frame: Frame) -> bool:
        return frame.can_id == 0x200 + NODE_ID and next(words) % every != 0

    net.wire.loses = loses
    net.simulated().raise_fault(0x3210, net.now)
    net.run(0.3)
    assert 'Operation enabled' in net.do(JOINT, 'recover')


HOME_35 = (*MOTION_WRITES, sdo_write(0x6098, 0, 35))


def method_of(net: VirtualNetwork) -> int:
    """Return what the simulated drive has in 0x6098."""
    return net.devices[JOINT].store.integer(0x6098).value


def test_init_homes_by_the_method_of_bus_yml_whatever_was_tried_before() -> None:
    """A method that somebody wrote counts for ~/home, and the drive keeps it after ~/init.

    One that is merely stored in the drive is named, not run.
    """
    net = with_modes(sdo_writes=HOME_35)
    net.result(net.home(34))
    net.result(net.commands[JOINT].axis.node.objects.write_object(0x6098, 0, 37))
    assert 'homed by method 37' in net.do(JOINT, 'home')
    assert 'homed by method 35' in net.do(JOINT, 'init')
    writes = [data[4] for data in net.frames(0x600 + NODE_ID) if data[:3] == b'\x2f\x98\x60']
    assert writes == [35, 34, 35, 37, 35, 37]
    stored = with_defaults(drive_dictionary().for_node(NODE_ID), {(0x6098, 0): 37})
    net = VirtualNetwork(bus_config(full_drive()), dictionaries={JOINT: stored})
    net.boot()
    assert 'call ~/home' in (answer := net.do(JOINT, 'init'))
    assert 'homed by' not in answer


@pytest.mark.parametrize('end', ['fails', 'late', 'cut', 'power'])
def test_a_homing_method_is_for_this_time_only(end: str) -> None:
    """However it ends: the next homing goes by the method of before, or a warning says else."""
    net = with_modes(sdo_writes=HOME_35)
    net.do(JOINT, 'init')
    if end == 'late':
        delay = FaultInjection(Fault.SDO_DELAY, object=(0x6098, 0), delay=0.3, duration=1.0)
        net.devices[JOINT].faults.inject(delay, net.now)
    method = 99 if end == 'fails' else 1
    running = net.home(method)
    if end in ('cut', 'power'):
        net.run_until(lambda: method_of(net) == method)
    if end == 'cut':
        net.do(JOINT, 'halt', preempt=True)
    elif end == 'power':
        net.run(0.2)
        net.power_off(JOINT)
    net.run_until(lambda: running.done, 60.0)
    net.run(3.0)
    assert isinstance(running.error, DriveError)
    assert end != 'fails' or 'method 99' in str(running.error)
    assert end == 'power' or method_of(net) == 35
    assert any('35 was not put back' in text for text in net.reported()) is (end == 'power')


def test_without_voltage_the_answer_names_the_safety_circuit() -> None:
    """STO low at the start is no failure of the bring-up; init says what is missing."""
    net = VirtualNetwork(bus_config(full_drive()))
    drive = net.simulated()
    drive.set_voltage(False, net.now)
    net.boot()
    with pytest.raises(DriveError, match='bit 4: is the safe torque off'):
        net.do(JOINT, 'init')
    drive.set_voltage(True, net.now)
    net.run(0.5)
    assert net.drives[JOINT].view.state is not DriveState.OPERATION_ENABLED
    net.do(JOINT, 'init')


def test_units_come_from_the_drive_when_bus_yml_has_none() -> None:
    """0x608F, 0x6091 and 0x6092: a revolution of the shaft is 2 pi."""
    factors = {(0x608F, 1): 4096, (0x608F, 2): 1, (0x6091, 1): 50, (0x6091, 2): 1}
    factors |= {(0x6092, 1): 360_000, (0x6092, 2): 1}
    dictionary = with_defaults(drive_dictionary().for_node(NODE_ID), factors)
    axis = DriveConfig(name=JOINT, scale_from_factor_group=True)
    config = replace(full_drive(), axes=(axis,), dictionary=dictionary)
    net = VirtualNetwork(bus_config(config))
    net.boot()
    assert net.drives[JOINT].view.units.position.to_device(2 * math.pi) == 360_000
    assert net.drives[JOINT].view.units.velocity.to_device(2 * math.pi) == 360_000
    assert '0x608F' in net.drives[JOINT].view.parameters.units


def test_unknown_quirks_are_refused_with_those_that_exist() -> None:
    """A typing error in bus.yml is not silently the standard."""
    with pytest.raises(DriveError, match="'fesot' are unknown; known: festo_cmmp"):
        with_modes(scales={'quirks': 'fesot'})


def test_the_buffer_of_mode_7_is_emptied_first() -> None:
    """0x60C4:06 gets 0 and 1 before 0x6060 gets 7, so that no old set-point waits in it."""
    net = with_modes()
    net.do(JOINT, 'init')
    begin = net.now
    net.select(JOINT, OperationMode.INTERPOLATED_POSITION)
    writes = [data for data in net.frames(0x600 + NODE_ID, since=begin) if data[1:4] == CLEAR]
    assert [data[4] for data in writes] == [0, 1]
    sent = [sent.frame for sent in net.wire.log if sent.time >= begin]
    last_write = max(n for n, frame in enumerate(sent) if frame.data[1:4] == CLEAR)
    words = [n for n, frame in enumerate(sent) if frame.can_id == 0x200 + NODE_ID]
    assert last_write < min(n for n in words if sent[n].data[2] == 7)


@pytest.mark.parametrize('mapped', [True, False], ids=['RPDO', 'SDO'])
@pytest.mark.parametrize(
    ('quirk', 'reported', 'has'),
    [*(('no_mode_zero', mode, 8) for mode in (0, 1, 3, 8)), ('', 0, 3), ('', 0, 8)],
)
def test_no_mode_is_sent_that_no_client_has_selected(
    quirk: str, reported: int, has: int, *, mapped: bool
) -> None:
    """After each boot: mode 0, or with the quirk `no_mode_zero` the mode that the drive has.

    That is neither its default in the EDS nor, without the quirk, what the device had before.
    """
    dictionary = with_defaults(drive_dictionary(), {(0x6060, 0): reported}).for_node(NODE_ID)
    config = full_drive(dictionary=dictionary, scales={'quirks': quirk} if quirk else {})
    if not mapped:
        first = replace(config.rpdos[0], mapping=config.rpdos[0].mapping[:1])
        config = replace(config, rpdos=(first, *config.rpdos[1:]))
    held = with_defaults(drive_dictionary(), {(0x6060, 0): has, (0x6061, 0): has})
    net = VirtualNetwork(bus_config(config), dictionaries={JOINT: held.for_node(NODE_ID)})
    unselected = {0} if not quirk else {has} if mapped else set[int]()

    def sent(since: float) -> set[int]:
        if mapped:
            return {data[2] for data in net.frames(0x200 + NODE_ID, since=since)}
        requests = net.frames(0x600 + NODE_ID, since=since)
        return {data[4] for data in requests if data[:3] == b'\x2f\x60\x60'}

    net.boot()
    net.run(0.2)
    net.do(JOINT, 'init')
    net.do(JOINT, 'halt')
    assert sent(0.0) == unselected
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.target(0.5)
    net.run(2.0)
    assert net.motor() == pytest.approx(0.5, abs=0.01)
    net.power_off(JOINT)
    net.run(1.0)
    begin = net.now
    net.power_on(JOINT)
    net.run_until(net.all_ready)
    net.run(0.2)
    assert sent(begin) == unselected
    net.enable(OperationMode.PROFILE_VELOCITY)
    net.do(JOINT, 'halt')
    assert net.simulated().state is DriveState.OPERATION_ENABLED
    assert sent(begin) == {*unselected, 3}


def deviating(fault: Fault) -> VirtualNetwork:
    """Return a booted network whose drive deviates from the standard."""
    net = VirtualNetwork(bus_config(full_drive()))
    net.devices[JOINT].faults.inject(FaultInjection(fault), net.now)
    net.boot()
    return net


@pytest.mark.parametrize('command', ['home', 'init'])
@pytest.mark.parametrize('goes_on', [False, True])
def test_a_homing_that_takes_too_long_names_the_key_of_bus_yml(
    command: str, *, goes_on: bool
) -> None:
    """The motor stops, also where the drive goes on by its own bit 4 and stays in mode 6."""
    writes = (*MOTION_WRITES, sdo_write(0x6098, 0, 17))
    net = with_modes(sdo_writes=writes, scales={'homing_timeout': 0.5})
    began = False

    def keeps_homing(data: bytes) -> bytes:
        nonlocal began
        began = began or (data[2] == OperationMode.HOMING and bool(data[0] & 0x10))
        return bytes((data[0] | 0x10, data[1], OperationMode.HOMING)) if began else data

    if goes_on:
        net.alter(0x200 + NODE_ID, keeps_homing)
    with pytest.raises(DriveError, match=r'homing 17 within 0\.5 s .raise homing_timeout_seconds'):
        net.do(JOINT, command)
    net.run(1.0)
    stood = net.motor()
    net.run(1.0)
    assert net.motor() == stood


@pytest.mark.parametrize('mode', [OperationMode.PROFILE_POSITION, OperationMode.CYCLIC_POSITION])
def test_a_move_that_ends_elsewhere_has_not_arrived(mode: OperationMode) -> None:
    """A drive with limits of its own, less its home offset, shortens the way without a word."""
    limits = {(0x607D, 1): -15_000, (0x607D, 2): 5_000}
    drive = with_defaults(drive_dictionary().for_node(NODE_ID), limits)
    net = VirtualNetwork(bus_config(full_drive()), dictionaries={JOINT: drive})

    def shown(data: bytes) -> bytes:
        limit = struct.pack('<i', -10_000 if data[3] == 1 else 10_000)
        return data[:4] + limit if data[:3] == b'\x43\x7d\x60' else data

    net.alter(0x580 + NODE_ID, shown)
    net.boot()
    net.enable(mode)
    moving = net.master.drive(JOINT)
    with pytest.raises(DriveError, match=r'stands at 0\.5, not at its target 0\.8'):
        moving.move_to(0.8, timeout=10.0)
    net.do(JOINT, 'recover')
    assert net.motor() == pytest.approx(0.5, abs=0.01)
    assert 'Operation enabled' in moving.move_to(0.4, timeout=10.0)


@pytest.mark.parametrize(
    'mode', [OperationMode.INTERPOLATED_POSITION, OperationMode.CYCLIC_POSITION], ids=by_name
)
def test_a_blocked_axis_has_not_arrived_and_stays_where_it_is(mode: OperationMode) -> None:
    """On a way too short for the watch over following; also when it comes free later."""
    net = with_modes()
    net.enable(mode)
    net.simulated().block(now=net.now)
    with pytest.raises(DriveError, match=r'stands at .*, not at its target 0\.08.*was halted'):
        net.master.drive(JOINT).move_to(0.08, timeout=10.0)
    net.simulated().release(net.now)
    net.run(1.0)
    assert net.motor() == pytest.approx(0.0, abs=1e-3)
    assert 'Operation enabled' in net.master.drive(JOINT).move_to(0.05, timeout=10.0)


@pytest.mark.parametrize('by', ['target', 'source'])
def test_a_motion_that_another_one_replaces_while_it_settles_names_no_target_of_that(
    by: str,
) -> None:
    """The half second in which a blocked axis might still arrive belongs to the newest command."""
    net = with_modes()
    net.enable(OperationMode.CYCLIC_POSITION)
    net.simulated().block(now=net.now)
    commands, drive = net.commands[JOINT], net.drives[JOINT]
    moving = net.network.scheduler.spawn(commands.arrive(lambda: commands.set_target(0.08), 10.0))
    net.run_until(lambda: drive.stream_refusal is None and drive.setpoint == 0.08)
    net.run(0.3)
    if by == 'target':
        net.target(-0.05)
    else:
        net.master.attach(Leader(speed=0.3))
    with pytest.raises(DriveError, match='got another target'):
        net.result(moving)
    assert not drive.halt.held


@pytest.mark.parametrize('acceleration', [500, 50_000])
def test_mode_9_brakes_with_the_deceleration(acceleration: int) -> None:
    """From 1 rad/s by 5 rad/s^2, however slowly it was reached."""
    writes = [write for write in MOTION_WRITES if write.index != 0x6083]
    net = with_modes(sdo_writes=(*writes, sdo_write(0x6083, 0, acceleration)))
    net.enable(OperationMode.CYCLIC_VELOCITY)
    net.target(1.0)
    net.run(1.0 / (acceleration / SCALE) + 1.0)
    assert net.speed() == pytest.approx(1.0, abs=0.02)
    began = net.now
    net.do(JOINT, 'halt', preempt=True)
    assert net.now - began < 1.0


def test_without_a_mode_in_bus_yml_the_message_says_what_helps() -> None:
    """The drive stays in Switched on; a mode that is selected before lets it enable."""
    net = deviating(Fault.MODE_REQUIRED)
    with pytest.raises(DriveError, match=r'0x6061 is 0.*Select one before, or name position_mode'):
        net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    assert 'Operation enabled' in net.do(JOINT, 'enable')


def test_a_homing_succeeds_though_the_drive_refuses_mode_zero() -> None:
    """No quirk names it: mode 0, that of before, is selected and need not come."""
    net = deviating(Fault.MODE_ZERO_REFUSED)
    net.do(JOINT, 'enable')
    assert 'homed by method 37' in net.result(net.home(37))


@pytest.mark.parametrize('selected', [8, 1, None])
@pytest.mark.parametrize('command', ['home', 'init'])
def test_homing_does_not_leave_a_drive_without_mode_zero_in_mode_6(
    command: str, selected: int | None
) -> None:
    """It returns to the mode of before: the one selected, or the one that it showed by itself."""
    config = full_drive(
        sdo_writes=(*MOTION_WRITES, sdo_write(0x6098, 0, 35)), scales={'quirks': 'no_mode_zero'}
    )
    has = with_defaults(drive_dictionary(), {(0x6060, 0): 3, (0x6061, 0): 3}).for_node(NODE_ID)
    net = VirtualNetwork(bus_config(config), dictionaries={JOINT: has})
    net.devices[JOINT].faults.inject(FaultInjection(Fault.MODE_ZERO_REFUSED), net.now)
    net.boot()
    if selected is not None:
        net.select(JOINT, OperationMode(selected))
    assert 'homed by method 35' in net.do(JOINT, command)
    assert net.drives[JOINT].view.mode == (selected or 3)
    net.target(0.2)
    net.run(0.3)
    assert net.motor() > 0.02


@pytest.mark.parametrize('mode', TORQUE_MODES, ids=by_name)
def test_a_halted_torque_is_not_let_go_to_switch_the_mode(mode: OperationMode) -> None:
    """Such a drive stays halted in its mode, and the message says what helps."""
    net = deviating(Fault.MODE_HELD_UNDER_HALT)
    net.enable(mode)
    net.target(200.0)
    net.run(0.5)
    net.do(JOINT, 'halt', preempt=True)
    with pytest.raises(DriveError, match=r'halted .bit 8.*disable it, select the mode'):
        net.select(JOINT, OperationMode.CYCLIC_POSITION)
    assert net.drives[JOINT].halt.held
    stood = net.motor()
    net.run(1.0)
    assert net.motor() == pytest.approx(stood, abs=2e-3)
    net.do(JOINT, 'disable')
    net.select(JOINT, OperationMode.CYCLIC_POSITION)
    net.do(JOINT, 'enable')


def test_a_drive_that_interpolates_only_in_motion_is_no_warning() -> None:
    """In mode 7 some clear bit 12 at standstill; targets are reached, and nothing is reported.

    In mode 8 the drive ignores its set-points then.
    """
    net = with_modes()
    net.enable(OperationMode.INTERPOLATED_POSITION)
    drive = net.simulated()

    def shown(data: bytes) -> bytes:
        return (
            data[:1]
            + bytes((data[1] & (0xFF if abs(drive.velocity) > 1e-6 else 0xEF),))
            + data[2:]
        )

    net.alter(0x180 + NODE_ID, shown)
    for target in (0.3, 0.6, 0.1):
        net.target(target)
        net.run(2.0)
        assert net.motor() == pytest.approx(target, abs=1e-3)
    assert net.reported(Severity.WARNING) == []
    net.select(JOINT, OperationMode.CYCLIC_POSITION)  # in which bit 12 has to stay
    net.target(0.3)
    net.run(2.0)
    (warning,) = net.reported(Severity.WARNING)
    assert 'does not follow its set-points any more (bit 12)' in warning


def test_a_fault_speaks() -> None:
    """It is reported in words, and whatever is commanded names it until recover."""
    net = booted(drive_config(JOINT, 2))
    mode = OperationMode.CYCLIC_POSITION
    net.enable(mode)
    net.target(0.4)
    net.run(0.3)
    drive = net.simulated()
    drive.raise_fault(0x4210, net.now)
    net.run(1.0)
    reported = '\n'.join(net.reported(Severity.ERROR))
    assert 'EMCY: 0x4210 excess device temperature' in reported
    assert 'FAULT' in reported
    assert 'recover it' in reported
    for verb in ('enable', 'disable', 'halt', 'quick_stop', 'home'):
        with pytest.raises(DriveError, match=r'faulted.*recover.*Fault.*0x4210'):
            net.do(JOINT, verb)
    with pytest.raises(DriveError, match=r'faulted'):
        net.select(JOINT, mode)
    with pytest.raises(DriveError, match='recover it'):
        net.target(0.0)
    assert 'Operation enabled' in net.do(JOINT, 'recover')
    assert not net.drives[JOINT].view.error


def test_an_unknown_position_is_never_published() -> None:
    """NaN before the first one; while a drive is away or boots again, where it was."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, 2)))
    assert math.isnan(net.drives[JOINT].feedback().position)
    net.boot()
    net.enable(OperationMode.PROFILE_POSITION)
    net.target(0.5)
    net.run(3.0)
    net.power_off(JOINT)
    drive, reported = net.drives[JOINT], []
    for restart in (False, True):
        if restart:
            net.power_on(JOINT)
        for _ in range(300):
            net.run(PERIOD)
            if not drive.view.fresh:  # no TPDOs of it
                reported.append(drive.feedback().position)
    assert reported == pytest.approx([0.5] * len(reported), abs=2 / SCALE)
    assert reported
    assert drive.feedback().position == 0.0  # the new one counts from there


def test_refusals_before_init() -> None:
    """Without enable, without a mode, without a method, while another command runs: what to do."""
    net = booted(drive_config(JOINT, 2))
    with pytest.raises(DriveError, match=r'init or enable it: 0x0250 Switch on disabled'):
        net.target(0.1)
    first = net.begin(JOINT, 'init')
    with pytest.raises(DriveError, match=r'busy: init is running'):
        net.do(JOINT, 'enable')
    net.do(JOINT, 'disable', preempt=True)  # one that stops is not refused
    with pytest.raises(DriveError, match=r'init was ended by disable'):
        first.result()
    net.do(JOINT, 'init')
    with pytest.raises(DriveError, match='no homing method'):
        net.do(JOINT, 'home')
    with pytest.raises(DriveError, match=r'no mode of operation.*position_mode'):
        net.target(0.1)
    with pytest.raises(DriveError, match=r'in no RPDO'):
        net.select(JOINT, OperationMode.CYCLIC_TORQUE)


@pytest.mark.parametrize('bits', [True, False], ids=['old bits', 'no bits'])
@pytest.mark.parametrize('end', ['sto', 'nmt'])
def test_a_homing_that_was_cut_off_has_not_succeeded(end: str, *, bits: bool) -> None:
    """The answer comes at once, whatever bits 10 and 12 show, and `~/enable` is free again."""
    net = booted(drive_config(JOINT, 2, sdo_writes=(sdo_write(0x6098, 0, 35),)))
    device = net.devices[JOINT]
    if bits:
        device.faults.inject(FaultInjection(Fault.ARRIVED_WHEN_DISABLED), net.now)
    task = net.home(1)
    net.run(0.5)
    if end == 'sto':
        device.faults.inject(FaultInjection(Fault.STO), net.now)
    else:
        net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 2)
    with pytest.raises(DriveError, match='was cut off while it homed, and is not homed') as cut:
        net.result(task, 0.5)
    assert 'Operation enabled' not in str(cut.value)
    device.faults.end(net.now, Fault.STO)
    net.network.send_nmt(NmtCommand.START, 2)
    net.run(1.0)  # what homed on meanwhile is led to rest
    net.do(JOINT, 'enable')
