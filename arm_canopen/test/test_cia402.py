# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""State machine, by a table that the code does not share; set-points of modes 7 and 8."""

from __future__ import annotations

from itertools import pairwise
import math
import random

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import DriveState
from arm_canopen.cia402.modes.cyclic_position import SetpointProfile
from arm_canopen.cia402.parameters import ProfileLimits
from arm_canopen.cia402.state_machine import Command, fault_reset, next_command, TARGETS
from canopen_core.standard import drive_state

CYCLE = 0.01  # [s]
LIMITS = ProfileLimits(1.0, 10.0, 10.0)
AMPLITUDE, RATE = 0.45, 2 * math.pi / 5  # [rad] and [rad/s] of a swing


def swing(now: float) -> float:
    """Return where a client wants an axis at a time in [s]."""
    return AMPLITUDE * (1 - math.cos(RATE * now))


def velocities(frequency: float, jitter: float, *, single: bool = False) -> list[float]:
    """Follow five seconds of the swing; return the velocity in each cycle.

    Args:
        frequency: How many targets come in a second.
        jitter: How much later than sent they arrive, at most, in [s].
        single: Take each for a single target.
    """
    rng, profile = random.Random(1), SetpointProfile(0.0)
    sent = [k / frequency for k in range(round(5 * frequency))]
    coming = sorted((at + rng.uniform(0.0, jitter), swing(at)) for at in sent)
    found = []
    for cycle in range(round(5 / CYCLE)):
        while coming and coming[0][0] <= cycle * CYCLE:
            (profile.go if single else profile.track)(coming.pop(0)[1])
        profile.step(CYCLE, LIMITS)
        found.append(profile.velocity)
    return found


def unevenness(track: list[float]) -> float:
    """Return the acceleration of a track as a multiple of that of the swing (root mean square)."""
    steps = [(after - before) / CYCLE for before, after in pairwise(track)]
    rms = math.sqrt(sum(step * step for step in steps) / len(steps))
    return rms / (AMPLITUDE * RATE**2 / math.sqrt(2))


@pytest.mark.parametrize(
    ('frequency', 'jitter', 'bound'),
    [(10.0, 0.0, 1.8), (50.0, 0.0, 1.3), (50.0, 0.005, 1.2), (100.0, 0.005, 1.1)],
)
def test_a_path_that_comes_in_targets_is_followed_at_its_speed(
    frequency: float, jitter: float, bound: float
) -> None:
    """Not by a dash to each of its points, as towards single targets that come as quickly."""
    assert unevenness(velocities(frequency, jitter)) < bound
    if frequency < 100.0:
        assert unevenness(velocities(frequency, jitter, single=True)) > 3 * bound


def test_a_stream_is_behind_by_two_intervals_and_its_braking_distance() -> None:
    """Else it could not stop at the newest target, should that be the last."""
    speed, frequency = 0.5, 50.0
    profile, lags = SetpointProfile(0.0), []
    for cycle in range(200):
        now = cycle * CYCLE
        if cycle % 2 == 0:
            profile.track(speed * now)
        profile.step(CYCLE, LIMITS)
        lags.append(speed * now - profile.position)
    braking = speed**2 / (2 * LIMITS.deceleration)
    assert max(lags[100:]) < 2 * speed / frequency + braking + speed * CYCLE
    assert profile.velocity == pytest.approx(speed, rel=0.02)


targets = st.lists(st.tuples(st.floats(-2.0, 2.0), st.integers(0, 30)), min_size=1, max_size=20)


@given(targets, st.floats(0.1, 3.0), st.floats(0.5, 20.0))
def test_no_stream_leads_beyond_its_targets_or_limits(
    stream: list[tuple[float, int]], speed: float, acceleration: float
) -> None:
    """Wherever they are, and whenever they come; in the end the axis stands at the last one."""
    limits, profile, before = (
        ProfileLimits(speed, acceleration, acceleration),
        SetpointProfile(0.0),
        0.0,
    )
    low = high = 0.0
    for target, cycles in [*stream, (stream[-1][0], 30 * 100)]:
        profile.track(target)
        low, high = min(low, target), max(high, target)
        for _ in range(cycles):
            position = profile.step(CYCLE, limits)
            assert low - 1e-6 <= position <= high + 1e-6
            assert abs(profile.velocity) <= speed * (1 + 1e-9)
            assert abs(profile.velocity - before) <= acceleration * CYCLE * (1 + 1e-9) + 1e-12
            before = profile.velocity
    assert (profile.position, profile.velocity) == (stream[-1][0], 0.0)
    assert profile.at_rest


def test_a_stream_may_be_quicker_than_a_single_target() -> None:
    """As far as the drive may (0x607F): 0x6081 is how quick a target is approached."""
    limits = ProfileLimits(0.1, 10.0, 10.0, speed_limit=0.4)
    for speed, reached in [(0.3, 0.3), (0.9, 0.4)]:
        profile = SetpointProfile(0.0)
        for cycle in range(200):
            profile.track(speed * cycle * CYCLE)
            profile.step(CYCLE, limits)
        assert profile.velocity == pytest.approx(reached, rel=0.01)
    profile.go(10.0)
    for _ in range(50):
        profile.step(CYCLE, limits)
    assert profile.velocity == pytest.approx(0.1)


def test_a_single_target_ends_a_stream() -> None:
    """It is approached as if none had been; so is the first one of the next stream."""
    plain, after = SetpointProfile(0.0), SetpointProfile(0.0)
    for _ in range(5):
        after.track(0.0)
        for _ in range(20):
            after.step(CYCLE, LIMITS)
    for begin in (SetpointProfile.go, SetpointProfile.track):
        after.go(None)
        for profile in (plain, after):
            begin(profile, 1.0)
        for _ in range(60):
            assert plain.step(CYCLE, LIMITS) == after.step(CYCLE, LIMITS)
        plain, after = SetpointProfile(0.0), SetpointProfile(0.0)


S = DriveState

# CiA 402-2, table 28: command bits 7, 3, 2, 1, 0 of the controlword; None is "does not matter"
PATTERNS: dict[str, tuple[int | None, ...]] = {
    'shutdown': (0, None, 1, 1, 0),
    'switch on': (0, 0, 1, 1, 1),
    'enable operation': (0, 1, 1, 1, 1),
    'disable voltage': (0, None, None, 0, None),
    'quick stop': (0, None, 0, 1, None),
}

# CiA 402-2, figure 4: state, command, next state; the numbers are those of the transitions
TRANSITIONS: dict[tuple[DriveState, str], DriveState] = {
    (S.SWITCH_ON_DISABLED, 'shutdown'): S.READY_TO_SWITCH_ON,  # 2
    (S.READY_TO_SWITCH_ON, 'switch on'): S.SWITCHED_ON,  # 3
    (S.SWITCHED_ON, 'enable operation'): S.OPERATION_ENABLED,  # 4
    (S.OPERATION_ENABLED, 'switch on'): S.SWITCHED_ON,  # 5
    (S.SWITCHED_ON, 'shutdown'): S.READY_TO_SWITCH_ON,  # 6
    (S.READY_TO_SWITCH_ON, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 7
    (S.READY_TO_SWITCH_ON, 'quick stop'): S.SWITCH_ON_DISABLED,  # 7
    (S.OPERATION_ENABLED, 'shutdown'): S.READY_TO_SWITCH_ON,  # 8
    (S.OPERATION_ENABLED, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 9
    (S.SWITCHED_ON, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 10
    (S.SWITCHED_ON, 'quick stop'): S.SWITCH_ON_DISABLED,  # 10
    (S.OPERATION_ENABLED, 'quick stop'): S.QUICK_STOP_ACTIVE,  # 11
    (S.QUICK_STOP_ACTIVE, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 12
    (S.QUICK_STOP_ACTIVE, 'enable operation'): S.OPERATION_ENABLED,  # 16
}

AUTOMATIC: dict[DriveState, DriveState] = {
    S.NOT_READY_TO_SWITCH_ON: S.SWITCH_ON_DISABLED,  # 1
    S.FAULT_REACTION_ACTIVE: S.FAULT,  # 14
}

# CiA 402-2, table 31: bits 6, 5, 3, 2, 1, 0 of the statusword
STATUS_BITS: dict[tuple[int, int | None, int, int, int, int], DriveState] = {
    (0, None, 0, 0, 0, 0): S.NOT_READY_TO_SWITCH_ON,
    (1, None, 0, 0, 0, 0): S.SWITCH_ON_DISABLED,
    (0, 1, 0, 0, 0, 1): S.READY_TO_SWITCH_ON,
    (0, 1, 0, 0, 1, 1): S.SWITCHED_ON,
    (0, 1, 0, 1, 1, 1): S.OPERATION_ENABLED,
    (0, 0, 0, 1, 1, 1): S.QUICK_STOP_ACTIVE,
    (0, None, 1, 1, 1, 1): S.FAULT_REACTION_ACTIVE,
    (0, None, 1, 0, 0, 0): S.FAULT,
}

REAL_STATES = [state for state in S if state is not S.UNKNOWN]


def command_of(word: int) -> str:
    """Name the command of a controlword by the table of the standard."""
    bits = tuple(word >> bit & 1 for bit in (7, 3, 2, 1, 0))
    names = [
        name
        for name, pattern in PATTERNS.items()
        if all(want is None or want == bit for want, bit in zip(pattern, bits, strict=True))
    ]
    assert len(names) == 1, f'0x{word:02X} is {names}'
    return names[0]


def after(state: DriveState, word: int) -> DriveState:
    """Return the state that a drive takes when it gets a controlword."""
    if state in AUTOMATIC:
        return AUTOMATIC[state]
    if state is S.FAULT:
        return S.FAULT  # a reset needs a rising edge, which is no command of the table
    return TRANSITIONS.get((state, command_of(word)), state)


@pytest.mark.parametrize('target', TARGETS, ids=lambda state: state.name)
@pytest.mark.parametrize('start', REAL_STATES, ids=lambda state: state.name)
def test_every_state_is_led_to_every_target(start: DriveState, target: DriveState) -> None:
    """And stays there; a fault is only left by a reset, a quick stop ends below."""
    path = [start]
    for _ in range(8):
        path.append(after(path[-1], next_command(path[-1], target)))
    end = target
    if S.FAULT in path:
        end = S.FAULT
    elif target is S.QUICK_STOP_ACTIVE and start not in (S.OPERATION_ENABLED, target):
        end = S.SWITCH_ON_DISABLED
    assert path[-2:] == [end, end]
    if target is not S.OPERATION_ENABLED:
        assert S.OPERATION_ENABLED not in path[1:], 'enabled on the way to something else'


def test_states_that_are_no_targets_and_one_that_is_unknown() -> None:
    """A fault or a start-up state cannot be commanded; UNKNOWN is answered by Disable voltage."""
    for target in S:
        if target in TARGETS:
            assert next_command(S.UNKNOWN, target) is Command.DISABLE_VOLTAGE
            continue
        with pytest.raises(ValueError, match='cannot be commanded'):
            next_command(S.SWITCHED_ON, target)


def test_every_statusword_decodes_as_the_standard_says() -> None:
    """All 65,536 words give the state of the table, or UNKNOWN where no row fits."""
    rows: dict[tuple[int, ...], DriveState] = {
        (b6, b5, b3, b2, b1, b0): state
        for (b6, five, b3, b2, b1, b0), state in STATUS_BITS.items()
        for b5 in ((0, 1) if five is None else (five,))
    }
    for word in range(0x10000):
        bits = tuple(word >> bit & 1 for bit in (6, 5, 3, 2, 1, 0))
        assert drive_state(word) is rows.get(bits, S.UNKNOWN), f'0x{word:04X}'


def test_fault_reset_is_a_rising_edge() -> None:
    """Repeated while the fault lasts, and only in a fault; a drive of half the rate sees it."""
    words = [fault_reset(DriveState.FAULT, 0.01 * cycle + 1e-6) for cycle in range(40)]
    for every in range(1, 6):
        seen = words[::every]
        assert any(b & ~a & 0x80 for a, b in pairwise([0, *seen]))
        assert any(a & ~b & 0x80 for a, b in pairwise(seen))
    assert fault_reset(DriveState.SWITCHED_ON, 0.0) == 0
