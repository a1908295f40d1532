# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Mode selection, profile velocity and homing of the simulated drive."""

from __future__ import annotations

from device_rig import drive_dictionary, ENABLE, RefusedError, Rig, with_defaults
import pytest

from arm_canopen import OperationMode
from arm_canopen.standard import AbortCode, NmtCommand

REACHED = 0x400
LIMIT = 0x800
BIT12 = 0x1000
BIT13 = 0x2000
HALT = 0x100
SIMULATED = (1, 2, 3, 4, 6, 7, 8, 9, 10)


def test_supported_modes_are_those_simulated() -> None:
    """0x6502 names exactly the modes that 0x6060 takes, and mode 0."""
    rig = Rig()
    supported = rig.get(0x6502)
    for mode in OperationMode:
        if mode == 0 or supported & mode.support_bit:
            rig.put(0x6060, mode)
            assert rig.get(0x6061) == mode
        else:
            with pytest.raises(RefusedError) as refused:
                rig.put(0x6060, mode)
            assert refused.value.code == AbortCode.VALUE_RANGE
    assert {mode for mode in OperationMode if supported & mode.support_bit} == set(SIMULATED)


def test_mode_by_rpdo_that_is_not_simulated_is_ignored() -> None:
    """An RPDO cannot be refused: the display keeps the present mode."""
    rig = Rig()
    rig.put(0x6060, 8)
    rig.nmt(NmtCommand.START)
    rig.send(0x300 + rig.node_id, b'\x00\x00\x05')
    assert (rig.get(0x6060), rig.get(0x6061)) == (5, 8)


def test_dictionary_may_leave_modes_out() -> None:
    """A mode that 0x6502 of the dictionary does not name is refused, though it is simulated."""
    rig = Rig(with_defaults(drive_dictionary(), {(0x6502, 0): 0x80 | 0x10}))
    assert rig.get(0x6502) == 0x80
    rig.put(0x6060, 8)
    with pytest.raises(RefusedError):
        rig.put(0x6060, 1)


def test_mode_of_the_dictionary_is_selected_at_the_start() -> None:
    """A default of 0x6060 counts, also again after a reset."""
    rig = Rig(with_defaults(drive_dictionary(), {(0x6060, 0): 8}))
    assert rig.get(0x6061) == 8
    rig.put(0x6060, 1)
    rig.nmt(NmtCommand.RESET_NODE)
    assert rig.get(0x6061) == 8


def test_without_a_mode_the_axis_is_held() -> None:
    """Mode 0 enabled holds the position, whatever targets are written."""
    rig = Rig()
    rig.enable(0)
    rig.put(0x607A, 500)
    rig.put(0x60FF, 500)
    rig.command(0x1F)
    rig.run(1.0)
    assert (rig.get(0x6064), rig.get(0x606C)) == (0, 0)


@pytest.mark.parametrize(
    ('mode', 'target', 'actual', 'word'),
    [(3, 0x60FF, 0x606C, ENABLE), (9, 0x60FF, 0x606C, ENABLE), (2, 0x6042, 0x6044, ENABLE | 0x70)],
)
def test_velocities_in_another_unit(mode: int, target: int, actual: int, word: int) -> None:
    """A drive that counts rpm turns that much faster, and reports what it was given."""
    rig = Rig(rate_units=(50.0, 50.0))  # 3000 increments per turn: 50 inc/s are 1 rpm
    limits = ((0x607F, 60), (0x6080, 0), (0x6083, 40), (0x6084, 40))
    for index, value in limits:
        rig.put(index, value)
    rig.enable(mode)
    rig.command(word)
    for _ in range(300):
        rig.cycles(1)
        rig.put(target, 20)
    assert rig.velocity == pytest.approx(1000.0)
    assert rig.get(actual) == 20


def test_a_move_in_another_unit_takes_its_time() -> None:
    """By 0x6081 and its ramps: 3000 increments at 10 rpm of 50 inc/s are more than 6 s."""
    rig = Rig(rate_units=(50.0, 50.0))
    for index, value in ((0x607F, 60), (0x6081, 10), (0x6083, 1000), (0x6084, 1000)):
        rig.put(index, value)
    rig.enable(1)
    rig.put(0x607A, 3000)
    rig.command(0x1F)
    rig.run(3.0)
    assert rig.velocity == pytest.approx(500.0)
    assert 1400.0 < rig.position < 1500.0
    rig.run(4.0)
    assert rig.get(0x6064) == 3000


@pytest.mark.parametrize('before', SIMULATED)
@pytest.mark.parametrize('after', [0, *SIMULATED])
def test_nothing_moves_at_a_change_of_mode(before: int, after: int) -> None:
    """At rest, without a target velocity, no change of mode moves the axis.

    A position target that stands in the dictionary is none that was handed over.
    """
    rig = Rig()
    rig.put(0x607A, 800)
    rig.put(0x60C1, 700, 1)
    rig.enable(before)
    rig.run(0.2)
    rig.put(0x6060, after)
    rig.run(0.2)
    rig.cycles(20)
    assert rig.get(0x6064) == 0


def velocity_rig(target: int = 0) -> Rig:
    """Return a drive enabled in profile velocity mode."""
    rig = Rig()
    rig.put(0x60FF, target)
    rig.enable(3)
    return rig


def test_velocity_ramps() -> None:
    """The velocity rises by 0x6083, falls by 0x6084, and stays at its target."""
    rig = velocity_rig()
    rig.put(0x6083, 2000)
    rig.put(0x6084, 4000)
    rig.put(0x60FF, 1000)
    rig.run(0.25)
    assert rig.velocity == pytest.approx(500, abs=10)
    assert not rig.statusword & REACHED
    rig.run(1.0)
    assert rig.get(0x606C) == 1000
    assert rig.statusword & REACHED
    rig.put(0x60FF, -1000)
    rig.run(0.125)
    assert rig.velocity == pytest.approx(500, abs=10)
    rig.run(0.125 + 0.25)
    assert rig.velocity == pytest.approx(-500, abs=10)
    rig.run(1.0)
    assert rig.get(0x606C) == -1000


def test_zero_speed_bit() -> None:
    """Bit 12 says that the motor stands, after the time of 0x6070."""
    rig = velocity_rig()
    rig.put(0x6070, 200)
    rig.run(0.5)
    assert rig.statusword & BIT12
    rig.put(0x60FF, 500)
    rig.run(0.1)
    assert not rig.statusword & BIT12
    rig.put(0x60FF, 0)
    rig.run(0.15)
    assert not rig.statusword & BIT12
    rig.run(0.3)
    assert rig.statusword & BIT12


def test_velocity_is_limited() -> None:
    """0x607F caps the velocity, and the capped one counts as reached."""
    rig = velocity_rig()
    rig.put(0x607F, 400)
    rig.put(0x60FF, 1000)
    rig.run(1.0)
    assert rig.get(0x606C) == 400
    assert rig.statusword & REACHED


@pytest.mark.parametrize('direction', [1, -1])
def test_velocity_stops_at_the_software_limit(direction: int) -> None:
    """The axis brakes in time to stand at the limit, says so, and may leave it again."""
    rig = velocity_rig()
    rig.put(0x607D, -600, 1)
    rig.put(0x607D, 600, 2)
    rig.put(0x60FF, 1000 * direction)
    rig.run(0.4)
    assert rig.get(0x606C) == 1000 * direction
    assert not rig.statusword & LIMIT
    rig.run(2.0)
    assert rig.get(0x6064) == 600 * direction
    assert rig.statusword & (LIMIT | REACHED) == LIMIT
    rig.put(0x60FF, -200 * direction)
    rig.run(0.5)
    assert rig.get(0x606C) == -200 * direction
    assert not rig.statusword & LIMIT


def test_velocity_beyond_the_limit_does_not_turn_back() -> None:
    """An axis that is outside of its limits is not driven back by a velocity outwards."""
    rig = velocity_rig(1000)
    rig.run(1.0)
    rig.put(0x60FF, 0)
    rig.run(0.5)
    outside = rig.get(0x6064)
    rig.put(0x607D, -100, 1)
    rig.put(0x607D, 100, 2)
    rig.put(0x60FF, 500)
    rig.run(1.0)
    assert rig.get(0x6064) == outside
    rig.put(0x60FF, -500)
    rig.run(0.5)
    assert rig.get(0x6064) < outside


def test_halt_in_velocity_mode() -> None:
    """Halt ramps down to a stand; without it the velocity comes back."""
    rig = velocity_rig(800)
    rig.run(1.0)
    rig.command(ENABLE | HALT)
    rig.put(0x60FF, 900)
    rig.run(1.0)
    assert rig.get(0x606C) == 0
    assert rig.statusword & REACHED
    rig.command(ENABLE)
    rig.run(1.0)
    assert rig.get(0x606C) == 900


def test_enabling_while_halted_moves_nothing() -> None:
    """A velocity that waits behind halt begins when halt is over."""
    rig = Rig()
    rig.put(0x60FF, 500)
    rig.put(0x6060, 3)
    rig.command(0x06, 0x07, ENABLE | HALT)
    rig.run(1.0)
    assert rig.get(0x6064) == 0
    rig.command(ENABLE)
    rig.run(1.0)
    assert rig.get(0x606C) == 500


def homing_rig(method: int, *, offset: int = 0) -> Rig:
    """Return a drive at 300 inc that is enabled in homing mode."""
    rig = Rig()
    rig.enable(1)
    rig.put(0x607A, 300)
    rig.command(0x1F, ENABLE)
    rig.run(2.0)
    rig.put(0x6098, method)
    rig.put(0x607C, offset)
    rig.put(0x6060, 6)
    return rig


HOMING_STATES = REACHED | BIT12 | BIT13


@pytest.mark.parametrize('method', [35, 37])
@pytest.mark.parametrize('offset', [0, 250, -250])
def test_present_position_becomes_home(method: int, offset: int) -> None:
    """Methods 35 and 37 give the present position the value of the home offset."""
    rig = homing_rig(method, offset=offset)
    assert rig.statusword & HOMING_STATES == REACHED
    assert rig.get(0x6064) == 300
    rig.command(0x1F)
    assert rig.statusword & HOMING_STATES == REACHED | BIT12
    assert (rig.get(0x6064), rig.get(0x6062), rig.get(0x60F4)) == (offset, offset, 0)
    rig.run(1.0)
    assert (rig.get(0x6064), rig.get(0x606C)) == (offset, 0)


def test_moves_after_homing_count_from_home() -> None:
    """After homing, targets are positions in the new coordinates."""
    rig = homing_rig(35)
    rig.command(0x1F, ENABLE)
    rig.put(0x6060, 1)
    rig.put(0x607A, 100)
    rig.command(0x1F)
    rig.run(1.0)
    assert rig.get(0x6064) == 100


def test_method_zero_changes_nothing() -> None:
    """Method 0 needs no homing: attained, and the position stays."""
    rig = homing_rig(0)
    rig.command(0x1F)
    assert rig.statusword & HOMING_STATES == REACHED | BIT12
    assert rig.get(0x6064) == 300


@pytest.mark.parametrize('method', [15, 31, 36, -1])
def test_method_that_is_not_simulated(method: int) -> None:
    """An unknown method is a homing error, not a fault; selecting the mode again clears it."""
    rig = homing_rig(method)
    rig.command(0x1F)
    assert rig.statusword & HOMING_STATES == REACHED | BIT13
    assert rig.get(0x603F) == 0
    rig.command(ENABLE)
    rig.put(0x6060, 1)
    rig.put(0x6060, 6)
    assert not rig.statusword & BIT13


def test_homing_is_remembered_until_the_reset() -> None:
    """Home stays attained through other modes; after a reset of the node it is not."""
    rig = homing_rig(35)
    rig.command(0x1F, ENABLE)
    rig.put(0x6060, 8)
    rig.put(0x6060, 6)
    assert rig.statusword & BIT12
    rig.nmt(NmtCommand.RESET_NODE)
    rig.enable(6)
    assert not rig.statusword & BIT12
