# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Profile position mode of the simulated drive: handshake, profiles, halt and limits."""

from __future__ import annotations

from device_rig import ENABLE, QUICK_STOP, Rig, SHUTDOWN, SWITCH_ON
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

pytestmark = pytest.mark.slow

NEW = ENABLE | 0x10
IMMEDIATE = 0x20
RELATIVE = 0x40
HALT = 0x100

ACKNOWLEDGE = 0x1000
REACHED = 0x400
LIMIT = 0x800


@pytest.fixture
def rig() -> Rig:
    """A drive enabled in profile position mode, at 0."""
    rig = Rig()
    rig.enable(1)
    return rig


def offer(rig: Rig, target: int, bits: int = 0) -> int:
    """Hand a set-point over, take the bit back; return the statusword in between."""
    rig.put(0x607A, target)
    rig.command(NEW | bits)
    word = rig.statusword
    rig.command(ENABLE | bits)
    return word


def arrival(rig: Rig, limit: float = 20.0) -> float:
    """Wait for "target reached"; return how long it took in [s]."""
    start = rig.now
    while not rig.statusword & REACHED:
        rig.run(0.001)
        assert rig.now - start < limit, 'not reached'
    return rig.now - start


def test_handshake(rig: Rig) -> None:
    """New set-point, acknowledge, bit taken back, acknowledge gone: one move."""
    rig.run(0.05)
    assert rig.statusword & (ACKNOWLEDGE | REACHED) == REACHED
    rig.put(0x607A, 500)
    assert rig.statusword & ACKNOWLEDGE == 0
    rig.command(NEW)
    assert rig.statusword & (ACKNOWLEDGE | REACHED) == ACKNOWLEDGE
    rig.run(0.05)
    assert rig.statusword & ACKNOWLEDGE
    rig.command(ENABLE)
    assert rig.statusword & (ACKNOWLEDGE | REACHED) == 0
    arrival(rig)
    assert rig.get(0x6064) == pytest.approx(500, abs=10)
    rig.run(0.1)
    assert (rig.get(0x6064), rig.get(0x606C)) == (500, 0)


def test_target_alone_moves_nothing(rig: Rig) -> None:
    """Without the edge of bit 4 a target is only a number."""
    rig.put(0x607A, 500)
    rig.run(1.0)
    assert rig.get(0x6064) == 0


def test_held_bit_is_one_set_point(rig: Rig) -> None:
    """While bit 4 stays set, another target is not taken."""
    rig.put(0x607A, 500)
    rig.command(NEW)
    rig.run(2.0)
    rig.put(0x607A, 900)
    rig.run(2.0)
    assert rig.get(0x6064) == 500


def test_bit_set_while_enabling_is_an_edge() -> None:
    """A word that enables and offers in one is both."""
    rig = Rig()
    rig.put(0x6060, 1)
    rig.put(0x607A, 300)
    rig.command(SHUTDOWN, SWITCH_ON, NEW)
    rig.run(2.0)
    assert rig.get(0x6064) == 300


def test_bit_set_before_enabling_is_none() -> None:
    """A bit that was there before operation was enabled is no set-point."""
    rig = Rig()
    rig.put(0x6060, 1)
    rig.put(0x607A, 300)
    rig.command(0x16, 0x17, NEW)
    rig.run(2.0)
    assert rig.get(0x6064) == 0


def test_profile(rig: Rig) -> None:
    """The time of a move follows from distance, 0x6081, 0x6083 and 0x6084."""
    rig.put(0x6081, 2000)
    rig.put(0x6083, 5000)
    rig.put(0x6084, 10_000)
    rig.put(0x6068, 0)
    offer(rig, 3000)
    ramps = 2000 / 5000 + 2000 / 10_000
    best = ramps + (3000 - 0.5 * 2000 * ramps) / 2000
    assert arrival(rig) == pytest.approx(best, abs=0.01)


def test_parameters_are_those_of_the_hand_over(rig: Rig) -> None:
    """A profile velocity that is written during a move counts from the next one on."""
    offer(rig, 2000)
    rig.run(0.5)
    rig.put(0x6081, 100)
    rig.run(0.5)
    assert rig.get(0x606C) == 1000


def test_second_set_point_is_kept(rig: Rig) -> None:
    """A set-point during a move waits for its end; the acknowledge bit says so until then."""
    offer(rig, 500)
    rig.run(0.1)
    assert offer(rig, 200) & ACKNOWLEDGE
    assert rig.statusword & ACKNOWLEDGE
    highest = 0
    while rig.statusword & ACKNOWLEDGE:
        rig.run(0.005)
        highest = max(highest, rig.get(0x6064))
        assert not rig.statusword & REACHED
    assert highest >= 490
    arrival(rig)
    assert rig.get(0x6064) == pytest.approx(200, abs=10)


def test_third_set_point_has_no_room(rig: Rig) -> None:
    """With one set-point waiting, a third one is not taken."""
    for target in (300, 600, 900):
        offer(rig, target)
    rig.run(5.0)
    assert rig.get(0x6064) == 600


def test_kept_set_point_begins_at_once(rig: Rig) -> None:
    """Two moves one after the other take exactly the sum of their times."""
    rig.put(0x6068, 0)
    single = Rig()
    single.enable(1)
    single.put(0x6068, 0)
    offer(single, 500)
    once = arrival(single)
    offer(rig, 500)
    offer(rig, 1000)
    assert arrival(rig) == pytest.approx(2 * once, abs=0.02)


def test_change_immediately(rig: Rig) -> None:
    """With bit 5 the move goes to the new target from where it is, without a stop."""
    offer(rig, 2000)
    rig.run(0.5)
    offer(rig, 1500, IMMEDIATE)
    speeds = []
    for _ in range(40):
        rig.run(0.01)
        speeds.append(rig.get(0x606C))
    assert min(speeds) > 900
    arrival(rig)
    assert rig.get(0x6064) == pytest.approx(1500, abs=10)


def test_change_immediately_back(rig: Rig) -> None:
    """A target behind the axis is reached by braking and returning."""
    offer(rig, 2000)
    rig.run(0.5)
    offer(rig, 0, IMMEDIATE)
    arrival(rig)
    rig.run(0.1)
    assert rig.get(0x6064) == 0


def test_change_immediately_discards_what_waits(rig: Rig) -> None:
    """A set-point that waited is gone when another one takes effect at once."""
    offer(rig, 500)
    offer(rig, 900)
    offer(rig, 100, IMMEDIATE)
    rig.run(5.0)
    assert rig.get(0x6064) == 100


def test_relative(rig: Rig) -> None:
    """Bit 6 counts from the preceding target, also from one that still waits."""
    offer(rig, 300)
    rig.run(2.0)
    offer(rig, 200, RELATIVE)
    offer(rig, -50, RELATIVE)
    rig.run(3.0)
    assert rig.get(0x6064) == 450


def test_target_reached_needs_its_time(rig: Rig) -> None:
    """Bit 10 comes when the motor was in the window 0x6067 for the time 0x6068."""
    rig.put(0x6068, 0)
    offer(rig, 500)
    early = arrival(rig)
    rig.put(0x6068, 300)
    offer(rig, 0)
    assert arrival(rig) == pytest.approx(early + 0.3, abs=0.01)


def test_target_at_the_present_position(rig: Rig) -> None:
    """A set-point where the drive stands is acknowledged and reached."""
    assert offer(rig, 0) & ACKNOWLEDGE
    arrival(rig)
    assert rig.get(0x6064) == 0


def test_velocity_is_limited(rig: Rig) -> None:
    """0x607F caps the profile velocity."""
    rig.put(0x607F, 300)
    rig.put(0x6081, 1000)
    offer(rig, 1000)
    rig.run(1.0)
    assert rig.get(0x606C) == 300
    rig.run(5.0)
    assert rig.get(0x6064) == 1000


def test_profile_velocity_zero_leads_nowhere(rig: Rig) -> None:
    """A move at no speed stands, and does not claim to have arrived."""
    rig.put(0x6081, 0)
    offer(rig, 1000)
    rig.run(2.0)
    assert rig.get(0x6064) == 0
    assert not rig.statusword & REACHED


@pytest.mark.parametrize(('target', 'arrives'), [(5000, 800), (-5000, -300), (700, 700)])
def test_software_limits(rig: Rig, target: int, arrives: int) -> None:
    """A target beyond 0x607D leads to the limit, and bit 11 says so."""
    rig.put(0x607D, -300, 1)
    rig.put(0x607D, 800, 2)
    offer(rig, target)
    assert bool(rig.statusword & LIMIT) is (target != arrives)
    rig.run(3.0)
    assert rig.get(0x6064) == arrives
    assert rig.statusword & REACHED


def test_halt_and_resume(rig: Rig) -> None:
    """Halt ramps down and says when it stands; without it the move goes on."""
    offer(rig, 1000)
    rig.run(0.5)
    rig.command(ENABLE | HALT)
    assert not rig.statusword & REACHED
    rig.run(0.05)
    assert 0 < rig.get(0x606C) < 1000
    rig.run(0.5)
    assert rig.get(0x606C) == 0
    stopped = rig.get(0x6064)
    assert 400 < stopped < 600
    assert rig.statusword & REACHED
    rig.run(1.0)
    assert rig.get(0x6064) == stopped
    rig.command(ENABLE)
    assert not rig.statusword & REACHED
    rig.run(2.0)
    assert rig.get(0x6064) == 1000


@pytest.mark.parametrize(('option', 'time'), [(1, 0.1), (2, 0.05)])
def test_halt_option(rig: Rig, option: int, time: float) -> None:
    """0x605D chooses the ramp of a halt."""
    rig.put(0x605D, option)
    offer(rig, 5000)
    rig.run(1.0)
    rig.command(ENABLE | HALT)
    start = rig.now
    while rig.velocity > 1.0:
        rig.run(0.001)
    assert rig.now - start == pytest.approx(time, abs=0.03)


def test_set_point_during_halt_waits(rig: Rig) -> None:
    """A set-point that is offered while halted moves nothing until halt is over."""
    rig.command(ENABLE | HALT)
    rig.put(0x607A, 400)
    rig.command(NEW | HALT)
    assert rig.statusword & ACKNOWLEDGE
    rig.run(1.0)
    assert rig.get(0x6064) == 0
    rig.command(ENABLE)
    rig.run(2.0)
    assert rig.get(0x6064) == 400


def test_quick_stop_drops_the_set_points(rig: Rig) -> None:
    """After a quick stop nothing goes on by itself."""
    rig.put(0x605A, 6)
    offer(rig, 1000)
    offer(rig, 2000)
    rig.run(0.5)
    rig.command(QUICK_STOP)
    rig.run(0.5)
    stopped = rig.get(0x6064)
    rig.command(ENABLE)
    assert not rig.statusword & ACKNOWLEDGE
    rig.run(3.0)
    assert rig.get(0x6064) == stopped


def test_selecting_the_mode_in_motion_stops(rig: Rig) -> None:
    """Coming from a velocity, the mode ramps down and waits for a set-point."""
    rig.put(0x60FF, 500)
    rig.put(0x6060, 3)
    rig.run(1.0)
    assert rig.get(0x606C) == 500
    rig.put(0x6060, 1)
    rig.run(1.0)
    assert rig.get(0x606C) == 0
    assert rig.statusword & REACHED


@settings(max_examples=40)
@given(
    targets=st.lists(st.integers(-3000, 3000), min_size=1, max_size=4),
    pauses=st.lists(st.floats(0.0, 1.5), min_size=4, max_size=4),
    velocity=st.integers(500, 5000),
    acceleration=st.integers(500, 50_000),
    deceleration=st.integers(500, 50_000),
)
def test_moves_keep_their_limits_and_arrive(
    targets: list[int], pauses: list[float], velocity: int, acceleration: int, deceleration: int
) -> None:
    """Whatever targets come when: speed and accelerations are kept, and the last is reached."""
    rig = Rig()
    rig.put(0x6065, 0)
    rig.put(0x6081, velocity)
    rig.put(0x6083, acceleration)
    rig.put(0x6084, deceleration)
    rig.enable(1)
    step, fastest = 0.01, max(acceleration, deceleration)
    last = 0.0
    for target, pause in zip(targets, pauses, strict=False):
        offer(rig, target, IMMEDIATE)
        for _ in range(round(pause / step)):
            rig.run(step)
            now = rig.velocity
            assert abs(now) <= velocity + 1.0
            assert abs(now - last) <= fastest * step + 1.0
            last = now
    arrival(rig, limit=400.0)
    rig.run(0.2)
    assert rig.get(0x6064) == targets[-1]
