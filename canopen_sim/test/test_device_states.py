# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""State machine of the simulated drive: every state and every command, and the ramps between."""

from __future__ import annotations

from device_rig import (
    DISABLE_VOLTAGE,
    ENABLE,
    FAULT_RESET,
    moving,
    QUICK_STOP,
    Rig,
    SHUTDOWN,
    SWITCH_ON,
)
from drive_samples import drive_dictionary, with_defaults
import pytest

from arm_canopen import DriveState as State
from canopen_core.standard import drive_state, ObjectDictionary

pytestmark = pytest.mark.slow

SOD, READY, ON, OE, QS, REACTION, FAULT = tuple(State)[2:]

TO_STATE = {
    SOD: [],
    READY: [SHUTDOWN],
    ON: [SHUTDOWN, SWITCH_ON],
    OE: [SHUTDOWN, SWITCH_ON, ENABLE],
    QS: [SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP],
}

TABLE = {
    SOD: {SHUTDOWN: READY},
    READY: {SWITCH_ON: ON, ENABLE: OE, DISABLE_VOLTAGE: SOD, QUICK_STOP: SOD},
    ON: {SHUTDOWN: READY, ENABLE: OE, DISABLE_VOLTAGE: SOD, QUICK_STOP: SOD},
    OE: {SHUTDOWN: READY, SWITCH_ON: ON, DISABLE_VOLTAGE: SOD, QUICK_STOP: QS},
    QS: {ENABLE: OE, DISABLE_VOLTAGE: SOD},
    FAULT: {FAULT_RESET: SOD},
}
"""Where a controlword leads (CiA 402-2, figure 4 and table 26); all others lead nowhere.

In Quick stop active with an option code of 5 to 8; with the others it is left by itself.
"""


def expected(state: State, word: int) -> State:
    """Return the next state by the mask rows of CiA 402-2, table 26."""
    if word & FAULT_RESET:
        return SOD if state is FAULT else state
    if state is FAULT:
        return FAULT
    if not word & 0x02:
        command = DISABLE_VOLTAGE
    elif not word & 0x04:
        command = QUICK_STOP
    elif not word & 0x01:
        command = SHUTDOWN
    else:
        command = ENABLE if word & 0x08 else SWITCH_ON
    return TABLE[state].get(command, state)


def rig_in(state: State, *, option: int = 6) -> Rig:
    """Return a drive at rest in a state."""
    rig = Rig()
    rig.put(0x605A, option)
    lead(rig, state)
    return rig


def lead(rig: Rig, state: State) -> None:
    """Lead a drive at rest to a state."""
    if state is FAULT:
        rig.drive.raise_fault(0x2310)
    else:
        rig.command(*TO_STATE[state])
    assert rig.state is state


@pytest.mark.parametrize('state', [SOD, READY, ON, OE, QS, FAULT])
def test_every_state_and_controlword(state: State) -> None:
    """The lower byte of the controlword leads where the table says, from each state at rest."""
    rig = rig_in(SOD)
    for word in range(256):
        rig.command(0, FAULT_RESET, 0)
        lead(rig, state)
        if state is FAULT:  # the reset is an edge
            rig.command(0)
        if word == rig.get(0x6040):
            continue  # no change, no command
        rig.command(word)
        assert rig.drive.state is expected(state, word), f'controlword 0x{word:02X}'
        assert drive_state(rig.statusword) is rig.drive.state


@pytest.mark.parametrize('state', [SOD, READY, ON, OE, QS])
def test_fault_and_loss_of_voltage_in_every_state(state: State) -> None:
    """A fault leads to Fault from everywhere (13, 14); under-voltage is one if switched on."""
    rig = rig_in(state)
    rig.drive.raise_fault(0x4310)
    rig.run(0.1)
    assert (rig.state, rig.get(0x603F)) == (FAULT, 0x4310)
    rig = rig_in(state)
    rig.drive.set_voltage(False)
    is_on = state in (ON, OE, QS)
    assert rig.drive.state is (FAULT if is_on else state)
    assert rig.get(0x603F) == (0x3220 if is_on else 0)


def test_fault_reset_is_an_edge() -> None:
    """A bit that is held resets no second fault, and no command is accepted (table 26)."""
    rig = rig_in(FAULT)
    rig.command(FAULT_RESET | SHUTDOWN)
    assert rig.state is SOD
    rig.command(SHUTDOWN)
    assert rig.state is READY
    rig.command(DISABLE_VOLTAGE, FAULT_RESET)
    rig.drive.raise_fault(0x2310)
    rig.command(FAULT_RESET | 0x06)
    assert rig.state is FAULT
    rig.command(0x00, FAULT_RESET)
    assert rig.state is SOD


def ramp(rig: Rig, duration: float = 1.0) -> tuple[float, float, list[State]]:
    """Return time to standstill, its distance, and the states on the way."""
    start, origin = rig.now, rig.position
    states = [rig.drive.state]
    stopped = rig.now
    while rig.now < start + duration:
        rig.run(0.001)
        if rig.drive.state is not states[-1]:
            states.append(rig.drive.state)
        if abs(rig.velocity) > 1.0:
            stopped = rig.now
    return stopped - start, rig.position - origin, states


SLOW = 1000.0 / 10_000.0  # [s] by 0x6084
QUICK = 1000.0 / 20_000.0  # [s] by 0x6085


@pytest.mark.parametrize(
    ('option', 'words', 'time', 'states'),
    [
        ({0x605A: 0}, [QUICK_STOP], None, [SOD]),
        ({0x605A: 1}, [QUICK_STOP], SLOW, [QS, SOD]),
        ({0x605A: 2}, [QUICK_STOP], QUICK, [QS, SOD]),
        ({0x605A: 2}, [QUICK_STOP, ENABLE], QUICK, [QS, SOD]),  # it cannot be called off
        ({0x605A: 5}, [QUICK_STOP], SLOW, [QS]),
        ({0x605A: 6}, [QUICK_STOP], QUICK, [QS]),
        ({}, [SWITCH_ON], SLOW, [OE, ON]),
        ({}, [SWITCH_ON, 0x107, DISABLE_VOLTAGE], None, [SOD]),  # it overtakes a ramp
        ({0x605C: 0}, [SWITCH_ON], None, [ON]),
        ({}, [SHUTDOWN], None, [READY]),
        ({0x605B: 1}, [SHUTDOWN], SLOW, [OE, READY]),
        ({}, [DISABLE_VOLTAGE], None, [SOD]),
        ({0x605E: 0}, [], None, [FAULT]),
        ({0x605E: 1}, [], SLOW, [REACTION, FAULT]),
        ({0x605E: 2}, [], QUICK, [REACTION, FAULT]),
    ],
)
def test_ways_to_stop(
    option: dict[int, int], words: list[int], time: float | None, states: list[State]
) -> None:
    """Option codes choose ramp and states after controlwords, or after a fault (no word)."""
    rig = moving(3, option, 1000)
    if not words:
        rig.drive.raise_fault(0x2310, rig.now)
    rig.command(*words[:2])
    rig.run(0.05 if words[2:] else 0.0)
    rig.command(*words[2:])
    duration, distance, seen = ramp(rig)
    assert seen == states
    if time is None:  # the motor runs out
        assert 0.0 < distance < 100.0
    else:
        assert duration == pytest.approx(time, abs=0.03)
        assert distance == pytest.approx(1000.0 * time / 2.0 + 2.0, rel=0.05)
    if states[0] is QS:
        assert bool(rig.statusword & 0x400) is (states == [QS])


@pytest.mark.parametrize('word', [QUICK_STOP, SWITCH_ON])
def test_enable_operation_calls_a_ramp_off(word: int) -> None:
    """That of a quick stop that stays (option 6), or of "disable operation": the drive goes on."""
    rig = moving(3, {0x605A: 6}, 1000)
    rig.command(word)
    rig.run(0.02)
    before = rig.velocity
    rig.command(ENABLE)
    assert rig.velocity == pytest.approx(before)
    _, _, states = ramp(rig)
    assert states == [OE]
    assert rig.get(0x606C) == 1000


def test_loss_of_voltage_ends_a_fault_reaction() -> None:
    """Without voltage there is no ramp any more."""
    rig = moving()
    rig.drive.raise_fault(0x2310, rig.now)
    rig.run(0.01)
    rig.drive.set_voltage(False)
    assert rig.drive.state is FAULT


def test_enabling_a_motor_that_runs_out_does_not_jerk() -> None:
    """A motor that is still coasting is caught at its velocity and stopped."""
    rig = moving(3, {0x605C: 0}, 1000)
    rig.put(0x60FF, 0)
    rig.command(DISABLE_VOLTAGE)
    rig.run(0.01)
    before = rig.velocity
    rig.put(0x6060, 1)
    rig.command(SHUTDOWN, SWITCH_ON, ENABLE)
    assert rig.velocity == pytest.approx(before)
    last = before
    for _ in range(100):
        rig.run(0.001)
        assert rig.velocity <= last + 1e-6
        last = rig.velocity
    assert last == pytest.approx(0.0, abs=1.0)


def test_dictionary_with_an_unknown_option() -> None:
    """An option code of the dictionary that is not simulated acts like the usual one."""
    rig = Rig(with_defaults(drive_dictionary(), {(0x605A, 0): 9}))
    rig.command(*TO_STATE[OE], QUICK_STOP)
    rig.run(0.1)
    assert rig.state is SOD


def test_drive_of_a_poor_dictionary() -> None:
    """Controlword, statusword and a mode are enough for a drive."""
    kept = {0x6040, 0x6041, 0x6060, 0x6061, 0x6064, 0x607A}
    entries = [e for e in drive_dictionary() if e.index < 0x6000 or e.index in kept]
    rig = Rig(ObjectDictionary(entries))
    rig.put(0x607A, 1000)
    rig.enable(8)
    rig.put(0x607A, 1000)
    rig.run(1.0)
    assert rig.get(0x6064) == 1000
