# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A stream of targets never wins over a command, and comes back only as a new one.

It comes from a client, cycle by cycle, or from a motion source, with feed-forward.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
import math
import struct

from bus_rig import booted, JOINT, Leader, MODES, VirtualNetwork
from drive_samples import drive_config, every_mode, MOTION_WRITES, pdo, PERIOD, SCALE, sdo_write
import pytest

from arm_canopen import DriveError, DriveState, OperationMode, Promise, RefusalCause, Severity
from arm_canopen.config import RecoveryPolicy, SdoWrite
from canopen_core.standard import POSITION_MODES, TORQUE_MODES

pytestmark = pytest.mark.slow

NODE_ID = 2
STEP = 0.005  # [rad] of the stream in each cycle: 0.5 rad/s


class Publisher:
    """A client that sends a target in each cycle, whatever becomes of it."""

    def __init__(self, mode: OperationMode) -> None:
        """Enable a drive in a mode; it is enabled again after its device was lost."""
        scales = {'recovery': RecoveryPolicy.AUTO}
        self.net = booted(every_mode(drive_config(JOINT, NODE_ID, scales=scales)))
        self.net.enable(mode)
        self.commands = self.net.commands[JOINT]
        self.value = 0.0
        self.refusals: list[str] = []

    def publish(self, duration: float, until: Callable[[], bool] = lambda: False) -> None:
        """Send for a time in [s], or until something holds."""
        end = self.net.now + duration
        while self.net.now < end and not until():
            self.value += STEP
            try:
                self.commands.stream_target(self.value)
            except DriveError as error:
                self.refusals.append(str(error))
            self.net.run(PERIOD)

    def result(self, promise: Promise[str]) -> str:
        """Go on publishing until a command is done, and return its answer."""
        self.publish(15.0, lambda: promise.done)
        return promise.result()


@pytest.mark.parametrize('mode', [OperationMode.CYCLIC_POSITION, OperationMode.PROFILE_POSITION])
def test_a_new_stream_is_followed_after_an_explicit_command(mode: OperationMode) -> None:
    """Given while no targets come; one that is given while they come lets nothing in."""
    client = Publisher(mode)
    client.publish(0.5)
    client.result(client.net.begin(JOINT, 'halt', preempt=True))
    rest = client.net.motor()
    client.result(client.net.begin(JOINT, 'enable'))
    client.publish(0.5)
    client.net.run(1.0)
    client.publish(0.5)
    assert client.net.motor() == pytest.approx(rest, abs=0.03)
    client.net.run(0.25)
    client.net.do(JOINT, 'enable')
    client.refusals.clear()
    client.publish(1.0)
    assert client.refusals == []
    assert client.net.motor() == pytest.approx(client.value, abs=0.6)
    assert client.net.drives[JOINT].view.velocity > 0.3
    assert not client.net.drives[JOINT].halt.held


@pytest.mark.parametrize('pause', [0.0, 0.25, 0.7, 3.0])  # [s]; the stream ends after 0.2 s
def test_a_single_target_stays_where_a_stream_was_held_up(pause: float) -> None:
    """The stream had begun, so its pause may be a stall."""
    client = Publisher(OperationMode.CYCLIC_POSITION)
    client.publish(0.5)
    client.net.run(pause)
    client.commands.set_target(-0.2)
    client.net.run(pause)
    client.publish(2.0)
    assert client.net.motor() == pytest.approx(-0.2, abs=2e-3)
    assert 'ended by a single target' in client.refusals[-1]


@pytest.mark.parametrize('held_up', [False, True])
def test_a_drive_that_recovers_by_itself_waits_for_a_command(*, held_up: bool) -> None:
    """The publisher knows nothing of the power cut; nobody has enabled the drive for it."""
    client = Publisher(OperationMode.CYCLIC_POSITION)
    client.publish(0.5)
    client.net.power_off(JOINT)
    client.net.run(1.0)
    client.net.power_on(JOINT)
    view = client.net.drives[JOINT].view
    if not held_up:
        client.publish(3.0)
    client.net.run_until(lambda: view.state is DriveState.OPERATION_ENABLED)
    client.net.run(0.3)
    rest = client.net.motor()
    client.publish(2.0)
    assert client.net.motor() == pytest.approx(rest, abs=1e-3)
    assert 'ended by recovery' in client.refusals[-1]


def test_a_stream_is_followed_evenly_and_its_error_is_that_of_one_cycle() -> None:
    """The set-point moves as the client's path, and is compared where the drive had it."""
    client = Publisher(OperationMode.CYCLIC_POSITION)
    client.publish(1.0)
    drive, speeds, errors = client.net.drives[JOINT], [], []
    for _ in range(50):
        before = drive.setpoint
        client.publish(PERIOD)
        speeds.append((drive.setpoint - before) / PERIOD)
        errors.append(drive.status().following_error)
    assert speeds == pytest.approx([STEP / PERIOD] * 50, rel=0.02)
    assert all(STEP <= error < 1.5 * STEP for error in errors)  # and the lag of the servo


@pytest.mark.parametrize('name', ['halt', 'velocity mode'])
def test_no_target_is_taken_while_a_command_runs(name: str) -> None:
    """Neither a target nor a move: it would undo the command, or be dropped by it."""
    client = Publisher(OperationMode.PROFILE_POSITION)
    client.commands.set_target(3.0)
    client.net.run(0.5)
    if name == 'halt':
        running = client.net.begin(JOINT, 'halt', preempt=True)
    else:
        selecting = client.commands.select_mode(OperationMode.PROFILE_VELOCITY)
        running = client.commands.run('velocity_mode', selecting)
    client.net.run(0.02)
    assert not running.done
    with pytest.raises(DriveError, match=r'takes no target while .* is running'):
        client.commands.set_target(0.0)
    client.net.result(running)


@pytest.mark.parametrize('mode', MODES, ids=lambda mode: mode.name)
def test_nothing_is_called_stopped_that_moves(mode: OperationMode) -> None:
    """A pause of the stream is reported once, as what it is at that moment."""
    client = Publisher(mode)
    value = 3.0 if mode in POSITION_MODES else 100.0 if mode in TORQUE_MODES else 0.8
    for _ in range(60):
        client.commands.stream_target(value)
        client.net.run(PERIOD)
    drive = client.net.drives[JOINT]
    assert drive.view.velocity > 0.05
    while not (said := [text for text in client.net.reported() if 'has paused' in text]):
        client.net.run(PERIOD)
    moves = abs(drive.view.velocity) > 0.02
    assert ('stopped' in said[0]) is not moves
    assert moves is (mode is OperationMode.PROFILE_POSITION)
    client.net.run(5.0)
    assert (client.net.motor() == pytest.approx(3.0, abs=0.01)) is moves
    client.commands.set_target(0.0)
    client.net.run(5.0)
    assert [text for text in client.net.reported() if 'has paused' in text] == said


@pytest.mark.parametrize('mode', [OperationMode.CYCLIC_POSITION, OperationMode.PROFILE_POSITION])
def test_a_stream_may_begin_where_the_axis_stands(mode: OperationMode) -> None:
    """As a path does that begins at rest, after a single target; one value in five cycles."""
    client = Publisher(mode)
    client.commands.set_target(0.1)
    client.net.run(1.0)
    for number in range(40):
        client.commands.stream_target(0.1 + 0.02 * max(0, number - 3))
        client.net.run(5 * PERIOD)
    assert client.net.motor() > 0.5


def test_an_axis_that_does_not_stop_is_stopped_by_sdo() -> None:
    """Its RPDOs are lost, so it would go on at the last velocity that it received."""
    client = Publisher(OperationMode.PROFILE_VELOCITY)
    for _ in range(60):
        client.commands.stream_target(0.8)
        client.net.run(PERIOD)
    client.net.lose(0x202, 0x302)
    client.net.run(4.0)
    (error,) = client.net.reported(Severity.ERROR)
    assert 'although it was halted: quick stop' in error
    here = client.net.motor()
    client.net.run(1.0)
    assert client.net.motor() == here
    assert not [text for text in client.net.reported() if 'stopped' in text]


OFFSET_PDO = 0x500 + NODE_ID
SPEED = 0.4  # [rad/s]
CYCLIC, INTERPOLATED = OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION


def follow(
    source: Leader, *writes: SdoWrite, mapped: bool = True, mode: OperationMode = CYCLIC
) -> VirtualNetwork:
    """Return a network with a drive that follows a source for half a second."""
    config = drive_config(JOINT, NODE_ID, sdo_writes=(*MOTION_WRITES, *writes))
    if mapped:
        offsets = pdo(4, OFFSET_PDO, (0x60B1, 0), (0x60B2, 0))
        config = replace(config, rpdos=(*config.rpdos, offsets))
    net = booted(config)
    net.enable(mode)
    net.master.attach(source)
    net.run(0.5)
    return net


def announcing(velocity: float = SPEED, effort: float = 30.0) -> Leader:
    """Return a source that moves at a constant speed and announces it, and per mille of torque."""
    return Leader(speed=SPEED, feed_forward=(velocity, effort))


def offsets(net: VirtualNetwork) -> tuple[int, int]:
    """Return what was sent last: velocity and torque in device units."""
    velocity, torque = struct.unpack_from('<ih', net.frames(OFFSET_PDO)[-1])
    return velocity, torque


def test_feed_forward_goes_with_the_set_points() -> None:
    """In device units, each cycle, and in the drive."""
    net = follow(announcing())
    assert offsets(net) == (round(SPEED * SCALE), 30)
    assert net.drives[JOINT].view.velocity == pytest.approx(SPEED, rel=0.05)
    assert net.devices[JOINT].store.integer(0x60B1).value == round(SPEED * SCALE)


@pytest.mark.parametrize(
    ('mapped', 'mode'), [(True, CYCLIC), (False, CYCLIC), (False, INTERPOLATED)]
)
def test_a_stream_without_feed_forward_writes_none(*, mapped: bool, mode: OperationMode) -> None:
    """Without one, or without its objects in an RPDO: 0x60B2 stays as bus.yml has it."""
    source = announcing() if not mapped else announcing(0.0, 0.0)
    net = follow(source, sdo_write(0x60B2, 0, 17), mapped=mapped, mode=mode)
    assert net.drives[JOINT].view.velocity == pytest.approx(SPEED, rel=0.05)
    assert not source.losses
    assert net.devices[JOINT].store.integer(0x60B2).value == 17
    sent = [data for data in net.frames(0x600 + NODE_ID) if data[1:3] == b'\xb1\x60']
    assert not [data for data in sent if data[0] >> 5 == 1]  # a download; it is read once
    assert not mapped or offsets(net) == (0, 17)


@pytest.mark.parametrize(
    'end',
    ['pause', 'detach', 'target', 'halt', 'quick_stop', 'disable', 'velocity mode', 'power cut'],
)
def test_it_ends_with_the_stream(end: str) -> None:
    """Nothing of it is left over; in mode 9 the drive would add it to its target."""
    net = follow(source := announcing())
    begin = math.inf
    if end == 'pause':
        source.pauses = True
    elif end == 'detach':
        net.master.detach(source)
    elif end == 'target':
        net.target(0.0)
        net.run(PERIOD)
        assert source.losses[JOINT].cause is RefusalCause.SINGLE_TARGET
    elif end == 'velocity mode':
        net.select(JOINT, OperationMode.CYCLIC_VELOCITY)
        net.run(1.0)
        assert net.drives[JOINT].view.velocity == pytest.approx(0.0, abs=0.005)
    elif end == 'power cut':
        net.power_off(JOINT)
        net.run(1.0)
        begin = net.now
        net.power_on(JOINT)
        net.run_until(net.all_ready)
    else:
        net.begin(JOINT, end, preempt=True)
    net.run(2 * PERIOD)
    assert offsets(net) == (0, 0)
    assert {data[:6] for data in net.frames(OFFSET_PDO, since=begin)} <= {bytes(6)}


def test_a_source_attached_again_goes_on() -> None:
    """What it still has is not taken from it; another one takes its axis."""
    net = follow(source := announcing())
    begin = net.now
    net.master.attach(source)
    net.run(0.5)
    assert source.losses == {}
    targets = [target / SCALE for target in net.targets(JOINT, since=begin)]
    assert all(b - a == pytest.approx(SPEED * PERIOD, abs=2 / SCALE) for a, b in pairwise(targets))
    net.master.attach(announcing())
    net.run(0.1)
    assert source.losses[JOINT].cause is RefusalCause.OTHER_SOURCE


@pytest.mark.parametrize(
    ('velocity', 'effort'),
    [(math.nan, 0.0), (0.0, math.inf), (1e12, 0.0), (0.0, 40_000.0), (2.0, 0.0), (0.0, 5_000.0)],
)
def test_a_feed_forward_that_cannot_be_is_refused(velocity: float, effort: float) -> None:
    """Not finite, too large for its object or beyond 0x607F or 0x6072: the axis is released."""
    source = announcing(velocity, effort)
    net = follow(source)
    assert source.losses[JOINT].cause is RefusalCause.SETPOINT_REFUSED
    assert net.drives[JOINT].view.velocity == pytest.approx(0.0, abs=0.005)
    assert {data[:6] for data in net.frames(OFFSET_PDO)} == {bytes(6)}
