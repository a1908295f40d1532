# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Velocity, cyclic velocity and torque, buffered and blended positions of the simulated drive."""

from __future__ import annotations

from device_rig import ENABLE, Rig
import pytest

REACHED, LIMIT, BIT12 = 0x400, 0x800, 0x1000
RAMP_BITS = 0x70


def test_velocity_mode_ramps_within_its_amounts() -> None:
    """0x6042 is held within 0x6046, and 0x6048 ramps to it."""
    rig = Rig()
    rig.put(0x6046, 200, 1)
    rig.put(0x6046, 900, 2)
    rig.put(0x6048, 500, 1)
    rig.enable(2)
    rig.command(ENABLE | RAMP_BITS)
    rig.put(0x6042, 2000)
    rig.run(1.0)
    assert rig.velocity == pytest.approx(500, abs=5)
    rig.run(2.0)
    assert rig.velocity == pytest.approx(900, abs=1)
    assert rig.get(0x6044) == 900
    assert rig.statusword & (REACHED | LIMIT) == REACHED | LIMIT
    rig.put(0x6042, 50)
    rig.run(2.0)
    assert rig.velocity == pytest.approx(200, abs=1)


def test_velocity_mode_needs_its_ramp_bits() -> None:
    """Without bit 6 the ramp leads to zero, without bit 5 the velocity stays as it is."""
    rig = Rig()
    rig.enable(2)
    rig.put(0x6042, 500)
    rig.run(1.0)
    assert rig.velocity == pytest.approx(0.0, abs=0.1)
    rig.command(ENABLE | RAMP_BITS)
    rig.run(1.0)
    rig.command(ENABLE | 0x50)
    rig.put(0x6042, 100)
    rig.run(1.0)
    assert rig.velocity == pytest.approx(500, abs=1)
    rig.command(ENABLE | 0x30)
    rig.run(1.0)
    assert rig.velocity == pytest.approx(0.0, abs=0.1)


def test_cyclic_velocity_follows_with_its_offset() -> None:
    """CSV takes 0x60FF plus 0x60B1 with SYNC, and bit 12 says that it follows."""
    rig = Rig()
    rig.enable(9)
    rig.put(0x60B1, 50)
    for velocity in range(0, 500, 10):
        rig.put(0x60FF, velocity)
        rig.cycles(1)
    rig.cycles(2)
    assert rig.velocity == pytest.approx(540, abs=10)
    assert rig.statusword & BIT12


def test_cyclic_velocity_stops_at_a_software_limit() -> None:
    """The last velocity holds, but not beyond 0x607D."""
    rig = Rig()
    rig.put(0x607D, -1000, 1)
    rig.put(0x607D, 1000, 2)
    rig.enable(9)
    rig.put(0x60FF, 2000)
    rig.run(3.0)
    assert rig.position == pytest.approx(1000, abs=0.01)


def test_cyclic_torque_adds_its_offset_and_keeps_its_limit() -> None:
    """CST applies 0x6071 plus 0x60B2, not more than 0x6072."""
    rig = Rig()
    rig.put(0x6072, 100)
    rig.enable(10)
    rig.put(0x60B2, 30)
    rig.put(0x6071, 50)
    rig.run(0.1)
    assert rig.get(0x6077) == 80
    rig.put(0x6071, 90)
    rig.run(0.1)
    assert rig.get(0x6077) == 100
    assert rig.statusword & LIMIT


def test_profile_torque_ramps_by_its_slope() -> None:
    """PT reaches 0x6071 by 0x6087 and says so."""
    rig = Rig()
    rig.put(0x6087, 1000)
    rig.enable(4)
    rig.put(0x6071, 400)
    rig.run(0.2)
    assert rig.get(0x6074) == pytest.approx(200, abs=10)
    assert not rig.statusword & REACHED
    rig.run(0.3)
    assert rig.get(0x6074) == 400
    assert rig.statusword & REACHED


def test_interpolation_buffer_keeps_its_order_and_clears() -> None:
    """Records wait in the buffer, each SYNC takes one; cleared, none is left."""
    rig = Rig()
    rig.put(0x60C4, 8, 2)
    rig.enable(7)
    rig.cycles(3)
    rig.command(ENABLE | 0x10)
    for position in (10, 20, 30):
        rig.put(0x60C1, position, 1)
    reached = []
    for _ in range(5):
        rig.cycles(1)
        reached.append(round(rig.drive.position))
    assert rig.position == pytest.approx(30, abs=0.5)
    assert reached == sorted(reached)
    rig.put(0x60C1, 500, 1)
    rig.put(0x60C4, 0, 6)
    rig.cycles(5)
    assert rig.position == pytest.approx(30, abs=0.5)


@pytest.mark.parametrize('blend', [False, True])
def test_blended_set_points_pass_without_a_stop(blend: bool) -> None:
    """With bit 9 the axis goes through its target at speed, otherwise it stops there."""
    rig = Rig()
    rig.enable(1)
    bits = 0x200 if blend else 0
    for target in (1000, 2000):
        rig.put(0x607A, target)
        rig.command(ENABLE | 0x10 | bits, ENABLE | bits)
    slowest = 1e9
    while rig.position < 1900:
        rig.run(0.005)
        if 500 < rig.position < 1500:
            slowest = min(slowest, rig.velocity)
    assert slowest > 990 if blend else slowest < 200
    rig.run(1.0)
    assert rig.position == pytest.approx(2000, abs=0.01)
    assert rig.statusword & REACHED
