# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What one drive or one source says or does wrong harms neither the cycle nor its own axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import itertools
import math
import struct
from typing import Any

from bus_rig import booted, Leader, VirtualNetwork
from drive_samples import drive_config, PERIOD, SCALE
import pytest

from arm_canopen import (
    AxisFeedback,
    CodecError,
    DriveError,
    DriveState,
    NodeConfig,
    OperationMode,
    Refusal,
    RefusalCause,
    Severity,
)
from arm_canopen.cia402.modes import Move
from arm_canopen.cia402.units import Units
from arm_canopen.config import DriveConfig
from canopen_core.standard import DataType, MappedObject

pytestmark = pytest.mark.slow

JOINTS = ('joint1', 'joint2', 'joint3')
SPEED = 0.2  # [rad/s]


def led_arm() -> tuple[VirtualNetwork, Leader]:
    """Return three drives in motion under a motion source, and the source."""
    net = booted(*(drive_config(name, 2 + number) for number, name in enumerate(JOINTS)))
    net.allows_defects = True
    for name in JOINTS:
        net.enable(OperationMode.CYCLIC_POSITION, name)
    source = Leader(*JOINTS, speed=SPEED)
    net.master.attach(source)
    net.run(0.3)
    return net, source


def broken(*_: object, **__: object) -> None:
    """Fail."""
    raise ZeroDivisionError('injected')


def rpdo(net: VirtualNetwork, name: str, number: int) -> object:
    """Return an RPDO of a device."""
    outputs = net.network.nodes[name].image.rpdos
    return next(entry for entry in outputs if entry.config.number == number)


STEPS: dict[str, Callable[[VirtualNetwork, str], tuple[object, str]]] = {
    'read': lambda net, name: (net.drives[name], 'read'),
    'observe': lambda net, name: (net.drives[name].view, 'observe'),
    'feedback': lambda net, name: (net.drives[name], 'feedback'),
    'stream': lambda net, name: (net.drives[name], 'stream'),
    'write': lambda net, name: (net.drives[name], 'write'),
    'mode': lambda net, name: (net.drives[name].mode, 'step'),
    'controlword': lambda net, name: (net.drives[name].controlword.writer, 'write'),
    'RPDO 1': lambda net, name: (rpdo(net, name, 1), 'frame'),
    'RPDO 2': lambda net, name: (rpdo(net, name, 2), 'frame'),
    'RPDO 3': lambda net, name: (rpdo(net, name, 3), 'frame'),
    'count of TPDOs': lambda net, name: (net.network.nodes[name].pdos, 'count_missed'),
    'expectation of TPDOs': lambda net, name: (net.network.nodes[name], 'expect_answers'),
    'life signs': lambda net, name: (net.network.nodes[name], 'watch'),
}


@pytest.mark.parametrize(('step', 'name'), list(zip(STEPS, itertools.cycle(JOINTS), strict=False)))
def test_a_failing_step_stops_its_drive_only(
    step: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is stopped, disabled and named once; SYNC and the stream of the others go on."""
    net, source = led_arm()
    if step == 'count of TPDOs':
        lost = itertools.count()
        net.wire.loses = lambda sender, frame: sender == name and next(lost) % 3 == 0
    monkeypatch.setattr(*STEPS[step](net, name), broken)
    begin = net.now
    net.run(3.0)
    assert net.simulated(name).state is DriveState.SWITCH_ON_DISABLED, net.story()
    assert net.speed(name) == 0.0
    errors = [text for text in net.reported(Severity.ERROR) if 'injected' in text]
    assert len(errors) == 1, errors
    assert errors[0].startswith(f'{name}: stopping')
    assert source.losses.keys() == {name}
    assert source.losses[name].cause is RefusalCause.CYCLE_FAILED
    assert len(net.frames(0x080, since=begin)) == pytest.approx(3.0 / PERIOD, abs=2)
    for other in set(JOINTS) - {name}:
        assert net.simulated(other).state is DriveState.OPERATION_ENABLED
        assert net.speed(other) == pytest.approx(SPEED, rel=0.05)


def test_a_failing_hook_keeps_neither_sync_nor_rpdos_from_being_sent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the owner of the network does wrong is reported once, and costs no frame."""
    net, _ = led_arm()
    net.network.on_feedback = broken
    monkeypatch.setattr(net.network._heartbeat, 'advance', broken)
    begin = net.now
    net.run(1.0)
    assert len(net.frames(0x080, since=begin)) == pytest.approx(1.0 / PERIOD, abs=2)
    assert len(net.frames(0x202, since=begin)) == pytest.approx(1.0 / PERIOD, abs=2)
    assert len([text for text in net.reported(Severity.ERROR) if 'injected' in text]) == 1


def typed(config: NodeConfig, index: int, data_type: DataType) -> NodeConfig:
    """Return a device whose RPDOs carry an object as another type."""

    def other(mapped: MappedObject) -> MappedObject:
        return replace(mapped, data_type=data_type) if mapped.index == index else mapped

    rpdos = (replace(pdo, mapping=tuple(map(other, pdo.mapping))) for pdo in config.rpdos)
    return replace(config, rpdos=tuple(rpdos))


NARROW = {
    OperationMode.PROFILE_POSITION: 0x607A,
    OperationMode.CYCLIC_POSITION: 0x607A,
    OperationMode.INTERPOLATED_POSITION: 0x60C1,
    OperationMode.PROFILE_VELOCITY: 0x60FF,
    OperationMode.CYCLIC_VELOCITY: 0x60FF,
}


@pytest.mark.parametrize('mode', NARROW, ids=lambda mode: mode.name)
def test_a_target_beyond_the_type_of_its_object_is_refused_at_the_call(
    mode: OperationMode,
) -> None:
    """By the range of the mapped type, before anything moves; the drive stays enabled."""
    joint = typed(drive_config('joint1', 2), NARROW[mode], DataType.UNSIGNED32)
    net = booted(joint, drive_config('joint2', 3))
    net.enable(mode, 'joint1')
    commands = net.commands['joint1']
    with pytest.raises(DriveError, match='0 to '):
        commands.set_target(-0.3)
    with pytest.raises(DriveError, match='0 to '):
        commands.stream_target(-0.3)
    if mode is OperationMode.PROFILE_POSITION:
        with pytest.raises(DriveError, match='0 to '):
            commands.move(Move(-0.3))
    net.run(0.5)
    device = net.simulated('joint1')
    assert device.position == 0.0
    assert device.state is DriveState.OPERATION_ENABLED
    commands.set_target(0.3)
    net.run(2.0)
    assert device.position > 0.25 * SCALE
    assert not net.reported(Severity.ERROR)


def test_a_value_that_cannot_be_packed_keeps_nothing_else_from_being_sent() -> None:
    """The writer refuses it; the RPDO carries the value before, and its controlword leaves."""
    net = booted(drive_config('joint1', 2))
    image = net.network.nodes['joint1'].image
    target = image.writer(0x607A)
    assert target is not None
    target.write(7)
    for bad in (2**31, -(2**31) - 1, float('nan'), float('inf')):
        with pytest.raises(CodecError, match='0x607A'):
            target.write(bad)
    output = next(entry for entry in image.rpdos if entry.config.number == 2)
    assert struct.unpack_from('<i', output.frame().data) == (7,)


GOOD, ODD = 'joint1', 'joint2'
NODE_IDS = {GOOD: 2, ODD: 3}
INTEGER32_MIN = -(2**31)  # smallest INTEGER32; many encoders say so while they have no reference


def pair(mode: OperationMode, **scales: float) -> VirtualNetwork:
    """Return two enabled drives; the second has other scales."""
    odd = drive_config(ODD, NODE_IDS[ODD], scales=scales)
    net = booted(drive_config(GOOD, NODE_IDS[GOOD]), odd)
    for name in NODE_IDS:
        net.enable(mode, name)
    return net


def report_actual(net: VirtualNetwork, position: int | None, velocity: int | None) -> None:
    """Make the second drive report another position or velocity than it has, in device units."""

    def reported(data: bytes) -> bytes:
        actual = zip((position, velocity), struct.unpack('<ii', data), strict=True)
        return struct.pack('<ii', *(true if other is None else other for other, true in actual))

    net.alter(0x280 + NODE_IDS[ODD], reported)


def assert_served(net: VirtualNetwork) -> None:
    """Check that SYNC goes on and the first drive accepts targets."""
    begin, target = net.now, 0.0 if net.motor(GOOD) > 0.1 else 0.3
    net.commands[GOOD].set_target(target)
    net.run(2.0)
    assert len(net.frames(0x080, since=begin)) == pytest.approx(2.0 / PERIOD, abs=2)
    assert net.motor(GOOD) == pytest.approx(target, abs=2e-3)


@pytest.mark.parametrize('mode', [OperationMode.PROFILE_POSITION, OperationMode.CYCLIC_POSITION])
@pytest.mark.parametrize(
    ('position', 'velocity', 'scales'),
    [
        (None, INTEGER32_MIN, {}),
        (INTEGER32_MIN, None, {}),
        (None, 3_000_000, {'scale_vel_to_dev': 1e7}),
    ],
    ids=['velocity', 'position', 'factors that are not reciprocal'],
)
def test_odd_values_of_a_disabled_drive_harm_nobody(
    mode: OperationMode, position: int | None, velocity: int | None, scales: dict[str, float]
) -> None:
    """The smallest number in 0x6064 or 0x606C, or one that does not fit 0x60FF by its factors."""
    net = pair(mode, **scales)
    net.do(ODD, 'disable')
    report_actual(net, position, velocity)
    net.run(0.1)
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
    begin = net.motor(ODD)
    net.do(ODD, 'enable')
    for _ in range(100):
        net.run(PERIOD)
        assert net.motor(ODD) == pytest.approx(begin, abs=1e-3)


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


def test_the_smallest_number_of_an_object_fits() -> None:
    """One more below zero than above it, and not one beyond."""
    units = Units(DriveConfig(scale_pos_to_dev=1.0))
    for scale, least in ((units.position, INTEGER32_MIN), (units.effort, -(2**15))):
        assert scale.to_device(least) == least
        assert scale.to_device(-least - 1) == -least - 1
        for beyond in (least - 1, -least):
            with pytest.raises(DriveError, match='more than the object can hold'):
                scale.to_device(beyond)


class Misbehaving(Leader):
    """A motion source that holds its axis for some cycles and then does something else."""

    def __init__(self, misdeed: Callable[[float], Sequence[float]], after: int) -> None:
        super().__init__(GOOD, speed=0.0)
        self._misdeed = misdeed
        self._cycles = after

    def update(self, now: float, period: float, feedback: Sequence[AxisFeedback]) -> Any:
        """Hold, then misbehave."""
        self._cycles -= 1
        if self._cycles >= 0:
            return super().update(now, period, feedback)
        return self._misdeed(feedback[0].setpoint)

    def released(self, axis: str, refusal: Refusal) -> None:
        """Fail, when everything is done."""
        super().released(axis, refusal)
        raise ZeroDivisionError('a defect')


MISDEEDS: dict[str, tuple[Callable[[float], Sequence[float]], str]] = {
    'jump': (lambda held: [held + 5.0], 'the stream '),
    'jump back': (lambda held: [held - 0.2], 'the stream '),
    'NaN': (lambda held: [math.nan], 'nan'),
    'inf': (lambda held: [math.inf], 'inf'),
    'too far': (lambda held: [1e12], ''),
    'nothing': (lambda held: [], 'answered 0 set-points for 1 axes'),
    'too many': (lambda held: [held, held], 'answered 2 set-points for 1 axes'),
    'exception': (lambda held: [held / 0], 'Misbehaving raised ZeroDivisionError'),
}


@pytest.mark.parametrize('after', [0, 10], ids=['at the start', 'on its way'])
def test_a_source_that_misbehaves_loses_its_axis(after: int) -> None:
    """At the start and on its way: the axis is braked and released, and nothing jumps."""
    net = pair(OperationMode.CYCLIC_POSITION)
    net.allows_defects = True
    for name, (misdeed, said) in MISDEEDS.items():
        net.events.clear()
        source = Misbehaving(misdeed, after)
        net.master.attach(source)
        begin = net.motor(GOOD)
        net.run(0.5)
        assert net.motor(GOOD) == pytest.approx(begin, abs=1e-3), name
        if GOOD in source.losses:
            assert source.losses[GOOD].cause is RefusalCause.SETPOINT_REFUSED, name
            assert said in source.losses[GOOD].detail, name
        else:
            assert any(said in text for text in net.reported(Severity.ERROR)), name
        net.master.detach(source)
        assert_served(net)


def test_a_source_that_fails_when_it_loses_its_axis_harms_nobody() -> None:
    """The loss of the device is handled all the same, and the source is named."""
    net = pair(OperationMode.CYCLIC_POSITION)
    source = Misbehaving(lambda held: [held], 0)
    source.axes = (ODD,)
    net.master.attach(source)
    net.run(0.1)
    net.power_off(ODD)
    net.run(1.0)
    assert_served(net)
    assert not net.network.nodes[ODD].online
    text = 'Misbehaving raised ZeroDivisionError'
    assert any(text in reported for reported in net.reported(Severity.ERROR))
