# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A failure in any step of the cycle stops and disables its drive; the others and SYNC go on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import itertools
import struct

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, PERIOD, SCALE
import pytest

from arm_canopen import (
    AxisFeedback,
    CodecError,
    DriveError,
    DriveState,
    OperationMode,
    Refusal,
    RefusalCause,
    Severity,
)
from arm_canopen.cia402.position_modes import Move
from arm_canopen.config import NodeConfig
from arm_canopen.standard import DataType

pytestmark = pytest.mark.slow

JOINTS = ('joint1', 'joint2', 'joint3')
SPEED = 0.2  # [rad/s]


class Stream:
    """A motion source that leads every axis that follows."""

    axes = JOINTS

    def __init__(self) -> None:
        self.losses: dict[str, Refusal] = {}
        self._positions: dict[str, float] = {}

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Go on."""
        for axis in feedback:
            if axis.followable:
                before = self._positions.get(axis.name, axis.setpoint)
                self._positions[axis.name] = before + SPEED * period
        return [self._positions.get(axis.name) for axis in feedback]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Keep the cause."""
        self.losses[axis] = refusal


class Arm:
    """Three drives under a motion source."""

    def __init__(self) -> None:
        """Set them in motion."""
        nodes = [drive_config(name, 2 + number) for number, name in enumerate(JOINTS)]
        self.net = VirtualNetwork(bus_config(*nodes))
        self.net.allows_defects = True
        self.net.boot()
        for name in JOINTS:
            self.net.do(name, 'init')
            self.net.select(name, OperationMode.CYCLIC_POSITION)
        self.source = Stream()
        self.net.master.attach(self.source)
        self.net.run(0.3)


def broken(*_: object, **__: object) -> None:
    """Fail."""
    raise ZeroDivisionError('injected')


def unpackable(*_: object) -> None:
    """Fail as the codec does."""
    raise CodecError('injected')


def break_drive(attribute: str) -> Callable[[Arm, str, pytest.MonkeyPatch], None]:
    """Return what lets a method of a drive fail."""

    def inject(arm: Arm, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(arm.net.drives[name], attribute, broken)

    return inject


def break_node(attribute: str) -> Callable[[Arm, str, pytest.MonkeyPatch], None]:
    """Return what lets a method of a device fail."""

    def inject(arm: Arm, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(arm.net.network.nodes[name], attribute, broken)

    return inject


def break_count(arm: Arm, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the count of missed TPDOs fail; some are missed."""
    lost = itertools.count()
    arm.net.wire.loses = lambda sender, frame: sender == name and next(lost) % 3 == 0
    monkeypatch.setattr(arm.net.network.nodes[name], 'count_missed', broken)


def break_view(arm: Arm, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the state be out of reach."""
    monkeypatch.setattr(arm.net.drives[name].view, 'observe', broken)


def break_mode(arm: Arm, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the mode fail."""
    monkeypatch.setattr(arm.net.drives[name].control.mode, 'step', broken)


def break_controlword(arm: Arm, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no controlword be written."""
    monkeypatch.setattr(arm.net.drives[name].objects.controlword, 'write', unpackable)


def break_rpdo(number: int) -> Callable[[Arm, str, pytest.MonkeyPatch], None]:
    """Return what lets the packing of an RPDO fail."""

    def inject(arm: Arm, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
        outputs = arm.net.network.nodes[name].image.rpdos
        output = next(entry for entry in outputs if entry.config.number == number)
        monkeypatch.setattr(output, '_pack', unpackable)

    return inject


STEPS: dict[str, Callable[[Arm, str, pytest.MonkeyPatch], None]] = {
    'read': break_drive('read'),
    'observe': break_view,
    'feedback': break_drive('feedback'),
    'stream': break_drive('stream'),
    'write': break_drive('write'),
    'mode': break_mode,
    'controlword': break_controlword,
    'RPDO 1': break_rpdo(1),
    'RPDO 2': break_rpdo(2),
    'RPDO 3': break_rpdo(3),
    'count of TPDOs': break_count,
    'expectation of TPDOs': break_node('expect_answers'),
    'life signs': break_node('watch'),
}


@pytest.mark.parametrize(('step', 'name'), list(zip(STEPS, itertools.cycle(JOINTS), strict=False)))
def test_a_failing_step_stops_its_drive_only(
    step: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is stopped, disabled and named once; SYNC and the stream of the others go on."""
    arm = Arm()
    net = arm.net
    STEPS[step](arm, name, monkeypatch)
    begin = net.now
    net.run(3.0)
    device = net.devices[name].drive
    assert device is not None
    assert device.state is DriveState.SWITCH_ON_DISABLED, net.story()
    assert device.velocity == 0.0
    errors = [text for text in net.reported(Severity.ERROR) if 'injected' in text]
    assert len(errors) == 1, errors
    assert errors[0].startswith(f'{name}: stopping')
    assert arm.source.losses.keys() == {name}
    assert arm.source.losses[name].cause is RefusalCause.CYCLE_FAILED
    assert len(net.frames(0x080, since=begin)) == pytest.approx(3.0 / PERIOD, abs=2)
    for other in set(JOINTS) - {name}:
        axis = net.devices[other].drive
        assert axis is not None
        assert axis.state is DriveState.OPERATION_ENABLED
        assert axis.velocity / SCALE == pytest.approx(SPEED, rel=0.05)


def test_a_failing_hook_keeps_neither_sync_nor_rpdos_from_being_sent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the owner of the network does wrong is reported once, and costs no frame."""
    arm = Arm()
    arm.net.network.on_feedback = broken
    monkeypatch.setattr(arm.net.network._heartbeat, 'advance', broken)
    begin = arm.net.now
    arm.net.run(1.0)
    assert len(arm.net.frames(0x080, since=begin)) == pytest.approx(1.0 / PERIOD, abs=2)
    assert len(arm.net.frames(0x202, since=begin)) == pytest.approx(1.0 / PERIOD, abs=2)
    assert len([text for text in arm.net.reported(Severity.ERROR) if 'injected' in text]) == 1


def typed(config: NodeConfig, index: int, data_type: DataType) -> NodeConfig:
    """Return a device whose RPDOs carry an object as another type."""
    rpdos = tuple(
        replace(
            pdo,
            mapping=tuple(
                replace(mapped, data_type=data_type) if mapped.index == index else mapped
                for mapped in pdo.mapping
            ),
        )
        for pdo in config.rpdos
    )
    return replace(config, rpdos=rpdos)


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
    net = VirtualNetwork(bus_config(joint, drive_config('joint2', 3)))
    net.boot()
    net.do('joint1', 'init')
    net.select('joint1', mode)
    commands = net.commands['joint1']
    with pytest.raises(DriveError, match='0 to '):
        commands.set_target(-0.3)
    with pytest.raises(DriveError, match='0 to '):
        commands.stream_target(-0.3)
    if mode is OperationMode.PROFILE_POSITION:
        with pytest.raises(DriveError, match='0 to '):
            commands.move(Move(-0.3))
    net.run(0.5)
    device = net.devices['joint1'].drive
    assert device is not None
    assert device.position == 0.0
    assert device.state is DriveState.OPERATION_ENABLED
    commands.set_target(0.3)
    net.run(2.0)
    assert device.position > 0.25 * SCALE
    assert not net.reported(Severity.ERROR)


def test_a_value_that_cannot_be_packed_keeps_nothing_else_from_being_sent() -> None:
    """The writer refuses it; the RPDO carries the value before, and its controlword leaves."""
    net = VirtualNetwork(bus_config(drive_config('joint1', 2)))
    net.boot()
    image = net.network.nodes['joint1'].image
    target = image.writer(0x607A)
    assert target is not None
    target.write(7)
    for bad in (2**31, -(2**31) - 1, float('nan'), float('inf')):
        with pytest.raises(CodecError, match='0x607A'):
            target.write(bad)
    output = next(entry for entry in image.rpdos if entry.config.number == 2)
    assert struct.unpack_from('<i', output.frame().data) == (7,)
