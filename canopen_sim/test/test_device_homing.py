# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Every homing method of the simulated drive, with its switches and its errors."""

from __future__ import annotations

from device_rig import ENABLE, Rig
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from canopen_core.standard import NmtCommand
from canopen_sim.drive.axis import Switches

pytestmark = pytest.mark.slow

REACHED, ATTAINED, ERROR = 0x400, 0x1000, 0x2000
START, HALT = 0x10, 0x100

SWITCHES = Switches(
    negative_limit=-1000.0,
    positive_limit=1500.0,
    home=(500.0, 700.0),
    index=130.0,
    index_period=1000.0,
)
HOMES = {
    1: -870, 2: 1130, 3: 130, 4: 1130, 5: 1130, 6: 130, 7: 130, 8: 1130, 9: 130, 10: 1130,
    11: 1130, 12: 130, 13: 1130, 14: 130,
    17: -1000, 18: 1500, 19: 500, 20: 500, 21: 700, 22: 700, 23: 500, 24: 500, 25: 700, 26: 700,
    27: 700, 28: 700, 29: 500, 30: 500,
}  # fmt: skip
"""Mechanical position of home by method: an edge, or the index pulse behind it (0x6098)."""


def homing_rig(method: int, start: int = 0) -> Rig:
    """Return a drive in homing mode, its axis at a mechanical position in [inc]."""
    rig = Rig()
    rig.drive.set_switches(SWITCHES)
    rig.put(0x607A, start)
    rig.put(0x6081, 10_000)
    rig.enable(1)
    rig.command(ENABLE | 0x10, ENABLE)
    rig.run(3.0)
    rig.put(0x6098, method)
    rig.put(0x6099, 1000, 1)
    rig.put(0x6099, 200, 2)
    rig.put(0x609A, 20_000)
    rig.put(0x6060, 6)
    return rig


@pytest.mark.parametrize('method', HOMES)
def test_method_finds_its_home(method: int) -> None:
    """From either side of the home switch and from on it, each method finds the same place.

    Also where a search is so fast that it cannot stop on the switch.
    """
    for start, speed in ((-900, 1000), (0, 1000), (600, 1000), (900, 1000), (100, 6000)):
        rig = homing_rig(method, start)
        rig.put(0x607C, 40)
        rig.put(0x6099, speed, 1)
        rig.put(0x609A, 30_000 if speed > 1000 else 20_000)
        rig.command(ENABLE | START)
        rig.run(0.01)
        assert not rig.statusword & (ATTAINED | ERROR)
        rig.run(20.0)
        ended = rig.statusword & (REACHED | ATTAINED | ERROR)
        assert ended == REACHED | ATTAINED, (start, speed)
        assert rig.drive.origin == pytest.approx(40 - HOMES[method]), (start, speed)


@pytest.mark.parametrize(
    ('method', 'start', 'home'),
    [(33, 400, 130), (34, 400, 1130), (33, -1100, None), (34, 1600, None)],
)
def test_index_methods_take_the_next_pulse(method: int, start: int, home: int | None) -> None:
    """Without any switch; beyond an active limit switch the search ends at once."""
    rig = homing_rig(method, start)
    rig.command(ENABLE | START)
    rig.run(1.0 if home is None else 20.0)
    if home is None:
        assert rig.statusword & (REACHED | ATTAINED | ERROR) == REACHED | ERROR
        assert rig.position == pytest.approx(start, abs=5.0)
    else:
        assert rig.statusword & ATTAINED
        assert rig.drive.origin == pytest.approx(-home)


@pytest.mark.parametrize(
    ('method', 'speed'),
    [(15, 1000), (31, 1000), (36, 1000), (127, 1000), (-1, 1000), (-128, 1000), (17, 0)],
)
def test_method_that_is_not_there_is_an_error(method: int, speed: int) -> None:
    """Nor one without speed; no fault, and nothing moves; selecting the mode again clears it."""
    rig = homing_rig(method)
    rig.put(0x6099, speed, 1)
    rig.command(ENABLE | START)
    rig.run(0.5)
    assert rig.statusword & (REACHED | ATTAINED | ERROR) == REACHED | ERROR
    assert (rig.position, rig.get(0x603F)) == (0.0, 0)
    rig.command(ENABLE)
    rig.put(0x6060, 1)
    rig.put(0x6060, 6)
    assert not rig.statusword & ERROR


@pytest.mark.parametrize(
    ('method', 'offset', 'position'), [(35, 0, 0), (35, -250, -250), (37, 250, 250), (0, 9, 300)]
)
def test_present_position_becomes_home(method: int, offset: int, position: int) -> None:
    """It gets the value of the home offset; method 0 changes nothing. Targets count from home."""
    rig = homing_rig(method, 300)
    rig.put(0x607C, offset)
    assert rig.statusword & (REACHED | ATTAINED | ERROR) == REACHED
    rig.command(ENABLE | START)
    assert rig.statusword & (REACHED | ATTAINED | ERROR) == REACHED | ATTAINED
    assert (rig.get(0x6064), rig.get(0x6062), rig.get(0x60F4)) == (position, position, 0)
    rig.run(1.0)
    assert (rig.get(0x6064), rig.get(0x606C)) == (position, 0)
    rig.command(ENABLE)
    rig.put(0x6060, 1)
    rig.put(0x607A, 100)
    rig.command(ENABLE | 0x10, ENABLE)
    rig.run(1.0)
    assert rig.get(0x6064) == 100
    rig.put(0x6060, 6)
    assert rig.statusword & ATTAINED  # remembered through other modes, until the reset
    rig.nmt(NmtCommand.RESET_NODE)
    rig.enable(6)
    assert not rig.statusword & ATTAINED


def test_without_a_home_switch_both_limits_end_the_search() -> None:
    """A search that finds nothing turns once, then says so and stands."""
    rig = homing_rig(19)
    rig.drive.set_switches(Switches(-300.0, 300.0, (float('nan'), float('nan'))))
    rig.command(ENABLE | START)
    rig.run(10.0)
    assert rig.statusword & (REACHED | ATTAINED | ERROR) == REACHED | ERROR
    assert abs(rig.velocity) < 0.1


@pytest.mark.parametrize('word', [ENABLE, ENABLE | START | HALT], ids=['bit taken back', 'halt'])
def test_an_interrupted_search_stops_and_goes_on(word: int) -> None:
    """The axis stops, neither homed nor in error, until the start bit counts again."""
    rig = homing_rig(17)
    rig.command(ENABLE | START)
    rig.run(0.3)
    assert rig.velocity < 0.0
    rig.command(word)
    rig.run(0.5)
    assert rig.statusword & (REACHED | ATTAINED | ERROR) == REACHED
    assert abs(rig.velocity) < 0.1
    rig.command(ENABLE | START)
    rig.run(10.0)
    assert rig.statusword & ATTAINED


@settings(max_examples=10, deadline=None)
@given(st.sampled_from(sorted(HOMES)), st.integers(-900, 1400))
def test_search_keeps_to_its_speeds(method: int, start: int) -> None:
    """No search is faster than 0x6099:01 or than the ramp 0x609A allows."""
    rig = homing_rig(method, start)
    rig.command(ENABLE | START)
    demand = rig.drive.velocity
    for _ in range(400):
        rig.run(0.01)
        velocity = rig.velocity
        assert abs(velocity) <= 1000.0 + 1e-6
        assert abs(velocity - demand) <= 20_000 * 0.01 + 1e-6
        demand = velocity


def test_switches_show_as_digital_inputs() -> None:
    """0x60FD has the limit switches, the home switch and the interlock."""
    for start, inputs in ((600, 0x4), (-1100, 0x1), (1600, 0x2)):
        rig = homing_rig(0, start)
        assert rig.get(0x60FD) == inputs
    rig.drive.set_voltage(False, rig.now)
    assert rig.get(0x60FD) == 0xA
