# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes of operation of the simulated drive: what selects them, and profiles and velocities."""

from __future__ import annotations

from device_rig import ENABLE, moving, Rig, SHUTDOWN, SWITCH_ON
from drive_samples import drive_dictionary, with_defaults
import pytest

from arm_canopen import OperationMode
from canopen_core.standard import AbortCode, NmtCommand

pytestmark = pytest.mark.slow

REACHED, LIMIT, ACKNOWLEDGE, ZERO_SPEED, FOLLOWS = 0x400, 0x800, 0x1000, 0x1000, 0x1000
HALT, NEW, IMMEDIATE, RELATIVE, BLEND = 0x100, ENABLE | 0x10, 0x20, 0x40, 0x200
RAMP = ENABLE | 0x70
SIMULATED = (1, 2, 3, 4, 6, 7, 8, 9, 10)


def enabled(mode: int, *objects: tuple[int, int] | tuple[int, int, int]) -> Rig:
    """Return a drive enabled in a mode, some objects (index, value, sub-index) written before."""
    rig = Rig()
    for index, value, *subindex in objects:
        rig.put(index, value, *subindex)
    rig.enable(mode)
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


# --- selection ---


def test_supported_modes_are_those_simulated() -> None:
    """0x6502 names exactly the modes that 0x6060 takes, and mode 0."""
    rig = Rig()
    supported = rig.get(0x6502)
    assert {mode for mode in OperationMode if supported & mode.support_bit} == set(SIMULATED)
    for mode in OperationMode:
        taken = mode == 0 or mode in SIMULATED
        assert rig.refused(0x6060, mode) == (0 if taken else AbortCode.VALUE_RANGE)
        assert not taken or rig.get(0x6061) == mode


def test_the_dictionary_chooses_modes() -> None:
    """0x6502 may leave simulated modes out; a default of 0x6060 counts after each reset.

    An RPDO cannot be refused: the display keeps the present mode.
    """
    rig = Rig(with_defaults(drive_dictionary(), {(0x6502, 0): 0x80 | 0x10, (0x6060, 0): 8}))
    assert (rig.get(0x6502), rig.get(0x6061)) == (0x80, 8)
    assert rig.refused(0x6060, 1) == AbortCode.VALUE_RANGE
    rig.put(0x6060, 0)
    rig.nmt(NmtCommand.RESET_NODE)
    assert rig.get(0x6061) == 8
    rig.nmt(NmtCommand.START)
    rig.send(0x300 + rig.node_id, b'\x00\x00\x05')
    assert (rig.get(0x6060), rig.get(0x6061)) == (5, 8)


def test_nothing_moves_at_a_change_of_mode() -> None:
    """From each mode to each other: a target that stands in the dictionary is not handed over."""
    rig = enabled(0, (0x607A, 800), (0x60C1, 700, 1))
    rig.command(NEW)
    for before in SIMULATED:
        for after in (0, *SIMULATED):
            for mode in (before, after):
                rig.put(0x6060, mode)
                rig.run(0.05)
            rig.cycles(5)
            assert (rig.get(0x6064), rig.get(0x6061)) == (0, after), before


@pytest.mark.parametrize(
    ('mode', 'target', 'actual', 'word'),
    [(3, 0x60FF, 0x606C, ENABLE), (9, 0x60FF, 0x606C, ENABLE), (2, 0x6042, 0x6044, RAMP)],
)
def test_velocities_in_another_unit(mode: int, target: int, actual: int, word: int) -> None:
    """A drive that counts rpm turns that much faster, and reports what it was given."""
    rig = Rig(rate_units=(50.0, 50.0))  # 3000 increments per turn: 50 inc/s are 1 rpm
    for index, value in ((0x607F, 60), (0x6080, 0), (0x6083, 40), (0x6084, 40)):
        rig.put(index, value)
    rig.enable(mode)
    rig.command(word)
    for _ in range(300):
        rig.cycles(1)
        rig.put(target, 20)
    assert rig.velocity == pytest.approx(1000.0)
    assert rig.get(actual) == 20


# --- profile velocity (3), velocity (2), cyclic velocity (9) ---


def test_velocity_ramps_and_zero_speed() -> None:
    """The velocity rises by 0x6083, falls by 0x6084; bit 12 comes after the time of 0x6070."""
    rig = enabled(3, (0x6083, 2000), (0x6084, 4000), (0x6070, 200))
    rig.run(0.5)
    assert rig.statusword & ZERO_SPEED
    rig.put(0x60FF, 1000)
    rig.run(0.25)
    assert rig.velocity == pytest.approx(500, abs=10)
    assert not rig.statusword & (REACHED | ZERO_SPEED)
    rig.run(1.0)
    assert rig.get(0x606C) == 1000
    assert rig.statusword & REACHED
    rig.put(0x60FF, -1000)
    rig.run(0.125)
    assert rig.velocity == pytest.approx(500, abs=10)
    rig.run(0.125 + 0.25)
    assert rig.velocity == pytest.approx(-500, abs=10)
    rig.put(0x60FF, 0)
    rig.run(0.3)
    assert not rig.statusword & ZERO_SPEED
    rig.run(0.2)
    assert rig.statusword & ZERO_SPEED
    rig.put(0x607F, 400)
    rig.put(0x60FF, 1000)
    rig.run(1.0)
    assert rig.get(0x606C) == 400  # the limited one counts as reached
    assert rig.statusword & REACHED


@pytest.mark.parametrize('direction', [1, -1])
def test_velocity_stops_at_the_software_limit(direction: int) -> None:
    """It brakes in time to stand at the limit, and may leave it; from outside it goes inwards."""
    rig = enabled(3, (0x607D, -600, 1), (0x607D, 600, 2))
    rig.put(0x60FF, 1000 * direction)
    rig.run(0.4)
    assert rig.get(0x606C) == 1000 * direction
    assert not rig.statusword & LIMIT
    rig.run(2.0)
    assert rig.get(0x6064) == 600 * direction
    assert rig.statusword & (LIMIT | REACHED) == LIMIT
    rig.put(0x607D, -300, 1)
    rig.put(0x607D, 300, 2)
    rig.run(1.0)
    assert rig.get(0x6064) == 600 * direction  # it is not driven back
    rig.put(0x60FF, -200 * direction)
    rig.run(0.5)
    assert rig.get(0x606C) == -200 * direction
    rig.run(1.5)
    assert not rig.statusword & LIMIT


def test_velocity_mode_ramps_within_its_amounts() -> None:
    """0x6042 is held within 0x6046, and 0x6048 ramps to it."""
    rig = enabled(2, (0x6046, 200, 1), (0x6046, 900, 2), (0x6048, 500, 1))
    rig.command(RAMP)
    rig.put(0x6042, 2000)
    rig.run(1.0)
    assert rig.velocity == pytest.approx(500, abs=5)
    rig.run(2.0)
    assert rig.get(0x6044) == 900
    assert rig.statusword & (REACHED | LIMIT) == REACHED | LIMIT
    rig.put(0x6042, 50)
    rig.run(2.0)
    assert rig.velocity == pytest.approx(200, abs=1)


def test_velocity_mode_needs_its_ramp_bits() -> None:
    """Without bit 6 the ramp leads to zero, without bit 5 the velocity stays as it is."""
    rig = enabled(2)
    for word, target, velocity in (
        (ENABLE, 500, 0.0),
        (RAMP, 500, 500.0),
        (ENABLE | 0x50, 100, 500.0),
        (ENABLE | 0x30, 100, 0.0),
    ):
        rig.command(word)
        rig.put(0x6042, target)
        rig.run(1.0)
        assert rig.velocity == pytest.approx(velocity, abs=1.0), hex(word)


def test_cyclic_velocity_adds_its_offset_and_stops_at_a_limit() -> None:
    """CSV takes 0x60FF plus 0x60B1 with SYNC; the last velocity holds, but not beyond 0x607D."""
    rig = enabled(9, (0x60B1, 50))
    for velocity in range(0, 500, 10):
        rig.put(0x60FF, velocity)
        rig.cycles(1)
    rig.cycles(2)
    assert rig.velocity == pytest.approx(540, abs=10)
    assert rig.statusword & FOLLOWS
    rig = enabled(9, (0x607D, -1000, 1), (0x607D, 1000, 2))
    rig.put(0x60FF, 2000)
    rig.run(3.0)
    assert rig.position == pytest.approx(1000, abs=0.01)


# --- torque (4, 10) ---


def test_torques() -> None:
    """PT reaches 0x6071 by 0x6087; CST adds 0x60B2, and 0x6072 limits the sum."""
    rig = enabled(4, (0x6087, 1000))
    rig.put(0x6071, 400)
    rig.run(0.2)
    assert rig.get(0x6074) == pytest.approx(200, abs=10)
    assert not rig.statusword & REACHED
    rig.run(0.3)
    assert rig.get(0x6074) == 400
    assert rig.statusword & REACHED
    rig = enabled(10, (0x6072, 100), (0x60B2, 30))
    for target, torque, limited in ((50, 80, 0), (90, 100, LIMIT)):
        rig.put(0x6071, target)
        rig.run(0.1)
        assert rig.get(0x6077) == torque
        assert rig.statusword & LIMIT == limited


# --- profile position (1) ---


def test_a_rising_edge_of_bit_4_hands_over() -> None:
    """Nothing else does."""
    for words, arrives in (
        ((SHUTDOWN, SWITCH_ON, ENABLE), 0),  # a target alone
        ((SHUTDOWN, SWITCH_ON, ENABLE, NEW), 300),  # held afterwards: one set-point
        ((SHUTDOWN, SWITCH_ON, NEW), 300),  # enables and offers in one
        ((0x16, 0x17, NEW), 0),  # no edge: the bit was there before
    ):
        rig = Rig()
        rig.put(0x6060, 1)
        rig.put(0x607A, 300)
        rig.command(*words)
        rig.run(2.0)
        rig.put(0x607A, 900)
        rig.run(1.0)
        assert rig.get(0x6064) == arrives, words


def test_the_profile_is_that_of_the_hand_over() -> None:
    """The time of a move follows from distance, 0x6081, 0x6083 and 0x6084 as they were then."""
    rig = enabled(1, (0x6081, 2000), (0x6083, 5000), (0x6084, 10_000), (0x6068, 0))
    offer(rig, 3000)
    rig.put(0x6081, 100)
    ramps = 2000 / 5000 + 2000 / 10_000
    best = ramps + (3000 - 0.5 * 2000 * ramps) / 2000
    assert arrival(rig) == pytest.approx(best, abs=0.01)
    rig.put(0x607F, 50)
    offer(rig, 0)
    rig.run(1.0)
    assert rig.get(0x606C) == -50


def test_a_second_set_point_waits_and_begins_at_once() -> None:
    """The acknowledge bit says so until then; two moves take exactly the sum of their times."""
    rig = enabled(1, (0x6068, 0))
    offer(rig, 500)
    once = arrival(rig)
    start = rig.now
    offer(rig, 1000)
    rig.run(0.1)
    assert offer(rig, 500) & ACKNOWLEDGE
    highest = 0
    while rig.statusword & ACKNOWLEDGE:
        rig.run(0.005)
        highest = max(highest, rig.get(0x6064))
        assert not rig.statusword & REACHED
    assert highest >= 990
    arrival(rig)
    assert rig.now - start == pytest.approx(2 * once, abs=0.02)


def test_change_immediately_does_not_stop_unless_it_turns() -> None:
    """With bit 5 the move goes to the new target from where it is."""
    rig = enabled(1)
    offer(rig, 2000)
    rig.run(0.5)
    offer(rig, 1500, IMMEDIATE)
    for _ in range(40):
        rig.run(0.01)
        assert rig.get(0x606C) > 900
    offer(rig, 0, IMMEDIATE)
    arrival(rig)
    rig.run(0.1)
    assert rig.get(0x6064) == 0


@pytest.mark.parametrize('blend', [False, True])
def test_blended_set_points_pass_without_a_stop(blend: bool) -> None:
    """With bit 9 the axis goes through its target at speed, otherwise it stops there.

    There is no room for a third set-point meanwhile.
    """
    rig = enabled(1)
    bits = BLEND if blend else 0
    for target in (1000, 2000):
        offer(rig, target, bits)
    rig.run(0.5)
    assert rig.velocity == pytest.approx(1000)
    offer(rig, 0)
    slowest, start = 1e9, rig.now
    while rig.position < 1900:
        rig.run(0.005)
        assert rig.now - start < 20.0, 'the third one replaced another'
        if 500 < rig.position < 1500:
            slowest = min(slowest, rig.velocity)
    assert slowest > 990 if blend else slowest < 200
    rig.run(5.0)
    assert rig.position == pytest.approx(2000, abs=0.01)
    assert rig.statusword & REACHED


def test_target_reached_needs_its_time() -> None:
    """Bit 10 comes when the motor was in the window 0x6067 for the time 0x6068."""
    rig = enabled(1, (0x6068, 0))
    offer(rig, 500)
    early = arrival(rig)
    rig.put(0x6068, 300)
    offer(rig, 0)
    assert arrival(rig) == pytest.approx(early + 0.3, abs=0.01)
    rig.put(0x6081, 0)  # a move at no speed stands, and does not claim to have arrived
    offer(rig, 1000)
    rig.run(2.0)
    assert rig.get(0x6064) == 0
    assert not rig.statusword & REACHED


@pytest.mark.parametrize(('target', 'arrives'), [(5000, 800), (-5000, -300), (700, 700)])
def test_software_limits(target: int, arrives: int) -> None:
    """A target beyond 0x607D leads to the limit, and bit 11 says so."""
    rig = enabled(1, (0x607D, -300, 1), (0x607D, 800, 2))
    offer(rig, target)
    assert bool(rig.statusword & LIMIT) is (target != arrives)
    rig.run(3.0)
    assert rig.get(0x6064) == arrives
    assert rig.statusword & REACHED


@pytest.mark.parametrize('mode', [1, 3, 7, 8])
@pytest.mark.parametrize(('option', 'time'), [(1, 0.1), (2, 0.05)])
def test_halt(mode: int, option: int, time: float) -> None:
    """Halt ramps down as 0x605D selects and says when it stands; a move and a velocity go on.

    Set-points of a stream in it are ignored, one of a move waits, a velocity is the next one.
    """
    rig = moving(mode, {0x605D: option}, 1000)
    rig.command(NEW | HALT)
    assert not rig.statusword & (REACHED if mode == 1 else REACHED | FOLLOWS)
    start = rig.now
    while rig.velocity > 1.0:
        rig.run(0.001)
    assert rig.now - start == pytest.approx(time, abs=0.03)
    rig.run(0.5)
    stopped = rig.get(0x6064)
    assert rig.statusword & REACHED
    rig.command(ENABLE | HALT)
    rig.put(0x60FF, 900)
    rig.put(0x60C1, 5000, 1)
    rig.put(0x607A, 5000)
    rig.command(NEW | HALT)
    rig.cycles(50)
    assert (rig.get(0x6064), rig.get(0x606C)) == (stopped, 0)
    rig.command(NEW)
    rig.run(1.0)
    if mode == 3:
        assert rig.get(0x606C) == 900
        return
    if mode in {7, 8}:
        assert rig.get(0x6064) == stopped
        rig.put(0x60C1, 5000, 1)
        rig.put(0x607A, 5000)
    rig.run(8.0)
    assert rig.get(0x6064) == 5000


def test_a_halted_move_goes_on() -> None:
    """To its own target, where no other one was set in the halt: bit 8 only interrupts it."""
    rig = moving(1, speed=1000)
    rig.command(NEW | HALT)
    rig.run(1.0)
    assert rig.get(0x606C) == 0
    assert rig.get(0x6064) < 2000
    rig.command(NEW)
    rig.run(5.0)
    assert rig.get(0x6064) == 2500


def test_enabling_in_halt() -> None:
    """Nothing moves; then the velocity comes."""
    rig = Rig()
    rig.put(0x60FF, 800)
    rig.put(0x6060, 3)
    rig.command(SHUTDOWN, SWITCH_ON, ENABLE | HALT)
    rig.run(1.0)
    assert rig.get(0x6064) == 0
    rig.command(ENABLE)
    rig.run(1.0)
    assert rig.get(0x606C) == 800
