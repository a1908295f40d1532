# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Cyclic synchronous and interpolated position mode: a stream of set-points with SYNC."""

from __future__ import annotations

from itertools import pairwise
import math
import random

from device_rig import ENABLE, Rig
import pytest

from arm_canopen import DriveState
from canopen_core.standard import NmtCommand

REACHED, LIMIT, BIT12, HALT = 0x400, 0x800, 0x1000, 0x100
PERIOD = 0.01  # [s]
AMPLITUDE = 4000.0  # [inc]
OMEGA = 2.0 * math.pi * 0.2  # [rad/s]
MODES = {8: (0x607A, 0, ENABLE), 7: (0x60C1, 1, ENABLE | 0x10)}
"""Target object and controlword of the two modes."""


def streaming(mode: int, *, sync: bool = True, rpdo_type: int = 255) -> Rig:
    """Return a drive that is enabled in a mode and gets its targets by RPDO 3."""
    index, subindex, word = MODES[mode]
    rig = Rig()
    rig.put(0x1402, 0x80000000, 1)
    rig.put(0x1402, rpdo_type, 2)
    rig.put(0x1602, 0)
    rig.put(0x1602, index << 16 | subindex << 8 | 32, 1)
    rig.put(0x1602, 1)
    rig.put(0x1402, 0x400 + rig.node_id, 1)
    rig.put(0x6065, 0)
    rig.nmt(NmtCommand.START)
    if sync:
        rig.cycles(5, PERIOD)
    rig.enable(mode)
    rig.command(word)
    return rig


def target(rig: Rig, position: float) -> None:
    """Send a set-point."""
    rig.send(0x400 + rig.node_id, round(position).to_bytes(4, 'little', signed=True))


def stream(rig: Rig, steps: range, step: int = 10, period: float = PERIOD) -> list[float]:
    """Send a set-point and SYNC at each step; return the velocities at their ends."""
    velocities = []
    for number in steps:
        target(rig, step * number)
        rig.sync()
        rig.run(period)
        velocities.append(rig.velocity)
    return velocities


@pytest.mark.parametrize('mode', MODES)
@pytest.mark.parametrize('rpdo_type', [0, 1, 255])
def test_sine_is_followed(mode: int, rpdo_type: int) -> None:
    """A sine of set-points is followed with a small lag and without jumps in velocity."""
    rig = streaming(mode, rpdo_type=rpdo_type)
    velocities = []
    for step in range(600):
        wanted = AMPLITUDE * (1.0 - math.cos(OMEGA * step * PERIOD))
        target(rig, wanted)
        rig.sync()
        rig.run(PERIOD / 2)
        velocities.append(rig.velocity)
        rig.run(PERIOD / 2)
        if step > 5:
            # a set-point is reached when the next one is due, but for the lag of the servo
            assert rig.position == pytest.approx(wanted, abs=15.0)
    jumps = [abs(later - earlier) for earlier, later in pairwise(velocities[5:])]
    # set-points are whole increments: half a one, twice at both ends, is 200 inc/s in a period
    assert max(jumps) < AMPLITUDE * OMEGA**2 * PERIOD + 200.0


@pytest.mark.parametrize('mode', MODES)
def test_without_sync_a_set_point_acts_at_once(mode: int) -> None:
    """Without SYNC the way to a set-point takes the interpolation time period 0x60C2."""
    rig = streaming(mode, sync=False)
    rig.put(0x60C2, 100, 1)
    target(rig, 200)
    rig.run(0.05)
    assert rig.position == pytest.approx(100.0, abs=5.0)
    assert not rig.statusword & REACHED
    rig.run(0.1)
    assert rig.get(0x6064) == 200


def test_the_period_of_a_line() -> None:
    """0x60C2 counts, unless there is a set-point for each SYNC; 0x1006 is stronger than both."""
    rig = streaming(8)
    rig.put(0x60C2, 50, 1)
    speeds = []
    for step in range(40):
        if step % 5 == 0:
            target(rig, 10 * (step + 5))
        rig.sync()
        rig.run(PERIOD)
        speeds.append(rig.velocity)
    assert (min(speeds[6:]), max(speeds[6:])) == pytest.approx((1000.0, 1000.0), abs=100.0)
    stream(rig, range(45, 80))
    assert rig.position == pytest.approx(790.0, abs=5.0)
    rig = streaming(8)
    stream(rig, range(100), 50)  # 0x60F4: velocity times the lag of the servo
    assert rig.get(0x60F4) == pytest.approx(5000 * 0.002, abs=2)
    rig = streaming(8)
    rig.put(0x1006, 20_000)
    stream(rig, range(1, 20))
    # each line is half done when the next one takes its place: it runs one set-point behind
    assert rig.position == pytest.approx(180.0, abs=6.0)


def test_late_syncs_do_not_shake_the_axis() -> None:
    """SYNCs that jitter by a fifth of their period change the speed by about as much."""
    jitter = random.Random(1)
    rig = streaming(8)
    speeds, now = [], rig.now
    for step in range(1, 200):
        now += PERIOD
        rig.run(max(0.0, now + jitter.uniform(-0.001, 0.001) - rig.now))
        target(rig, 10 * step)
        rig.sync()
        speeds.append(rig.velocity)
    # a late SYNC finds the axis waiting at its set-point for a fifth of the period
    assert min(speeds[10:]) > 300.0
    assert max(speeds[10:]) < 1300.0
    assert rig.position == pytest.approx(1980.0, abs=15.0)


@pytest.mark.parametrize('pause', [0.0, 0.05, 0.5, 5.0])
def test_pause_of_sync_is_survived(pause: float) -> None:
    """After SYNCs in a burst or a pause, the set-points are followed as before."""
    rig = streaming(8)
    stream(rig, range(1, 51))
    rig.run(pause)
    for _ in range(5):  # five SYNCs that were late arrive in one instant
        target(rig, 500)
        rig.sync()
    stream(rig, range(51, 101))
    assert rig.position == pytest.approx(1000.0, abs=5.0)
    assert rig.velocity == pytest.approx(1000.0, abs=20.0)


def test_another_period_of_sync_is_noticed_and_its_loss() -> None:
    """A SYNC five times slower is followed; when it is gone, the axis stands at its target."""
    rig = streaming(8)
    rig.cycles(20)
    stream(rig, range(1, 20), 50, 5 * PERIOD)
    assert rig.velocity == pytest.approx(1000.0, abs=50.0)
    assert rig.position == pytest.approx(950.0, abs=10.0)
    rig.run(1.0)
    assert (rig.get(0x6064), rig.get(0x606C)) == (950, 0)


@pytest.mark.parametrize('mode', MODES)
def test_software_limits(mode: int) -> None:
    """A set-point beyond 0x607D leads to the limit and sets bit 11."""
    rig = streaming(mode)
    rig.put(0x607D, -50, 1)
    rig.put(0x607D, 100, 2)
    stream(rig, range(30))
    assert rig.get(0x6064) == 100
    assert rig.statusword & LIMIT
    assert mode != 8 or not rig.statusword & BIT12
    target(rig, 50)
    rig.sync()
    rig.run(1.0)
    assert rig.get(0x6064) == 50
    assert not rig.statusword & LIMIT


def test_interpolation_needs_its_bit() -> None:
    """In mode 7 set-points count only while bit 4 is set; taking it back stops the axis."""
    rig = streaming(7)
    rig.command(ENABLE)
    assert not rig.statusword & BIT12
    target(rig, 100)
    rig.cycles(20)
    assert rig.get(0x6064) == 0
    rig.command(ENABLE | 0x10)
    assert rig.statusword & BIT12
    stream(rig, range(50))
    rig.command(ENABLE)
    rig.run(0.5)
    assert rig.get(0x606C) == 0
    assert 480 <= rig.get(0x6064) < 600


def test_interpolation_buffer_keeps_its_order_and_clears() -> None:
    """Records wait in the buffer, each SYNC takes one; cleared, none is left."""
    rig = streaming(7)
    rig.put(0x60C4, 8, 2)
    for position in (10, 20, 30):
        rig.put(0x60C1, position, 1)
    reached = []
    for _ in range(5):
        rig.cycles(1)
        reached.append(round(rig.position))
    assert rig.position == pytest.approx(30, abs=0.5)
    assert reached == sorted(reached)
    rig.put(0x60C1, 500, 1)
    rig.put(0x60C4, 0, 6)
    rig.cycles(5)
    assert rig.position == pytest.approx(30, abs=0.5)


def test_jump_is_a_following_error() -> None:
    """A set-point that the motor cannot follow is a fault 0x8611; the motor does not teleport."""
    rig = streaming(8)
    rig.put(0x6065, 1000)
    rig.put(0x6066, 50)
    target(rig, 20_000)
    start, before = rig.now, rig.position
    rig.sync()
    while rig.drive.state is DriveState.OPERATION_ENABLED:
        rig.run(0.001)
        assert abs(rig.position - before) <= 10_000 * 0.001 + 1e-6
        before = rig.position
        assert rig.now - start < 0.2
    assert rig.statusword & LIMIT
    assert rig.now - start == pytest.approx(0.05, abs=0.02)
    assert rig.get(0x603F) == 0x8611
    assert rig.statusword & 0x2000
    rig.run(2.0)
    assert rig.drive.state is DriveState.FAULT
    assert rig.get(0x606C) == 0
    rig.command(0x80)
    assert not rig.statusword & 0x2000


@pytest.mark.parametrize(('window', 'jump'), [(1000, 1200), (0, 20_000), (0xFFFF_FFFF, 20_000)])
def test_jump_that_is_caught_up(window: int, jump: int) -> None:
    """In time, or without monitoring, the motor goes as fast as it can; bit 11 shows that."""
    rig = streaming(8)
    rig.put(0x6065, window)
    rig.put(0x6066, 50)
    target(rig, jump)
    rig.sync()
    rig.run(0.05)
    assert rig.get(0x606C) == 10_000
    assert rig.statusword & LIMIT
    rig.run(3.0)
    assert rig.state is DriveState.OPERATION_ENABLED
    assert rig.get(0x6064) == jump
    assert not rig.statusword & LIMIT
