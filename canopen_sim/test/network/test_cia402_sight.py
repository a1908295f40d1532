# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lost PDOs under a motion source: the arm stops on its path, and the source knows the drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import struct

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, PERIOD, SCALE
import pytest

from arm_canopen import AxisFeedback, DriveError, DriveState, OperationMode, Refusal, RefusalCause

pytestmark = pytest.mark.slow

JOINTS = ('joint1', 'joint2', 'joint3')
BLIND = 'joint2'
SPEED = 1.0  # [rad/s]
RATIO = (1.0, -0.5, 0.25)  # of the joints' speeds on the path
BRAKING = 5.0  # [rad/s^2]
TIME_OUT = 0.5  # [s] of silence
FRESH = pytest.mark.parametrize(
    'mode', [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION]
)


class Path:
    """A motion source that leads an arm along a line, and brakes on it when a drive drops out.

    Attributes:
        refusals: First refusal of each drive, by name.
        losses: Drives that were taken away, with the reason.
    """

    axes = JOINTS

    def __init__(self) -> None:
        self.refusals: dict[str, Refusal] = {}
        self.losses: dict[str, Refusal] = {}
        self._begin: list[float] = []
        self._way = 0.0
        self._speed = 0.0

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Accelerate while all follow, brake when one does not."""
        for axis in feedback:
            if axis.refusal is not None:
                self.refusals.setdefault(axis.name, axis.refusal)
        if not self._begin:
            self._begin = [axis.setpoint for axis in feedback]
        wanted = 0.0 if self.refusals or self.losses else SPEED
        change = BRAKING * period
        self._speed += max(-change, min(change, wanted - self._speed))
        self._way += self._speed * period
        if self._speed == 0.0 and self.refusals:
            return [None] * len(feedback)
        return [
            begin + ratio * self._way if axis.followable else None
            for begin, ratio, axis in zip(self._begin, RATIO, feedback, strict=True)
        ]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Keep the cause."""
        self.losses.setdefault(axis, refusal)


class Arm:
    """Three drives that follow a source."""

    def __init__(self, mode: OperationMode) -> None:
        """Set them in motion."""
        nodes = [drive_config(name, 2 + number) for number, name in enumerate(JOINTS)]
        self.net = VirtualNetwork(bus_config(*nodes))
        self.net.boot()
        for name in JOINTS:
            self.net.do(name, 'init')
            self.net.select(name, mode)
        self.source = Path()
        self.net.master.attach(self.source)
        self.net.run(0.5)
        assert self.motor('joint1') > 0.2

    def motor(self, name: str) -> float:
        """Return where a motor really is in [rad]."""
        drive = self.net.devices[name].drive
        assert drive is not None
        return drive.position / SCALE

    def motors(self) -> list[float]:
        """Return where all motors are in [rad]."""
        return [self.motor(name) for name in JOINTS]

    def lose(self, *bases: int) -> None:
        """Lose the PDOs of the blind joint that have these identifiers."""
        lost = {base + 2 + JOINTS.index(BLIND) for base in bases}
        self.net.wire.loses = lambda sender, frame: frame.can_id in lost


TPDOS, RPDOS = (0x180, 0x280, 0x380), (0x200, 0x300, 0x400)


@pytest.mark.parametrize('tpdos', [TPDOS, (0x180,), (0x280,)], ids=['all', 'state', 'position'])
@FRESH
def test_the_arm_stops_on_its_path_when_a_drive_cannot_be_seen(
    mode: OperationMode, tpdos: Sequence[int]
) -> None:
    """Within the time-out it brakes, all joints in step; drive and cause are data."""
    arm = Arm(mode)
    before = arm.motors()
    arm.lose(*tpdos)
    arm.net.run(TIME_OUT + SPEED / BRAKING + 0.1)
    rest = arm.motors()
    assert set(arm.source.refusals) == {BLIND}
    assert arm.source.refusals[BLIND].cause is RefusalCause.SILENT
    way = [(end - begin) / ratio for begin, end, ratio in zip(before, rest, RATIO, strict=True)]
    assert max(way) - min(way) < 3e-3  # the blind joint has stopped on the path, too
    assert max(way) < SPEED * (TIME_OUT + 0.05) + SPEED**2 / 2 / BRAKING
    arm.net.run(3.0)
    assert arm.motors() == pytest.approx(rest, abs=1e-3)
    assert arm.source.losses[BLIND].cause is RefusalCause.SILENT
    with pytest.raises(DriveError, match='TPDO'):
        arm.net.commands[BLIND].set_target(0.0)


@FRESH
def test_a_fault_while_a_drive_cannot_be_seen_is_known_when_it_can(mode: OperationMode) -> None:
    """Nobody takes it for enabled meanwhile, and nothing moves when the TPDOs come again."""
    arm = Arm(mode)
    arm.lose(*TPDOS)
    arm.net.run(1.0)
    device = arm.net.devices[BLIND].drive
    assert device is not None
    device.raise_fault(0x2310, arm.net.now)
    arm.net.run(1.0)
    drive = arm.net.drives[BLIND]
    assert not drive.control.accepts_targets
    assert not drive.view.fresh
    assert drive.view.age > 1.5
    rest = arm.motors()
    arm.net.wire.loses = lambda sender, frame: False
    arm.net.run(1.0)
    assert drive.view.fresh
    assert drive.view.state is DriveState.FAULT
    assert arm.motors() == pytest.approx(rest, abs=2e-3)


@FRESH
def test_the_arm_stops_when_a_drive_does_not_get_its_set_points(mode: OperationMode) -> None:
    """A drive without RPDOs stands; when they arrive again, it does not jump after the path."""
    arm = Arm(mode)
    arm.lose(*RPDOS)
    arm.net.run(TIME_OUT + 2 * SPEED / BRAKING)
    assert arm.source.losses[BLIND].cause is RefusalCause.NOT_FOLLOWING
    rest = arm.motors()
    arm.net.run(1.0)
    assert arm.motors() == pytest.approx(rest, abs=1e-3)
    arm.net.wire.loses = lambda sender, frame: False
    arm.net.run(1.0)
    assert arm.motors() == pytest.approx(rest, abs=2e-3)
    arm.net.commands[BLIND].set_target(rest[1] + 0.1)
    arm.net.run(1.0)
    assert arm.motor(BLIND) == pytest.approx(rest[1] + 0.1, abs=2e-3)


@FRESH
def test_a_source_that_goes_on_moves_a_silent_drive_no_further(mode: OperationMode) -> None:
    """What is granted for stopping on the path ends after a second, whatever the source does."""
    arm = Arm(mode)

    class Careless(Path):
        def update(
            self, now: float, period: float, feedback: Sequence[AxisFeedback]
        ) -> Sequence[float | None]:
            self.losses.clear()
            return super().update(now, period, [replace(axis, refusal=None) for axis in feedback])

    arm.net.master.attach(careless := Careless())
    arm.net.run(0.5)
    arm.lose(*TPDOS)
    arm.net.run(TIME_OUT + 1.0 + 0.3)
    rest = arm.motor(BLIND)
    arm.net.run(2.0)
    assert arm.motor(BLIND) == pytest.approx(rest, abs=2 * PERIOD * 1e-2)
    assert careless.axes == JOINTS


@pytest.mark.parametrize('answers', [(), (0x580,)], ids=['SDO', 'no SDO'])
@pytest.mark.parametrize('stop', ['halt', 'disable', 'quick_stop'])
def test_a_stop_reaches_a_drive_that_cannot_be_seen(stop: str, answers: tuple[int, ...]) -> None:
    """It is sent at once; where SDOs do not show the rest either, the answer is an error."""
    arm = Arm(OperationMode.CYCLIC_POSITION)
    arm.lose(*TPDOS, *answers)
    arm.net.run(0.6)
    if answers:
        with pytest.raises(DriveError, match='no TPDOs for'):
            arm.net.do(BLIND, stop, preempt=True)
    else:
        arm.net.do(BLIND, stop, preempt=True)
        shown = arm.net.drives[BLIND].view.position
        assert shown == pytest.approx(arm.motor(BLIND), abs=2e-3)
    device = arm.net.devices[BLIND].drive
    assert device is not None
    assert device.velocity == 0.0
    assert (device.state is DriveState.OPERATION_ENABLED) is (stop == 'halt')


def test_a_drive_that_cannot_be_seen_is_not_enabled() -> None:
    """Neither is its old state taken for the present one."""
    arm = Arm(OperationMode.CYCLIC_POSITION)
    arm.net.do(BLIND, 'disable', preempt=True)
    arm.lose(*TPDOS)
    arm.net.run(1.0)
    with pytest.raises(DriveError, match='no TPDOs for'):
        arm.net.do(BLIND, 'enable')
    device = arm.net.devices[BLIND].drive
    assert device is not None
    assert device.state is not DriveState.OPERATION_ENABLED


def test_feedback_is_that_of_the_sync_it_is_stamped_with() -> None:
    """Position, velocity and effort of /joint_states come from the same TPDOs."""
    arm = Arm(OperationMode.CYCLIC_POSITION)
    net, reported, sent = arm.net, [], []

    def note(sync_time: float) -> None:
        reported.append(net.drives['joint1'].view.position)
        (data,) = net.frames(0x282, since=sync_time)
        sent.append(struct.unpack_from('<i', data)[0] / SCALE)

    net.network.on_feedback = note
    net.run(0.3)
    assert len(reported) == pytest.approx(30, abs=1)
    assert reported[-1] - reported[0] > 0.25  # it moves
    assert reported == pytest.approx(sent, abs=1e-9)
