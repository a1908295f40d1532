# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Drives and their commands against simulated devices, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
import math

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, PERIOD, SCALE
import pytest

from arm_canopen import (
    AxisFeedback,
    DriveError,
    DriveState,
    OperationMode,
    Refusal,
    RefusalCause,
    Severity,
)
from arm_canopen.standard import NmtCommand

pytestmark = pytest.mark.slow

JOINT = 'joint1'
POSITION_MODES = [
    OperationMode.PROFILE_POSITION,
    OperationMode.INTERPOLATED_POSITION,
    OperationMode.CYCLIC_POSITION,
]


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


def test_a_fault_speaks(net: VirtualNetwork) -> None:
    """It is reported in words, and whatever is commanded names it until recover."""
    mode = OperationMode.CYCLIC_POSITION
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
    for verb in ('enable', 'disable', 'halt', 'quick_stop', 'home'):
        with pytest.raises(DriveError, match=r'faulted.*recover.*Fault.*0x4210'):
            net.do(JOINT, verb)
    with pytest.raises(DriveError, match=r'faulted'):
        net.select(JOINT, mode)
    with pytest.raises(DriveError, match='recover it'):
        net.commands[JOINT].set_target(0.0)
    assert 'Operation enabled' in net.do(JOINT, 'recover')
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


def test_refusals_before_init(net: VirtualNetwork) -> None:
    """A target before enable and one without a mode say what to call."""
    with pytest.raises(DriveError, match=r'init or enable it: 0x0250 Switch on disabled'):
        net.commands[JOINT].set_target(0.1)
    net.do(JOINT, 'init')
    with pytest.raises(DriveError, match=r'no mode of operation.*position_mode'):
        net.commands[JOINT].set_target(0.1)
    with pytest.raises(DriveError, match=r'in no RPDO'):
        net.select(JOINT, OperationMode.CYCLIC_TORQUE)


def test_busy_is_said_and_halt_preempts(net: VirtualNetwork) -> None:
    """A second command is refused by name while one runs; one that stops is not."""
    first = net.begin(JOINT, 'init')
    with pytest.raises(DriveError, match=r'busy: init is running'):
        net.do(JOINT, 'enable')
    net.do(JOINT, 'disable', preempt=True)
    with pytest.raises(DriveError, match=r'init was ended by disable'):
        first.result()


def test_somebody_else_stops_the_node(net: VirtualNetwork) -> None:
    """A node sent to pre-operational from outside is reported, with the service that starts it."""
    enabled(net, OperationMode.PROFILE_POSITION)
    net.run(0.3)
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 2)
    net.run(0.5)
    assert any('PRE_OPERATIONAL' in text for text in net.reported(Severity.WARNING))
    assert 'start it by NMT' in net.drives[JOINT].describe()


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


def test_a_source_attached_again_goes_on(net: VirtualNetwork) -> None:
    """What it still has is not taken from it; what it had lost it gets back."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    source = Ramp(0.4)
    net.master.attach(source)
    net.run(0.5)
    begin = net.now
    net.master.attach(source)
    net.run(0.5)
    assert source.losses == []
    targets = [target / SCALE for target in net.targets(JOINT, since=begin)]
    assert all(b - a == pytest.approx(0.4 * PERIOD, abs=2 / SCALE) for a, b in pairwise(targets))
    net.master.attach(Ramp(0.0))
    net.run(0.1)
    assert [loss.cause for loss in source.losses] == [RefusalCause.OTHER_SOURCE]


def position_inc(net: VirtualNetwork) -> float:
    """Return where the simulated motor really is in [inc]."""
    drive = net.devices[JOINT].drive
    assert drive is not None
    return drive.position


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


def test_loss_ends_a_command_with_the_reason(net: VirtualNetwork) -> None:
    """A device that disappears during init ends it at once, not at its time-out."""
    running = net.begin(JOINT, 'init')
    net.power_off(JOINT)
    with pytest.raises(DriveError, match=r'offline'):
        net.result(running, timeout=1.0)


def test_a_stream_that_jumps_at_the_start_is_refused(net: VirtualNetwork) -> None:
    """A source that does not begin at the set-point loses the axis with the reason."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    rest = position_inc(net)
    source = Ramp(0.1, jump=0.5)
    net.master.attach(source)
    net.run(0.5)
    assert position_inc(net) == pytest.approx(rest, abs=1)
    assert source.losses[0].cause is RefusalCause.SETPOINT_REFUSED


def test_a_single_target_takes_the_axis_from_its_source(net: VirtualNetwork) -> None:
    """A target by service ends the stream without a jump, and stays in charge."""
    enabled(net, OperationMode.CYCLIC_POSITION)
    source = Ramp(0.4)
    net.master.attach(source)
    net.run(0.5)
    net.commands[JOINT].set_target(0.0)
    net.run(3.0)
    assert [loss.cause for loss in source.losses] == [RefusalCause.SINGLE_TARGET]
    assert net.drives[JOINT].view.position == pytest.approx(0.0, abs=2 / SCALE)


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
    net.master.attach(nan)
    net.run(0.2)
    assert len(nan.losses) == 1
    net.master.attach(Broken(0.1))
    net.run(0.2)
    assert any('a defect' in text for text in net.reported(Severity.ERROR))
    assert position_inc(net) == pytest.approx(rest, abs=1)
