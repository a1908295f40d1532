# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Drives and their commands against simulated devices, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
import math

from drive_samples import bus_config, drive_config, PERIOD, SCALE, sdo_write
import pytest
from virtual_network import VirtualNetwork

from arm_canopen.cia402.motion import AxisFeedback
from arm_canopen.cia402.refusal import Refusal, RefusalCause
from arm_canopen.exceptions import DriveError
from arm_canopen.master.events import Severity
from arm_canopen.standard.drive import DriveState, OperationMode
from arm_canopen.standard.nmt import NmtCommand

pytestmark = pytest.mark.slow

JOINT = 'joint1'
MODES = [
    OperationMode.PROFILE_POSITION,
    OperationMode.PROFILE_VELOCITY,
    OperationMode.INTERPOLATED_POSITION,
    OperationMode.CYCLIC_POSITION,
]
POSITION_MODES = [mode for mode in MODES if mode is not OperationMode.PROFILE_VELOCITY]


@pytest.fixture
def net() -> VirtualNetwork:
    """One drive, booted."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, 2)))
    net.boot()
    return net


def enabled(net: VirtualNetwork, mode: OperationMode) -> None:
    """Enable the drive and select a mode."""
    net.do(JOINT, 'init')
    net.select(JOINT, mode)


def position_inc(net: VirtualNetwork) -> float:
    """Return where the simulated motor really is in [inc]."""
    drive = net.devices[JOINT].drive
    assert drive is not None
    return drive.position


@pytest.mark.parametrize('mode', POSITION_MODES, ids=lambda mode: mode.name)
def test_a_target_is_reached_exactly(net: VirtualNetwork, mode: OperationMode) -> None:
    """Each position mode ends at the target."""
    enabled(net, mode)
    net.commands[JOINT].set_target(0.5)
    net.run(3.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.5, abs=2 / SCALE)
    net.commands[JOINT].set_target(-0.25)
    net.run(0.2)
    net.commands[JOINT].set_target(0.1)
    net.run(3.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.1, abs=2 / SCALE)


def test_a_velocity_is_reached_and_stopped(net: VirtualNetwork) -> None:
    """Mode 3 runs at the target velocity, and stands at 0."""
    enabled(net, OperationMode.PROFILE_VELOCITY)
    net.commands[JOINT].set_target(0.2)
    net.run(1.0)
    assert net.drives[JOINT].view.velocity == pytest.approx(0.2, rel=0.02)
    net.commands[JOINT].set_target(0.0)
    net.run(1.0)
    assert net.drives[JOINT].view.velocity == 0.0


def test_nothing_moves_unasked(net: VirtualNetwork) -> None:
    """Enabling, every mode switch, disabling and enabling again leave the motor where it is."""
    enabled(net, OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(0.3)
    net.run(2.0)
    rest = position_inc(net)
    for first in MODES:
        for second in MODES:
            net.select(JOINT, first)
            net.select(JOINT, second)
            net.run(0.1)
        net.do(JOINT, 'disable')
        net.do(JOINT, 'enable')
        net.run(0.1)
    assert position_inc(net) == pytest.approx(rest, abs=1)


def test_targets_are_preloaded_before_the_drive_accepts_targets(net: VirtualNetwork) -> None:
    """Until the enable, every position that leaves is the actual one."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    net.commands[JOINT].set_target(0.3)
    net.run(2.0)
    net.do(JOINT, 'disable')
    since = net.now
    net.run(0.2)
    net.do(JOINT, 'enable')
    net.run(0.1)
    actual = round(net.drives[JOINT].view.position * SCALE)
    assert all(abs(target - actual) <= 1 for target in net.targets(JOINT, since=since + PERIOD))


@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_a_fault_latches_and_speaks(net: VirtualNetwork, mode: OperationMode) -> None:
    """A fault in motion stops it, is reported in words, and lasts until recover."""
    enabled(net, mode)
    net.commands[JOINT].set_target(0.4)
    net.run(0.3)
    drive = net.devices[JOINT].drive
    assert drive is not None
    drive.raise_fault(0x4210, net.now)
    net.run(1.0)
    reported = '\n'.join(net.reported(Severity.ERROR))
    assert 'EMCY: 0x4210 excess device temperature' in reported
    assert 'FAULT' in reported
    assert 'recover it' in reported
    rest = position_inc(net)
    for verb in ('enable', 'disable', 'halt', 'quick_stop', 'home'):
        with pytest.raises(DriveError, match=r'faulted.*recover.*Fault.*0x4210'):
            net.do(JOINT, verb)
    with pytest.raises(DriveError, match=r'faulted'):
        net.select(JOINT, mode)
    with pytest.raises(DriveError, match='recover it'):
        net.commands[JOINT].set_target(0.0)
    assert 'Operation enabled' in net.do(JOINT, 'recover')
    net.run(0.5)
    assert position_inc(net) == pytest.approx(rest, abs=2), 'moved by being recovered'
    assert not net.drives[JOINT].view.error


def test_an_unknown_position_is_never_published() -> None:
    """NaN before the first one; while a drive is away or boots again, where it was."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, 2)))
    assert math.isnan(net.drives[JOINT].feedback().position)
    net.boot()
    enabled(net, OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(0.5)
    net.run(3.0)
    net.power_off(JOINT)
    drive, reported = net.drives[JOINT], []
    for restart in (False, True):
        if restart:
            net.power_on(JOINT)
        for _ in range(300):
            net.run(PERIOD)
            if not drive.objects.fresh(net.now):  # no TPDOs of it
                reported.append(drive.feedback().position)
    assert reported == pytest.approx([0.5] * len(reported), abs=2 / SCALE)
    assert reported
    assert drive.feedback().position == 0.0  # the new one counts from there


def test_a_lost_enable_stays_lost(net: VirtualNetwork) -> None:
    """Voltage that goes and comes back does not start the drive again."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    net.run(0.1)
    drive = net.devices[JOINT].drive
    assert drive is not None
    drive.set_voltage(False, net.now)
    net.run(0.3)
    assert net.drives[JOINT].view.state is not DriveState.OPERATION_ENABLED
    drive.set_voltage(True, net.now)
    net.run(1.0)
    assert net.drives[JOINT].view.state is not DriveState.OPERATION_ENABLED
    assert any(JOINT in text for text in net.reported(Severity.ERROR))


def test_refusals_before_init(net: VirtualNetwork) -> None:
    """A target before enable and one without a mode say what to call."""
    with pytest.raises(DriveError, match=r'init or enable it: 0x0250 Switch on disabled'):
        net.commands[JOINT].set_target(0.1)
    net.do(JOINT, 'init')
    with pytest.raises(DriveError, match=r'no mode of operation.*position_mode'):
        net.commands[JOINT].set_target(0.1)
    with pytest.raises(DriveError, match=r'in no RPDO'):
        net.select(JOINT, OperationMode.CYCLIC_TORQUE)


@pytest.mark.parametrize('target', [math.nan, math.inf, -math.inf, 1e9])
@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_impossible_targets_never_leave(
    net: VirtualNetwork, mode: OperationMode, target: float
) -> None:
    """NaN, infinity and what no INTEGER32 holds are refused, and nothing moves."""
    enabled(net, mode)
    rest = position_inc(net)
    with pytest.raises(DriveError, match=r'target'):
        net.commands[JOINT].set_target(target)
    net.run(0.5)
    assert position_inc(net) == rest


def test_software_limits_are_checked_before_the_bus() -> None:
    """A target beyond 0x607D is refused with the limits in user units."""
    limits = (
        sdo_write(0x6081, 0, 10_000),
        sdo_write(0x607D, 1, -5_000),
        sdo_write(0x607D, 2, 20_000),
    )
    net = VirtualNetwork(bus_config(drive_config(JOINT, 2, sdo_writes=limits)))
    net.boot()
    enabled(net, OperationMode.PROFILE_POSITION)
    with pytest.raises(DriveError, match=r'-0\.5 to 2'):
        net.commands[JOINT].set_target(-0.6)
    net.commands[JOINT].set_target(-0.4)


def test_quick_stop_ends_what_runs_and_stops(net: VirtualNetwork) -> None:
    """A quick stop in motion leads to rest, and the drive is not enabled afterwards."""
    enabled(net, OperationMode.PROFILE_VELOCITY)
    net.commands[JOINT].set_target(0.5)
    net.run(1.0)
    net.do(JOINT, 'quick_stop', preempt=True)
    net.run(1.0)
    assert net.drives[JOINT].view.velocity == 0.0
    assert net.drives[JOINT].view.state is DriveState.SWITCH_ON_DISABLED


def test_busy_is_said_and_halt_preempts(net: VirtualNetwork) -> None:
    """A second command is refused by name while one runs; one that stops is not."""
    first = net.begin(JOINT, 'init')
    with pytest.raises(DriveError, match=r'busy: init is running'):
        net.do(JOINT, 'enable')
    net.do(JOINT, 'disable', preempt=True)
    with pytest.raises(DriveError, match=r'init was ended by disable'):
        first.result()


@pytest.mark.parametrize('method', [35, 37])
def test_init_homes_by_the_method_of_the_drive(method: int) -> None:
    """With 0x6098 set, init homes, and the position becomes the home offset."""
    writes = (sdo_write(0x6098, 0, method), sdo_write(0x607C, 0, 1_000))
    net = VirtualNetwork(bus_config(drive_config(JOINT, 2, sdo_writes=writes)))
    net.boot()
    assert f'homed by method {method}' in net.do(JOINT, 'init')
    net.run(0.1)
    assert net.drives[JOINT].view.position == pytest.approx(1_000 / SCALE)


def test_a_device_that_restarts_in_motion_is_booted_and_left_disabled(
    net: VirtualNetwork,
) -> None:
    """After a reboot in motion the drive is operational again, but not enabled."""
    enabled(net, OperationMode.PROFILE_VELOCITY)
    net.commands[JOINT].set_target(0.5)
    net.run(0.5)
    net.power_off(JOINT)
    net.power_on(JOINT)
    net.run(0.1)
    net.run_until(net.all_ready)
    net.run(1.0)
    assert any('restarted' in text for text in net.reported(Severity.ERROR))
    assert net.drives[JOINT].view.state is DriveState.SWITCH_ON_DISABLED
    assert net.drives[JOINT].view.velocity == 0.0


def test_loss_ends_a_command_with_the_reason(net: VirtualNetwork) -> None:
    """A device that disappears during init ends it at once, not at its time-out."""
    running = net.begin(JOINT, 'init')
    net.power_off(JOINT)
    with pytest.raises(DriveError, match=r'offline'):
        net.result(running, timeout=1.0)


def test_somebody_else_stops_the_node(net: VirtualNetwork) -> None:
    """A node sent to pre-operational from outside is reported, with the service that starts it."""
    enabled(net, OperationMode.PROFILE_POSITION)
    net.run(0.3)
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 2)
    net.run(0.5)
    assert any('PRE_OPERATIONAL' in text for text in net.reported(Severity.WARNING))
    assert 'start it by NMT' in net.drives[JOINT].describe()


@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_shutdown_leaves_the_drive_without_power(net: VirtualNetwork, mode: OperationMode) -> None:
    """From motion in any mode, shutdown ends in Switch On Disabled and at rest."""
    enabled(net, mode)
    net.commands[JOINT].set_target(0.5)
    net.run(0.3)
    answer = net.do(JOINT, 'shutdown', preempt=True)
    drive = net.devices[JOINT].drive
    assert drive is not None
    assert drive.state is DriveState.SWITCH_ON_DISABLED
    assert 'Switch on disabled' in answer, 'it is what was seen last'
    assert abs(drive.velocity) < 0.01 * SCALE


def test_a_dead_master_is_noticed() -> None:
    """Without the master's heartbeat the drive stops by itself and loses its enable."""
    config = bus_config(
        drive_config(JOINT, 2, heartbeat_consumer=True),
        heartbeat_producer=0.1,
        heartbeat_timeout=0.3,
    )
    net = VirtualNetwork(config)
    net.boot()
    enabled(net, OperationMode.PROFILE_VELOCITY)
    net.commands[JOINT].set_target(0.5)
    net.run(0.5)
    device = net.devices[JOINT]
    assert device.drive is not None
    for _ in range(300):  # only the device's time goes on
        net.now += PERIOD
        device.advance(net.now)
    assert device.drive.velocity == 0.0
    assert DriveState(int(device.drive.state)) is not DriveState.OPERATION_ENABLED


class Ramp:
    """A motion source that moves one axis at a constant speed, after an offset at its start."""

    def __init__(self, speed: float, jump: float = 0.0) -> None:
        self.axes = [JOINT]
        self.losses: list[Refusal] = []
        self._speed = speed
        self._jump = jump
        self._position: float | None = None

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Advance the ramp while the axis follows."""
        axis = feedback[0]
        if not axis.followable:
            return [None]
        if self._position is None:
            self._position = axis.setpoint + self._jump
        self._position += self._speed * period
        return [self._position]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Keep the cause."""
        self.losses.append(refusal)


def test_a_stream_is_followed_and_braked_at_its_end(net: VirtualNetwork) -> None:
    """Set-points of a source are obeyed; detached in motion, it brakes within its limits."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    source = Ramp(0.4)
    net.group.attach(source)
    begin = net.now
    net.run(1.0)
    assert net.drives[JOINT].view.velocity == pytest.approx(0.4, rel=0.05)
    net.group.detach(source)
    net.run(1.0)
    assert net.drives[JOINT].view.velocity == 0.0
    targets = [target / SCALE for target in net.targets(JOINT, since=begin)]
    speeds = [(b - a) / PERIOD for a, b in pairwise(targets)]
    limit = net.drives[JOINT].view.parameters.profile.deceleration
    # the source starts at speed, which is its own affair; the end is ours
    steps = [abs(b - a) for a, b in pairwise(speeds[2:])]
    assert max(steps) <= limit * PERIOD + 2 / SCALE / PERIOD


def test_a_stream_that_jumps_at_the_start_is_refused(net: VirtualNetwork) -> None:
    """A source that does not begin at the set-point loses the axis with the reason."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    rest = position_inc(net)
    source = Ramp(0.1, jump=0.5)
    net.group.attach(source)
    net.run(0.5)
    assert position_inc(net) == pytest.approx(rest, abs=1)
    assert source.losses[0].cause is RefusalCause.SETPOINT_REFUSED


def test_a_single_target_takes_the_axis_from_its_source(net: VirtualNetwork) -> None:
    """A target by service ends the stream without a jump, and stays in charge."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    source = Ramp(0.4)
    net.group.attach(source)
    net.run(0.5)
    net.commands[JOINT].set_target(0.0)
    net.run(3.0)
    assert [loss.cause for loss in source.losses] == [RefusalCause.SINGLE_TARGET]
    assert net.drives[JOINT].view.position == pytest.approx(0.0, abs=2 / SCALE)


def test_a_source_attached_again_goes_on(net: VirtualNetwork) -> None:
    """What it still has is not taken from it; what it had lost it gets back."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    source = Ramp(0.4)
    net.group.attach(source)
    net.run(0.5)
    begin = net.now
    net.group.attach(source)
    net.run(0.5)
    assert source.losses == []
    targets = [target / SCALE for target in net.targets(JOINT, since=begin)]
    assert all(b - a == pytest.approx(0.4 * PERIOD, abs=2 / SCALE) for a, b in pairwise(targets))
    net.group.attach(Ramp(0.0))
    net.run(0.1)
    assert [loss.cause for loss in source.losses] == [RefusalCause.OTHER_SOURCE]


class Broken(Ramp):
    """A source with a defect."""

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Fail."""
        raise ZeroDivisionError('a defect')


@pytest.mark.parametrize('bad', [math.nan, math.inf, 1e12])
def test_bad_sources_move_nothing(net: VirtualNetwork, bad: float) -> None:
    """NaN from a source, or an exception in it, is reported and moves nothing."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    rest = position_inc(net)
    nan = Ramp(bad)
    net.group.attach(nan)
    net.run(0.2)
    assert len(nan.losses) == 1
    net.group.attach(Broken(0.1))
    net.run(0.2)
    assert any('a defect' in text for text in net.reported(Severity.ERROR))
    assert position_inc(net) == pytest.approx(rest, abs=1)
