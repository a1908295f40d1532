# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What one drive says or does wrong harms neither the cycle of the bus nor its own axis."""

from __future__ import annotations

from collections.abc import Sequence
import struct

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
from arm_canopen.can import Frame
from arm_canopen.cia402.units import Units
from arm_canopen.config import DriveConfig

pytestmark = pytest.mark.slow

GOOD, ODD = 'joint1', 'joint2'
NODE_IDS = {GOOD: 2, ODD: 3}
INTEGER32_MIN = -(2**31)  # smallest INTEGER32; many encoders say so while they have no reference


def pair(mode: OperationMode, **scales: float) -> VirtualNetwork:
    """Return two enabled drives; the second has other scales."""
    odd = drive_config(ODD, NODE_IDS[ODD], scales=scales)
    net = VirtualNetwork(bus_config(drive_config(GOOD, NODE_IDS[GOOD]), odd))
    net.boot()
    for name in NODE_IDS:
        net.do(name, 'init')
        net.select(name, mode)
    return net


def report_actual(net: VirtualNetwork, position: int | None, velocity: int | None) -> None:
    """Have the second drive say another position or velocity than it has, in device units."""

    def alters(sender: str, frame: Frame) -> Frame:
        if frame.can_id != 0x280 + NODE_IDS[ODD]:
            return frame
        reported = struct.unpack('<ii', frame.data)
        reported = (
            reported[0] if position is None else position,
            reported[1] if velocity is None else velocity,
        )
        return frame._replace(data=struct.pack('<ii', *reported))

    net.wire.alters = alters


def motor(net: VirtualNetwork, name: str) -> float:
    """Return where a motor really is in [rad]."""
    drive = net.devices[name].drive
    assert drive is not None
    return drive.position / SCALE


def assert_served(net: VirtualNetwork) -> None:
    """Check that SYNC goes on and the first drive accepts targets."""
    begin = net.now
    net.commands[GOOD].set_target(0.3)
    net.run(2.0)
    assert len(net.frames(0x080, since=begin)) == pytest.approx(2.0 / PERIOD, abs=2)
    assert motor(net, GOOD) == pytest.approx(0.3, abs=2e-3)


@pytest.mark.parametrize('mode', [OperationMode.PROFILE_POSITION, OperationMode.CYCLIC_POSITION])
@pytest.mark.parametrize(('position', 'velocity'), [(None, INTEGER32_MIN), (INTEGER32_MIN, None)])
def test_odd_values_of_a_disabled_drive_harm_nobody(
    mode: OperationMode, position: int | None, velocity: int | None
) -> None:
    """The smallest number in 0x6064 or 0x606C: SYNC goes on, the other drive accepts targets."""
    net = pair(mode)
    net.do(ODD, 'disable')
    report_actual(net, position, velocity)
    net.run(0.1)
    assert_served(net)
    assert not net.reported(Severity.ERROR)


def test_factors_that_are_not_reciprocal_harm_nobody() -> None:
    """A velocity that does not fit 0x60FF by these factors is clamped before it is written."""
    net = pair(OperationMode.PROFILE_POSITION, scale_vel_to_dev=1e7)
    net.do(ODD, 'disable')
    report_actual(net, None, 3_000_000)
    assert_served(net)
    assert not net.reported(Severity.ERROR)


@pytest.mark.parametrize('mode', [OperationMode.CYCLIC_POSITION, OperationMode.CYCLIC_VELOCITY])
@pytest.mark.parametrize('velocity', [INTEGER32_MIN, -50_000])
def test_a_wrong_actual_velocity_moves_nothing(mode: OperationMode, velocity: int) -> None:
    """An axis that stands is not braked from a speed that only 0x606C claims."""
    net = pair(mode)
    net.do(ODD, 'disable')
    report_actual(net, None, velocity)
    net.run(0.3)
    begin = motor(net, ODD)
    net.do(ODD, 'enable')
    for _ in range(100):
        net.run(PERIOD)
        assert motor(net, ODD) == pytest.approx(begin, abs=1e-3)


def test_an_encoder_without_reference_is_held_where_it_is() -> None:
    """The smallest position is a legal target: what is preloaded is what the drive says."""
    net = pair(OperationMode.CYCLIC_POSITION)
    net.do(ODD, 'disable')
    report_actual(net, INTEGER32_MIN, 0)
    net.run(0.1)
    assert 'Operation enabled' in net.do(ODD, 'enable')
    sent = net.frames(0x300 + NODE_IDS[ODD], since=net.now - 0.05)
    assert {struct.unpack_from('<i', data)[0] for data in sent} == {INTEGER32_MIN}
    assert_served(net)
    assert not [text for text in net.reported(Severity.ERROR) if 'stopping' in text]


@pytest.mark.parametrize(
    ('quantity', 'least'), [('position', INTEGER32_MIN), ('effort', -(2**15))]
)
def test_the_smallest_number_of_an_object_fits(quantity: str, least: int) -> None:
    """One more below zero than above it, and not one beyond."""
    scale = getattr(Units(DriveConfig(scale_pos_to_dev=1.0)), quantity)
    assert scale.to_device(least) == least
    assert scale.to_device(-least - 1) == -least - 1
    for beyond in (least - 1, -least):
        with pytest.raises(DriveError, match='more than the object can hold'):
            scale.to_device(beyond)


def test_a_drive_whose_cycle_fails_is_stopped_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is stopped by a quick stop and named once; enabled again, it gets another chance."""
    net = pair(OperationMode.CYCLIC_POSITION)
    mode = net.drives[ODD].control.modes[OperationMode.CYCLIC_POSITION]
    net.commands[ODD].set_target(2.0)
    net.run(0.5)

    def refuse(now: float, period: float, statusword: int) -> None:
        raise DriveError('target 1e9 does not fit')

    monkeypatch.setattr(mode, 'step', refuse)
    net.run(1.0)
    assert_served(net)
    assert net.drives[ODD].view.state is DriveState.SWITCH_ON_DISABLED
    assert net.drives[ODD].view.velocity == 0.0
    reported = [text for text in net.reported(Severity.ERROR) if '1e9 does not fit' in text]
    assert len(reported) == 1
    assert ODD in reported[0]
    monkeypatch.undo()
    begin = motor(net, ODD)
    net.do(ODD, 'enable')
    net.run(0.5)
    assert motor(net, ODD) == pytest.approx(begin, abs=1e-3)


class Careless:
    """A motion source that fails when it loses its axis."""

    axes = (ODD,)

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Hold the axis."""
        return [feedback[0].setpoint]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Fail."""
        raise ZeroDivisionError('a defect')


def test_a_source_that_fails_when_it_loses_its_axis_harms_nobody() -> None:
    """The loss of the device is handled all the same, and the source is named."""
    net = pair(OperationMode.CYCLIC_POSITION)
    net.master.attach(Careless())
    net.run(0.1)
    net.power_off(ODD)
    net.run(1.0)
    assert_served(net)
    assert not net.network.nodes[ODD].online
    assert any(
        'Careless raised ZeroDivisionError' in text for text in net.reported(Severity.ERROR)
    )


class Script:
    """A motion source that holds its axis for a while and then does something else."""

    axes = (GOOD,)

    def __init__(self, *answers: float) -> None:
        """Take what it answers beyond the set-point of before, from its tenth cycle on."""
        self.losses: list[Refusal] = []
        self._answers = answers
        self._position: float | None = None
        self._cycle = 0

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Hold, then answer the given set-points."""
        self._cycle += 1
        if self._position is None:
            self._position = feedback[0].setpoint
        if self._cycle < 10:
            return [self._position]
        return [self._position + answer for answer in self._answers]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Keep the cause."""
        self.losses.append(refusal)


@pytest.mark.parametrize('jump', [5.0, -0.2])
def test_a_stream_that_jumps_on_its_way_is_refused(jump: float) -> None:
    """Not only its start is checked: the axis is braked and released, and nothing jumps."""
    net = pair(OperationMode.CYCLIC_POSITION)
    source = Script(jump)
    net.master.attach(source)
    begin = motor(net, GOOD)
    net.run(0.5)
    assert motor(net, GOOD) == pytest.approx(begin, abs=1e-3)
    assert len(source.losses) == 1
    assert source.losses[0].cause is RefusalCause.SETPOINT_REFUSED
    assert 'jumps' in source.losses[0].detail
    assert_served(net)


@pytest.mark.parametrize('answers', [(), (0.0, 0.0)])
def test_a_source_that_answers_for_another_number_of_axes_is_detached(
    answers: tuple[float, ...],
) -> None:
    """Nobody could say which set-point is whose."""
    net = pair(OperationMode.CYCLIC_POSITION)
    net.master.attach(Script(*answers))
    net.run(0.5)
    reported = f'answered {len(answers)} set-points for 1 axes'
    assert any(reported in text for text in net.reported(Severity.ERROR))
    assert_served(net)
