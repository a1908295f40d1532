# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An axis keeps its power until it stands, whatever ends its operation and whoever comes next."""

from __future__ import annotations

from dataclasses import replace
import itertools

from bus_rig import booted, JOINT, VirtualNetwork
from diagnostic_msgs.msg import DiagnosticStatus
from drive_samples import (
    bus_config,
    drive_config,
    every_mode,
    MOTION_WRITES,
    PERIOD,
    SCALE,
    sdo_write,
)
import pytest

from arm_canopen import DriveError, DriveState, EventKind, OperationMode, Severity
from arm_canopen.canopen_master import leave_device
from arm_canopen.cia402.motion_group import stop_all, StopReport
from arm_canopen.cia402.stop import SHUTDOWN_MAX
from arm_canopen.config import RecoveryPolicy
from arm_canopen.master.remote_node import BootPhase
from arm_canopen.nodes.diagnostics import drive_diagnostic
from canopen_core.can import ControllerState, Frame
from canopen_core.standard import NmtCommand
from canopen_sim import Drive as SimulatedDrive
from canopen_sim import Fault, FaultInjection

NODE_ID = 2
RAMP = 1.0  # [s] of a quick stop from full speed to rest
STANDING = 0.03  # [rad/s]
ALWAYS = float('inf')


STOPPING = (DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE)
BRAKED_OFF = (DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED)
RPDOS = {0x200 + NODE_ID, 0x300 + NODE_ID, 0x400 + NODE_ID}


class MovingDrive:
    """A drive at 1 rad/s with a slow quick stop ramp."""

    def __init__(
        self,
        option: int = 2,
        *writes: tuple[int, int, int],
        kept_alive: bool = False,
        mode: OperationMode = OperationMode.CYCLIC_POSITION,
        recovery: RecoveryPolicy = RecoveryPolicy.MANUAL,
    ) -> None:
        """Set it in motion.

        Args:
            option: Quick stop option code (0x605A).
            writes: Index, sub-index and value of objects that differ.
            kept_alive: It passes from one master to the next.
            mode: Mode of operation.
            recovery: What becomes of it when its device comes back.
        """
        slow = [(0x6085, 0, round(SCALE / RAMP)), (0x605A, 0, option), *writes]
        config = drive_config(
            JOINT,
            NODE_ID,
            sdo_writes=(*MOTION_WRITES, *(sdo_write(*write) for write in slow)),
            scales={'recovery': recovery},
            reset_communication=not kept_alive,
        )
        self.net = net = VirtualNetwork(bus_config(config))  # the network
        net.allows_defects = True
        net.boot()
        net.enable(mode)
        net.target(1.0 if mode is OperationMode.PROFILE_VELOCITY else 50.0)
        net.run(0.6)
        assert net.speed() == pytest.approx(1.0, rel=0.05)
        # states of the simulated drive since it began to move, without repetitions
        self.states = [DriveState.OPERATION_ENABLED]
        self.fastest = 0.0  # greatest speed at which it was without power since then in [rad/s]
        self.began = net.now  # steady time at which that began in [s]

    @property
    def device(self) -> SimulatedDrive:
        """The simulated drive."""
        return self.net.simulated()

    def run(self, duration: float) -> None:
        """Advance the time by a duration in [s], and observe the drive in each cycle."""
        for _ in range(round(duration / PERIOD)):
            self.net.run(PERIOD)
            if self.device.state is not self.states[-1]:
                self.states.append(self.device.state)
            if self.device.state not in {DriveState.OPERATION_ENABLED, *STOPPING}:
                self.fastest = max(self.fastest, abs(self.net.speed()))

    def inject(self, place: str, times: float = ALWAYS) -> None:
        """Make a step of the cycle fail from now on, with another text each time."""
        drive, network = self.net.drives[JOINT], self.net.network
        node = network.nodes[JOINT]
        owner, attribute = {
            'mode': (drive.mode, 'step'),
            'write': (drive, 'write'),
            'read': (drive, 'read'),
            'controlword': (drive.controlword.writer, 'write'),
            'RPDO': (node.image.rpdos[-1], 'frame'),
            'answers': (node, 'expect_answers'),
            'heartbeat': (network._heartbeat, 'advance'),
        }[place]
        original, number = getattr(owner, attribute), itertools.count()

        def broken(*args: object, **settings: object) -> object:
            failures = next(number)
            if failures < times:
                raise ZeroDivisionError(f'injected {failures}')
            return original(*args, **settings)

        setattr(owner, attribute, broken)

    def assert_braked(self, *states: DriveState, errors: int | None = None) -> None:
        """Check that the drive went through these states, never without power at speed."""
        assert self.states == [DriveState.OPERATION_ENABLED, *states]
        assert self.fastest < STANDING
        assert errors is None or len(self.errors) == errors, self.errors

    @property
    def errors(self) -> list[str]:
        """What was reported as an error."""
        return self.net.reported(Severity.ERROR)

    @property
    def controlwords_by_sdo(self) -> list[int]:
        """Controlwords that were written by SDO since it moved."""
        requests = self.net.frames(0x600 + NODE_ID, since=self.began)
        words = (data[4:6] for data in requests if data[:4] == b'\x2b\x40\x60\x00')
        return [int.from_bytes(word, 'little') for word in words]


pytestmark = pytest.mark.slow

QUICK_STOP_ON_LOSS = (0x6007, 0, 3)  # the drive makes a quick stop when it misses the master


@pytest.mark.parametrize(
    ('ramp', 'real', 'limit', 'states'),
    [
        (1_500, 1_500, 8.0, (DriveState.SWITCHED_ON,)),
        (10_000, 500, 12.0, BRAKED_OFF),  # slower than its objects say: off when it stands
    ],
)
def test_a_disable_lasts_as_long_as_its_ramp(
    ramp: int, real: int, limit: float, states: tuple[DriveState, ...]
) -> None:
    """1 rad/s at 0.15 rad/s^2 takes 6.7 s; a ramp that does not end becomes a quick stop."""
    moving = MovingDrive(2, (0x6084, 0, ramp))
    moving.net.devices[JOINT].store.find(0x6084).value = real
    disabling = moving.net.begin(JOINT, 'disable', preempt=True)
    moving.run(limit)
    assert states[-1].title in disabling.result()
    moving.assert_braked(*states)


@pytest.mark.parametrize('option', [2, 6])
def test_a_new_master_waits_for_the_quick_stop_that_it_finds(option: int) -> None:
    """The drive has begun it at the loss of the master before."""
    moving = MovingDrive(option, QUICK_STOP_ON_LOSS, kept_alive=True)
    moving.device.connection_lost(moving.net.now)
    moving.net.replace_master()
    moving.net.start()
    moving.run(RAMP + 3.0)
    moving.assert_braked(*BRAKED_OFF)


OPTIONS = pytest.mark.parametrize('option', [2, 6], ids=['605A=2', '605A=6'])


@OPTIONS
@pytest.mark.parametrize(
    ('place', 'times', 'lost', 'verb'),
    [
        *itertools.product(('mode', 'write', 'controlword', 'RPDO'), (1, ALWAYS), ((),), ('',)),
        ('read', ALWAYS, (), ''),  # it is not waited for for ever that it stands
        ('RPDO', ALWAYS, (0x580 + NODE_ID,), ''),  # no answer to an SDO
        *itertools.product(('controlword',), (2,), ((0x600 + NODE_ID,),), ('', 'shutdown')),
    ],
)
def test_the_power_goes_when_the_axis_stands(
    place: str, times: float, lost: tuple[int, ...], verb: str, option: int
) -> None:
    """Whatever fails, and whatever 0x605A says: never without power at speed, nor for good.

    By RPDO, also one that was kept back at first, or by an SDO that waits for no other one.
    """
    failing = MovingDrive(option)
    failing.net.lose(*lost)
    for _ in range(30 if 0x580 + NODE_ID in lost else 0):
        failing.net.network.nodes[JOINT].sdo.read(0x1018, 1, 0.2)
    failing.inject(place, times)
    if verb:
        failing.net.begin(JOINT, verb, preempt=True)
    failing.run(2 * PERIOD)
    assert place != 'RPDO' or failing.device.state is DriveState.QUICK_STOP_ACTIVE
    failing.run(RAMP + 3.0)
    stood = option == 2 and 0x600 + NODE_ID in lost  # when the SDO had timed out
    failing.assert_braked(*BRAKED_OFF[stood:])
    assert sum('injected' in text for text in failing.errors) == 1, failing.errors
    assert place == 'read' or len(failing.errors) == 1, failing.errors
    if not lost and place != 'read':
        unreachable = place == 'RPDO' or (place == 'controlword' and times > 1)
        assert failing.controlwords_by_sdo == ([2, 0] if unreachable else [])


@OPTIONS
def test_a_deaf_drive_is_stopped_by_sdo_and_not_enabled_by_what_comes_later(option: int) -> None:
    """Its RPDOs are kept back before the SDO leaves: none that gets through ends the stop."""
    failing = MovingDrive(option)
    failing.net.lose(*RPDOS)
    failing.inject('mode', 1)
    failing.run(0.4)
    assert not failing.controlwords_by_sdo
    failing.run(0.4)
    failing.net.lose()
    failing.run(RAMP + 2.0)
    assert failing.states[-1] is DriveState.SWITCH_ON_DISABLED
    assert DriveState.OPERATION_ENABLED not in failing.states[1:]
    assert failing.controlwords_by_sdo == [2, 0]
    failing.net.do(JOINT, 'enable')
    assert failing.device.state is DriveState.OPERATION_ENABLED


def test_an_axis_is_stopped_whose_rpdo_is_kept_back_with_another_axis() -> None:
    """It would go on with the last controlword that it got; enabling it frees no RPDO."""
    failing = MovingDrive(6)
    rpdo, other = failing.net.network.nodes[JOINT].image.rpdos[-1], object()
    rpdo.kept_back_by.add(other)
    failing.run(RAMP + 1.0)
    assert failing.states[-1] is DriveState.SWITCH_ON_DISABLED
    assert failing.fastest < STANDING
    assert failing.controlwords_by_sdo == [2, 0]
    assert len(failing.errors) == 1
    with pytest.raises(DriveError, match='did not reach Operation enabled'):
        failing.net.do(JOINT, 'enable')
    assert rpdo.kept_back_by == {other}, 'the RPDO carries what the other axis must not get'
    rpdo.kept_back_by.discard(other)
    failing.net.do(JOINT, 'enable')


def test_a_drive_that_is_gone_is_not_said_to_move_on() -> None:
    """As long as its heartbeat is not overdue, it is silent: that is what is reported."""
    failing = MovingDrive(6)
    failing.net.lose(*(base + NODE_ID for base in range(0x180, 0x600, 0x100)))
    with pytest.raises(DriveError, match='no TPDOs for'):
        failing.net.do(JOINT, 'shutdown', preempt=True)
    assert not [text for text in failing.net.reported() if 'did not come to rest' in text]
    (silent,) = [text for text in failing.errors if 'has sent no TPDO for' in text]
    assert 'Check its power and cable' in silent


@pytest.mark.parametrize('lost', [False, True], ids=['receives', 'deaf'])
@pytest.mark.parametrize('nmt', [NmtCommand.START, NmtCommand.ENTER_PRE_OPERATIONAL])
def test_a_device_watches_the_master_until_its_motor_was_seen_to_stand(
    nmt: NmtCommand, *, lost: bool
) -> None:
    """When the master ends, its heartbeat is the last that can stop the drive."""
    moving = turning(6)
    net, node = moving.net, moving.net.network.nodes[JOINT]
    node.watch_slot = 1
    moving.net.lose(*([*RPDOS, 0x600 + NODE_ID] if lost else []))
    net.network.send_nmt(nmt, NODE_ID)
    moving.run(0.3)
    assert abs(net.speed()) > 0.5

    def unwatched() -> bool:
        requests = net.frames(0x600 + NODE_ID, since=moving.began)
        return any(data[1:4] == b'\x16\x10\x01' for data in requests)

    scheduler = net.network.scheduler
    leaving = scheduler.spawn(leave_device(node, [net.commands[JOINT]], scheduler))
    net.run_until(lambda: leaving.done or unwatched(), SHUTDOWN_MAX)
    assert (abs(net.speed()) < STANDING) is unwatched() is not lost
    assert leaving.done is lost
    if lost:
        with pytest.raises(DriveError, match='cut its power'):
            leaving.result()


@pytest.mark.parametrize('shutdown', [False, True], ids=['', 'shutdown'])
def test_a_drive_that_could_not_be_stopped_is_not_said_to_be_enabled(*, shutdown: bool) -> None:
    """It is still in Operation Enabled; and the next failure stops it as the first one would."""
    failing = MovingDrive(6)
    failing.inject('controlword', 3)
    failing.net.lose(*RPDOS, 0x600 + NODE_ID)
    failing.run(10.0)
    with pytest.raises(DriveError, match='could not be stopped; cut its power'):
        failing.net.do(JOINT, 'enable')
    if shutdown:
        with pytest.raises(DriveError, match='joint1 is not disabled; cut its power'):
            failing.net.do(JOINT, 'shutdown', preempt=True)
        failing.net.drives[JOINT].controlword.keep_back()
        failing.net.lose(0x600 + NODE_ID)  # no SDO is answered, so a shutdown goes by RPDO
        failing.net.do(JOINT, 'shutdown', preempt=True)
        assert failing.device.state is DriveState.SWITCH_ON_DISABLED
    failing.net.lose()
    failing.net.do(JOINT, 'enable')
    failing.net.target(50.0)
    failing.net.run(0.6)
    assert failing.net.speed() == pytest.approx(1.0, rel=0.05)
    failing.states = [DriveState.OPERATION_ENABLED]
    reported = len(failing.errors)
    failing.net.drives[JOINT].fail(ZeroDivisionError())
    failing.run(RAMP + 1.0)
    failing.assert_braked(*BRAKED_OFF, errors=reported + 1)


@pytest.mark.parametrize('verb', ['', 'disable'], ids=['by itself', 'by a request'])
def test_a_drive_that_keeps_its_power_is_stopped_as_soon_as_it_can_be(verb: str) -> None:
    """Neither RPDO nor SDO reaches it at first: that is reported once, with the remedy."""
    failing = MovingDrive(6)
    failing.inject('controlword')
    failing.net.lose(0x600 + NODE_ID)
    failing.run(20.0)
    assert failing.states == [DriveState.OPERATION_ENABLED]
    assert len(failing.errors) == 3, failing.errors
    assert 'Cut its power' in failing.errors[-1]
    failing.net.lose()
    if verb:
        failing.net.do(JOINT, verb, preempt=True)
    else:
        failing.run(8.0)
    assert failing.device.state is DriveState.SWITCH_ON_DISABLED
    assert abs(failing.net.speed()) < STANDING
    assert failing.fastest < STANDING
    assert len(failing.errors) == 3, failing.errors


@pytest.mark.parametrize('cycles', range(1, 4))
def test_a_failure_while_it_is_enabled_stays_named_until_the_next_enabling(cycles: int) -> None:
    """Also where the drive comes to Operation Enabled by a command that was on its way."""
    failing = MovingDrive(6)
    failing.net.do(JOINT, 'shutdown', preempt=True)
    enabling = failing.net.begin(JOINT, 'enable')
    drive = failing.net.drives[JOINT]
    failing.net.run_until(lambda: bool(drive._controlword & 0x8))
    failing.net.run(PERIOD * (cycles - 1))
    drive.fail(ZeroDivisionError('injected'))
    failing.run(RAMP + 1.0)
    with pytest.raises(DriveError, match='injected'):
        enabling.result()
    assert failing.device.state is DriveState.SWITCH_ON_DISABLED
    assert 'injected' in drive.failure
    assert len(failing.errors) == 1, failing.errors


def test_nothing_enables_a_drive_while_it_is_stopped() -> None:
    """A command is refused, a stop waits for the end; then a command does."""
    failing = MovingDrive(6)
    failing.inject('mode', 1)
    failing.run(0.2)
    for verb in ('init', 'enable', 'recover', 'home'):
        with pytest.raises(DriveError, match='being stopped'):
            failing.net.do(JOINT, verb)
    status = failing.net.drives[JOINT].status()
    assert drive_diagnostic('bus', status).level == DiagnosticStatus.ERROR
    assert 'injected' in status.summary
    failing.net.do(JOINT, 'disable', preempt=True)
    assert failing.device.state == DriveState.SWITCH_ON_DISABLED
    assert abs(failing.net.speed()) < STANDING
    failing.net.do(JOINT, 'enable')
    assert failing.net.drives[JOINT].view.state is DriveState.OPERATION_ENABLED
    assert not failing.net.drives[JOINT].status().failure


def test_texts_with_values_do_not_flood_the_log() -> None:
    """Neither those of devices without a drive nor those of the cycle."""
    failing = MovingDrive(2)
    failing.net.network.nodes[JOINT].on_failed.clear()
    failing.inject('answers')
    failing.inject('heartbeat')
    failing.run(1.0)
    assert len(failing.errors) == 2, failing.errors


MOVES, RESTS, HOMES, WAITS, DIES = NAMES = ('moves', 'rests', 'homes', 'waits', 'dies')


def test_all_drives_stand_and_it_says_what_became_of_each() -> None:
    """A move, a homing, rest, no power; one without an answer keeps no other from it."""
    writes = (*MOTION_WRITES, sdo_write(0x6099, 1, 5_000))
    drives = (drive_config(name, 2 + n, sdo_writes=writes) for n, name in enumerate(NAMES))
    net = booted(*drives)
    for name in (MOVES, RESTS, HOMES, DIES):
        net.enable(OperationMode.PROFILE_POSITION, name)
    homing = net.home(17, HOMES)
    net.target(30.0, MOVES)
    net.run(0.5)
    net.power_off(DIES)
    net.run(0.5)
    assert [name for name in net.devices if abs(net.speed(name))] == [MOVES, HOMES]
    assert not homing.done
    report = stop(net)
    assert (report.stopped, report.standing) == ((MOVES, HOMES), (RESTS,))
    assert report.unpowered == (WAITS,)
    assert 'ended by halt' in str(homing.error)
    assert str(report).startswith(f'NOT known to stand: {DIES} is not seen to come to rest')
    states = {name: net.simulated(name).state for name in net.devices}
    enabled = [name for name, state in states.items() if state is DriveState.OPERATION_ENABLED]
    assert enabled == [MOVES, RESTS, HOMES]
    for _ in range(200):
        net.run(PERIOD)
        assert all(abs(net.speed(name)) < STANDING for name in net.devices)
    again = stop(net)
    assert (again.stopped, again.standing) == ((), (MOVES, RESTS, HOMES))


def test_it_is_there_before_and_while_devices_boot() -> None:
    """What is not booted yet is not known to stand, and is not enabled by what came before."""
    net = VirtualNetwork(bus_config(drive_config(MOVES, 2), drive_config(RESTS, 3)))
    net.start()
    assert len(stop(net).failed) == 2
    net.run_until(lambda: net.drives[MOVES].node.phase is BootPhase.CONFIGURING)
    assert f'NOT known to stand: {MOVES} is not known to stand, as it was never' in str(stop(net))
    net.run_until(net.all_ready)
    assert stop(net) == StopReport((), (), (MOVES, RESTS), ())


def stop(net: VirtualNetwork) -> StopReport:
    """Stop all drives."""
    scheduler = net.network.scheduler
    report = net.result(scheduler.spawn(stop_all(list(net.commands.values()), scheduler)))
    assert isinstance(report, StopReport)
    return report


def turning(option: int, *writes: tuple[int, int, int]) -> MovingDrive:
    """Return a drive that turns on without set-points, whatever becomes of its master."""
    return MovingDrive(option, (0x6007, 0, 0), *writes, mode=OperationMode.PROFILE_VELOCITY)


def nmt_commands(moving: MovingDrive) -> list[int]:
    """Return the NMT commands since it moved."""
    return [data[0] for data in moving.net.frames(0x000, since=moving.began)]


def test_a_late_heartbeat_stops_nothing_while_tpdos_come() -> None:
    """It is reported, and the device is neither lost nor configured anew."""
    moving = MovingDrive()
    moving.net.lose(0x700 + NODE_ID)
    moving.run(0.45)  # of a consumer time of 0.3
    moving.net.lose()
    moving.run(1.0)
    assert moving.states == [DriveState.OPERATION_ENABLED]
    assert nmt_commands(moving) == []
    assert moving.errors == []
    assert all(event.kind is not EventKind.HEARTBEAT_LOST for event in moving.net.events)
    late = [text for text in moving.net.reported(Severity.WARNING) if 'heartbeat lost' in text]
    assert len(late) == 1
    assert 'but its TPDOs come' in late[0]


def test_a_device_that_is_commanded_away_while_it_brakes_is_left_there() -> None:
    """Its heartbeat is back, so it is not booted, and its drive is enabled no more."""
    moving = MovingDrive(recovery=RecoveryPolicy.AUTO)
    net = moving.net
    moving.net.lose(0x700 + NODE_ID)
    while moving.device.state is DriveState.OPERATION_ENABLED:
        moving.run(PERIOD)
    moving.net.lose()
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)
    moving.run(3.0 * RAMP)
    assert nmt_commands(moving) == [NmtCommand.ENTER_PRE_OPERATIONAL]
    net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    net.run(3.0)
    assert net.all_ready()
    assert moving.device.state is DriveState.SWITCH_ON_DISABLED


@OPTIONS
@pytest.mark.parametrize('how', ['NMT', 'by itself', 'mute', 'cut off'])
def test_an_axis_that_turns_while_its_device_is_away_is_braked(how: str, option: int) -> None:
    """Before its device is configured; and its first controlword is no 0, which lets it coast.

    One that still receives is stopped meanwhile, one that left Operational by itself at once.
    """
    moving = turning(option)
    net = moving.net
    if how == 'NMT':
        net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)
        moving.run(0.5)
        net.network.send_nmt(NmtCommand.START, NODE_ID)
    elif how == 'by itself':
        unseen = Frame(0x000, bytes((NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)))
        net.devices[JOINT].receive(unseen, net.now)
        moving.run(0.2)
        assert moving.device.state is DriveState.QUICK_STOP_ACTIVE
        requests = net.frames(0x600 + NODE_ID, since=moving.began)
        assert not any(data[0] == 0x80 for data in requests), 'an abort could undo the stop'
    else:
        net.wire.loses = lambda sender, frame: sender == JOINT or how == 'cut off'
        moving.run(0.6)
        assert not net.network.nodes[JOINT].online
        assert (moving.device.state is DriveState.OPERATION_ENABLED) is (how == 'cut off')
        net.lose()
    while not nmt_commands(moving):
        moving.run(PERIOD)
    assert how == 'NMT' or abs(net.speed()) < STANDING
    moving.run(RAMP + 3.0)
    moving.assert_braked(*BRAKED_OFF)
    net.run_until(net.all_ready)
    net.do(JOINT, 'enable')


@pytest.mark.parametrize('final', [False, True], ids=['', 'no transition 16'])
@pytest.mark.parametrize('option', [2, 5, 6, 7])
def test_a_quick_stop_at_rest_ends_where_its_option_says(option: int, *, final: bool) -> None:
    """With 5 to 7 the axis is held in Quick stop active, although there was nothing to brake.

    A command enables it at once, by the way through no power where transition 16 is missing; that
    is no loss of power, although the cycle may not have seen what was commanded before.
    """
    writes = (*MOTION_WRITES, sdo_write(0x605A, 0, option))
    net = booted(drive_config(JOINT, NODE_ID, sdo_writes=writes))
    if final:
        net.devices[JOINT].faults.inject(FaultInjection(Fault.QUICK_STOP_FINAL), net.now)
    net.enable(OperationMode.PROFILE_POSITION)
    net.do(JOINT, 'quick_stop', preempt=True)
    net.run(1.0)
    state = DriveState.SWITCH_ON_DISABLED if option == 2 else DriveState.QUICK_STOP_ACTIVE
    assert net.drives[JOINT].view.state is net.simulated().state is state
    for verb, stop in (('enable', 'quick_stop'), ('init', 'quick_stop'), ('recover', 'shutdown')):
        assert 'Operation enabled' in net.do(JOINT, verb)
        assert net.simulated().state is DriveState.OPERATION_ENABLED
        net.do(JOINT, stop)
    assert 'Operation enabled' in net.do(JOINT, 'enable')
    assert not net.reported(Severity.ERROR)


def test_recover_waits_for_the_end_of_the_reaction_to_the_fault() -> None:
    """A drive cannot be reset while it brakes, on a ramp of seven seconds here."""
    writes = (*MOTION_WRITES, sdo_write(0x6085, 0, round(SCALE / 7.0)))
    net = booted(drive_config(JOINT, NODE_ID, sdo_writes=writes))
    net.enable(OperationMode.PROFILE_VELOCITY)
    net.target(1.0)
    net.run(1.0)
    net.simulated().raise_fault(0x4310, net.now)
    net.run(0.1)
    assert net.simulated().state is DriveState.FAULT_REACTION_ACTIVE
    assert 'Operation enabled' in net.do(JOINT, 'recover')


def test_shutdown_of_a_drive_that_is_off_or_faulted_ends_at_once() -> None:
    """It is seen to stand without power, so nothing has to be waited for."""
    net = booted(drive_config(JOINT, NODE_ID))
    assert 'Switch on disabled' in net.do(JOINT, 'shutdown', timeout=0.1)
    net.enable(OperationMode.PROFILE_POSITION)
    net.simulated().raise_fault(0x4210, net.now)
    net.run(0.5)
    assert 'Fault' in net.do(JOINT, 'shutdown', timeout=0.1)


def test_shutdown_of_a_lost_drive_is_no_success_unless_its_rest_is_seen() -> None:
    """One that sends nothing, but receives, is stopped by SDO; one without an answer may move."""
    moving = MovingDrive(mode=OperationMode.PROFILE_VELOCITY)
    net = moving.net
    net.lose(0x180 + NODE_ID, 0x280 + NODE_ID, 0x700 + NODE_ID)
    net.run(0.4)
    assert 'Switch on disabled' in net.do(JOINT, 'shutdown', timeout=5.0)
    assert abs(net.speed()) < 1e-3
    assert moving.device.state is DriveState.SWITCH_ON_DISABLED
    net.power_off(JOINT)
    net.run(1.0)
    with pytest.raises(DriveError, match='not disabled; cut its power: offline'):
        net.do(JOINT, 'shutdown', timeout=5.0)


@pytest.mark.parametrize('key', ['stop_all_nodes', 'reset_all_nodes'])
def test_the_loss_of_a_mandatory_device_lets_no_other_axis_coast(key: str) -> None:
    """The others stand before NMT takes them from the master."""
    first = replace(drive_config(JOINT, 2), mandatory=True)
    net = booted(first, every_mode(drive_config('joint2', 3)), **{key: True})
    net.enable(OperationMode.PROFILE_VELOCITY, 'joint2')
    net.target(1.0, 'joint2')
    net.run(1.0)
    since = net.now
    net.power_off(JOINT)
    net.run_until(lambda: bool(net.frames(0x000, since=since)), 10.0)
    assert net.speed('joint2') == pytest.approx(0.0, abs=1e-2)
    assert net.simulated('joint2').state is DriveState.SWITCH_ON_DISABLED
    assert not any('somebody' in text for text in net.reported())


def test_an_error_ends_with_its_fault_whoever_resets_it() -> None:
    """Another tool resets the fault; the drive is described without it."""
    net = booted(drive_config(JOINT, 2))
    net.enable(OperationMode.PROFILE_POSITION)
    net.devices[JOINT].faults.inject(FaultInjection(Fault.OVER_CURRENT), net.now)
    net.run(0.5)
    assert 'error 0x' in net.drives[JOINT].describe()
    for word in (0x00, 0x80):
        net.send_as('tool', Frame(0x202, bytes((word, 0, 1))))
        net.run(0.001)
    net.run(0.5)
    assert net.simulated().state is DriveState.SWITCH_ON_DISABLED
    assert 'error 0x' not in net.drives[JOINT].describe()


def test_bus_off_ends_with_the_next_data_and_is_reported_again() -> None:
    """`ip link set down` and `up` restart the controller without an error frame."""
    net = booted(drive_config(JOINT, 2))
    for number in (1, 2):
        net.network.receive(Frame(0x40, bytes(8), net.now, is_error=True))
        states = [net.network.controller.state]
        assert len([text for text in net.reported() if 'left the bus' in text]) == number
        net.run(0.5)
        states.append(net.network.controller.state)
        assert states == [ControllerState.BUS_OFF, ControllerState.ACTIVE]
