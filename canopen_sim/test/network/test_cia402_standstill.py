# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Standstill is seen, not believed: without 0x606C, with a fast profile, with noise."""

from __future__ import annotations

from dataclasses import replace
import math
import struct

from bus_rig import VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    drive_dictionary,
    MOTION_WRITES,
    pdo,
    PERIOD,
    SCALE,
    sdo_write,
)
from hypothesis import given, strategies
import pytest

from arm_canopen import OperationMode
from arm_canopen.can import Frame
from arm_canopen.cia402.drive_view import VelocityEstimate, WINDOW
from arm_canopen.config import NodeConfig
from arm_canopen.standard import Controlword, ObjectDictionary

JOINT = 'joint1'
NODE_ID = 2
STANDING = 0.02  # [rad/s]


def without_velocity() -> NodeConfig:
    """Return a drive whose 0x606C is neither in a PDO nor in its EDS."""
    config = drive_config(JOINT, NODE_ID)
    entries = (entry for entry in config.dictionary if entry.index != 0x606C)
    position = pdo(2, 0x280 + NODE_ID, (0x6064, 0))
    return replace(config, dictionary=ObjectDictionary(entries), tpdos=(config.tpdos[0], position))


def with_profile_velocity(velocity_inc: int) -> NodeConfig:
    """Return a drive with another 0x6081 in [inc/s]."""
    writes = tuple(write for write in MOTION_WRITES if write.index != 0x6081)
    profile = sdo_write(0x6081, 0, velocity_inc)
    return drive_config(JOINT, NODE_ID, sdo_writes=(*writes, profile))


def running(config: NodeConfig, mode: OperationMode, target: float) -> VirtualNetwork:
    """Return a network with one drive that moves."""
    dictionaries = {JOINT: drive_dictionary().for_node(NODE_ID)}
    net = VirtualNetwork(bus_config(config), dictionaries=dictionaries)
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, mode)
    net.commands[JOINT].set_target(target)
    net.run(0.8)
    assert abs(speed(net)) > 0.3
    return net


def speed(net: VirtualNetwork) -> float:
    """Return how fast the motor really is in [rad/s]."""
    drive = net.devices[JOINT].drive
    assert drive is not None
    return abs(drive.velocity) / SCALE


@pytest.mark.parametrize(
    ('config', 'mode', 'target'),
    [
        (without_velocity(), OperationMode.PROFILE_POSITION, 3.0),
        (without_velocity(), OperationMode.PROFILE_VELOCITY, 0.8),
        (with_profile_velocity(500_000), OperationMode.PROFILE_VELOCITY, 0.45),
    ],
    ids=['no 0x606C, PP', 'no 0x606C, PV', 'fast profile'],
)
def test_halt_and_switch_wait_for_the_standstill(
    config: NodeConfig, mode: OperationMode, target: float
) -> None:
    """The answer comes when the motor rests, and bit 8 has braked it."""
    net = running(config, mode, target)
    net.do(JOINT, 'halt', preempt=True)
    assert speed(net) <= STANDING
    net.run(0.5)
    net.commands[JOINT].set_target(-target)
    net.run(0.8)
    begin = net.now
    commands = net.commands[JOINT]
    other = (
        OperationMode.PROFILE_POSITION
        if mode is OperationMode.PROFILE_VELOCITY
        else OperationMode.PROFILE_VELOCITY
    )
    promise = commands.run('select', commands.select_mode(other))
    fastest = 0.0
    while not promise.done:
        net.run(PERIOD / 2)
        if net.drives[JOINT].objects.mode_display == other:
            fastest = max(fastest, speed(net))
    assert fastest <= STANDING
    promise.result()
    assert any(word & Controlword.HALT for word in net.controlwords(JOINT, since=begin))


def test_the_velocity_is_that_of_the_position_where_no_pdo_carries_it() -> None:
    """Shown to motion sources and in /joint_states, a few cycles late."""
    net = running(without_velocity(), OperationMode.PROFILE_VELOCITY, 0.5)
    assert net.drives[JOINT].view.velocity == pytest.approx(0.5, rel=0.02)


METRE = 1_000_000.0  # [inc/m]
METRES = {
    f'scale_{what}_{way}_dev': METRE if way == 'to' else 1 / METRE
    for what in ('pos', 'vel')
    for way in ('to', 'from')
}


def sliding(*writes: tuple[int, int, int]) -> VirtualNetwork:
    """Return an enabled network with one drive that counts micrometres, and holds these values."""
    config = drive_config(
        JOINT,
        NODE_ID,
        scales=METRES,
        sdo_writes=tuple(sdo_write(*write) for write in ((0x60C2, 1, 10), *writes)),
    )
    net = VirtualNetwork(bus_config(config))
    net.boot()
    net.do(JOINT, 'init')
    return net


def test_rest_is_by_the_limits_of_the_axis() -> None:
    """A joint in metres with 2 m/s is not at rest at 20 mm/s."""
    ramps = ((index, 0, 2_000_000) for index in (0x6083, 0x6084, 0x6085))
    net = sliding((0x607F, 0, 4_000_000), (0x6081, 0, 2_000_000), *ramps)
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    net.commands[JOINT].set_target(0.018)
    net.run(1.0)
    drive = net.devices[JOINT].drive
    assert drive is not None
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
    net.commands[JOINT].set_target(0.03)
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
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    net.commands[JOINT].set_target(2.0 * rpm)
    net.run(1.0)
    assert speed(net) == pytest.approx(2.0 * rpm, rel=0.02)
    assert not net.drives[JOINT].view.stands
    net.do(JOINT, 'halt')
    assert speed(net) <= STANDING


def test_noise_is_standstill() -> None:
    """A slow profile and an encoder that flickers: a halt ends, and the mode can be switched."""
    net = VirtualNetwork(bus_config(with_profile_velocity(500)))
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    noise = [10]

    def alters(sender: str, frame: Frame) -> Frame:
        if frame.can_id != 0x280 + NODE_ID:
            return frame
        noise[0] = -noise[0]
        position, velocity = struct.unpack('<ii', frame.data)
        return frame._replace(data=struct.pack('<ii', position, velocity + noise[0]))

    net.wire.alters = alters
    net.do(JOINT, 'halt', preempt=True)
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)


@given(
    rate=strategies.floats(min_value=-1e6, max_value=1e6),
    start=strategies.integers(min_value=-(2**30), max_value=2**30),
    period=strategies.floats(min_value=1e-3, max_value=0.05),
)
def test_the_estimate_is_the_rate(rate: float, start: int, period: float) -> None:
    """Whatever the cycle and the resolution, within what one increment makes in the window."""
    estimate = VelocityEstimate()
    for n in range(200):
        estimate.note(n * period, round(start + rate * n * period))
    assert estimate.rate == pytest.approx(rate, abs=2.0 / WINDOW, rel=1e-6)
    estimate.clear()
    assert estimate.rate == 0.0
