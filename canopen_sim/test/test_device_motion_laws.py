# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of motion that hold in every mode, whatever the master says."""

from __future__ import annotations

from device_rig import ENABLE, FAULT_RESET, Rig, SHUTDOWN, SWITCH_ON
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from canopen_sim import Fault

pytestmark = pytest.mark.slow

SPEED = 3000.0  # [inc/s] 0x607F, the highest of all
STEP = 0.005  # [s]
MODES = st.sampled_from([0, 1, 2, 3, 4, 6, 7, 8, 9, 10])
WORDS = st.sampled_from(
    [
        *(ENABLE | bits for bits in (0, 0, 0x10, 0x30, 0x50, 0x70, 0x100, 0x210)),
        SHUTDOWN,
        SWITCH_ON,
        0x02,
        0x00,
        FAULT_RESET,
    ]
)
TARGETS = st.tuples(
    st.sampled_from([(0x607A, 0), (0x60FF, 0), (0x6071, 0), (0x6042, 0), (0x60C1, 1)]),
    st.integers(-3000, 3000),
)
STOPS = st.floats(-2000.0, 2000.0)
ACTIONS = st.one_of(
    st.tuples(st.just('mode'), MODES),
    st.tuples(st.just('word'), WORDS),
    st.tuples(st.just('word'), st.just(ENABLE)),
    st.tuples(st.just('target'), TARGETS),
    st.tuples(
        st.just('fault'), st.sampled_from([fault for fault in Fault if fault.value.of_drive])
    ),
    st.tuples(st.just('block'), STOPS),
    st.tuples(st.just('load'), st.floats(-500.0, 500.0)),
    st.tuples(st.just('method'), st.sampled_from([1, 8, 17, 24, 33, 35])),
    st.tuples(st.just('sync'), st.integers(1, 5)),
)


def perform(rig: Rig, kind: str, value: object) -> None:
    """Do one of the things that a master or the world can do."""
    match kind, value:
        case 'mode', int(mode):
            rig.put(0x6060, mode)
        case 'word', int(word):
            rig.command(word)
        case 'target', ((int(index), int(subindex)), int(target)):
            rig.put(index, target, subindex)
        case 'fault', Fault() as fault:
            rig.inject(fault, duration=9.0)
            rig.cure(fault)
        case 'block', float(place):
            rig.drive.block(place, rig.now)
            rig.drive.release(rig.now)
        case 'load', float(torque):
            rig.drive.set_load(torque, rig.now)
        case 'method', int(method):
            rig.put(0x6098, method)
        case 'sync', int(count):
            rig.cycles(count)


@settings(max_examples=80, deadline=None)
@given(st.lists(ACTIONS, min_size=5, max_size=25))
def test_motor_never_jumps(actions: list[tuple[str, object]]) -> None:
    """Over any sequence of modes, commands, faults and loads the motor moves at most at its speed.

    Homing renames positions; the mechanical position does not notice.
    """
    rig = Rig()
    rig.put(0x607F, int(SPEED))
    rig.put(0x6065, 0xFFFFFFFF)
    rig.command(SHUTDOWN, SWITCH_ON, ENABLE)
    place, time = 0.0, rig.now
    for kind, value in actions:
        perform(rig, kind, value)
        for _ in range(4):
            rig.run(STEP)
            moved = rig.position - rig.drive.origin
            assert abs(moved - place) <= SPEED * (rig.now - time) + 1e-3
            assert abs(rig.velocity) <= SPEED + 1e-3
            place, time = moved, rig.now


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from([(3, 0x60FF), (2, 0x6042)]),
    st.lists(st.tuples(st.integers(-2500, 2500), st.floats(0.01, 0.4)), min_size=1, max_size=10),
    st.integers(2000, 20_000),
)
def test_velocity_never_ramps_faster_than_its_profile(
    mode: tuple[int, int], commands: list[tuple[int, float]], ramp: int
) -> None:
    """In PV and VL the velocity keeps to its ramps, over random targets and halts."""
    rig = Rig()
    number, target = mode
    rig.put(0x6083, ramp)
    rig.put(0x6084, ramp)
    rig.put(0x6048, ramp, 1)
    rig.put(0x6049, ramp, 1)
    rig.enable(number)
    rig.command(ENABLE | 0x70)
    last = 0.0
    for value, duration in commands:
        rig.put(target, value)
        for _ in range(int(duration / STEP)):
            rig.run(STEP)
            velocity = rig.velocity
            assert abs(velocity - last) <= ramp * STEP + 0.1
            assert abs(velocity) <= 2500.1
            last = velocity
        rig.command(ENABLE | 0x70 | 0x100 * (value % 3 == 0))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(-2000, 2000), st.booleans()), min_size=1, max_size=8))
def test_acknowledged_set_points_are_not_lost(setpoints: list[tuple[int, bool]]) -> None:
    """Each set-point that was acknowledged and not replaced at once is gone to, in its order."""
    rig = Rig()
    rig.put(0x6081, 5000)
    rig.enable(1)
    rig.run(0.05)
    expected: list[int] = []
    seen: list[float] = [rig.position]

    def watch(duration: float) -> None:
        for _ in range(int(duration / STEP)):
            rig.run(STEP)
            seen.append(rig.position)

    for target, blend in setpoints:
        rig.put(0x607A, target)
        rig.command(ENABLE | 0x10 | (0x200 if blend else 0))
        assert rig.statusword & 0x1000
        expected.append(target)
        rig.command(ENABLE)
        for _ in range(1000):
            if not rig.statusword & 0x1000:
                break
            watch(STEP)
    watch(2.0)
    assert abs(rig.position - expected[-1]) < 0.01
    passed = 0
    for target in expected:
        while not _between(seen, passed, target):
            passed += 1
            assert passed < len(seen), (target, expected)


def _between(seen: list[float], at: int, target: int) -> bool:
    """Return whether the motor was at a target from one look to the next."""
    after = seen[min(at + 1, len(seen) - 1)]
    return min(seen[at], after) - 1.0 <= target <= max(seen[at], after) + 1.0
