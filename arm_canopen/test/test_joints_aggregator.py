# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint states of single drives become one set for each moment."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from urdf_reader import Mimic

from arm_canopen.joints import (
    JointAggregator,
    Joints,
    JointSample,
    JointSet,
    movable_joints,
    STALE_AFTER,
)

PERIOD_NS = 10_000_000
NAMES = ['elbow', 'wrist', 'base']  # URDF order, which is no alphabetical one


def sample(value: float) -> JointSample:
    """Return a state that can be distinguished from others."""
    return JointSample(value, -value, 2 * value)


class Publisher:
    """Feeds an aggregator and keeps what it publishes."""

    def __init__(self, joints: Joints | None = None) -> None:
        self.aggregator = JointAggregator(joints or dict.fromkeys(NAMES))
        self.sets: list[JointSet] = []

    def receive(self, name: str, cycle: int, value: float = 0.0) -> None:
        """Receive the state of a joint at a cycle of 10 ms."""
        stamp, now = cycle * PERIOD_NS, cycle * PERIOD_NS * 1e-9
        self.sets += self.aggregator.update(name, stamp, sample(value), now)

    def settle(self) -> None:
        """Run two cycles, in which it learns which joints take part."""
        for cycle in (1, 2):
            for name in NAMES:
                self.receive(name, cycle)
        self.sets.clear()


@given(st.lists(st.permutations(NAMES), min_size=1, max_size=20))
def test_one_set_for_each_cycle_in_urdf_order(orders: list[list[str]]) -> None:
    """Whatever the order in which drives answer, each cycle gives one set, with its own values."""
    publisher = Publisher()
    publisher.settle()
    for cycle, order in enumerate(orders, start=3):
        for name in order:
            publisher.receive(name, cycle, cycle + NAMES.index(name) / 10)
    assert [state.stamp for state in publisher.sets] == [
        cycle * PERIOD_NS for cycle in range(3, 3 + len(orders))
    ]
    for cycle, state in enumerate(publisher.sets, start=3):
        assert [*state.samples] == NAMES
        assert [*state.samples.values()] == [sample(cycle + place / 10) for place in range(3)]


def test_the_set_leaves_with_the_last_joint() -> None:
    """Not before, and not at the next cycle."""
    publisher = Publisher()
    publisher.settle()
    publisher.receive('base', 3)
    publisher.receive('elbow', 3)
    assert publisher.sets == []
    publisher.receive('wrist', 3)
    assert len(publisher.sets) == 1


def test_a_joint_that_is_lost_delays_one_cycle_only() -> None:
    """The next cycle ends the incomplete round; after that nobody waits for the lost one."""
    publisher = Publisher()
    publisher.settle()
    for cycle in (3, 4, 5):
        publisher.receive('elbow', cycle)
        publisher.receive('base', cycle)
    assert [state.stamp // PERIOD_NS for state in publisher.sets] == [3, 4, 5]


def test_a_lost_joint_is_left_out_after_a_while_and_named() -> None:
    """Its last state is repeated for a moment, never for longer; then it counts as silent."""
    publisher = Publisher()
    publisher.settle()
    last = 2 + round(STALE_AFTER * 1e9 / PERIOD_NS)
    for cycle in range(3, last + 3):
        publisher.receive('elbow', cycle)
        publisher.receive('base', cycle)
    with_wrist = [state.stamp // PERIOD_NS for state in publisher.sets if 'wrist' in state.samples]
    assert max(with_wrist) in (last - 1, last)
    assert [*publisher.sets[-1].samples] == ['elbow', 'base']
    now = (last + 2) * PERIOD_NS * 1e-9
    assert publisher.aggregator.silent(now) == ['wrist']


def test_a_joint_that_comes_back_takes_part_again() -> None:
    """From its second cycle on it is waited for."""
    publisher = Publisher()
    publisher.settle()
    for cycle in range(3, 90):
        publisher.receive('elbow', cycle)
    for cycle in (90, 91, 92):
        for name in NAMES:
            publisher.receive(name, cycle)
    assert [len(state.samples) for state in publisher.sets[-2:]] == [3, 3]
    assert publisher.aggregator.silent(0.93) == []


def test_joints_that_never_come_are_silent_from_the_start() -> None:
    """In URDF order, without those that follow others."""
    publisher = Publisher({'a': None, 'b': Mimic('a'), 'c': None})
    assert publisher.aggregator.silent(0.0) == ['a', 'c']
    waited = round(STALE_AFTER * 1e9 / PERIOD_NS) + 1
    for cycle in range(1, waited + 1):
        publisher.receive('c', cycle)
    assert publisher.sets == []
    publisher.receive('c', waited + 1)
    assert [*publisher.sets[-1].samples] == ['c']
    assert publisher.aggregator.silent(waited * 0.01) == ['a']


def test_nobody_sees_half_a_robot_at_the_start() -> None:
    """The first set that is published has every joint that has a drive."""
    publisher = Publisher()
    publisher.receive('elbow', 1)
    publisher.receive('elbow', 2)
    publisher.receive('wrist', 2)
    publisher.receive('base', 2)
    assert [[*state.samples] for state in publisher.sets] == [NAMES]


def test_a_mimic_joint_follows_by_its_law_unless_it_is_received_itself() -> None:
    """It is multiplier * leader + offset; a drive of its own beats the law."""
    publisher = Publisher({'a': None, 'b': Mimic('a', -2.0, 0.5)})
    publisher.receive('a', 1, 3.0)
    state = publisher.sets[-1]
    assert [*state.samples] == ['a', 'b']
    assert state.samples['b'] == JointSample(-5.5, 6.0, 0.0)
    publisher.receive('a', 2, 3.0)
    publisher.receive('b', 2, 1.0)
    for name, value in (('a', 3.0), ('b', 1.0)):
        publisher.receive(name, 3, value)
    assert publisher.sets[-1].samples == {'a': sample(3.0), 'b': sample(1.0)}


def test_a_clock_that_is_set_back_does_not_stop_the_sets() -> None:
    """Joints that report again begin a new round, whatever their stamp."""
    publisher = Publisher()
    for cycle in (1000, 1001):
        for name in NAMES:
            publisher.receive(name, cycle)
    publisher.sets.clear()
    for cycle in (10, 11, 12):
        for name in NAMES:
            publisher.receive(name, cycle)
    assert [state.stamp // PERIOD_NS for state in publisher.sets] == [10, 11, 12]


def test_joints_with_one_variable_in_the_order_of_the_urdf() -> None:
    """Fixed ones have no state here."""
    kinds = {'z': 'revolute', 'flange': 'fixed', 'a': 'continuous'}
    links = ''.join(f'<link name="{name}"/>' for name in ('base', *(f'{each}1' for each in kinds)))
    parts = ''.join(
        f'<joint name="{name}" type="{kind}"><parent link="base"/><child link="{name}1"/></joint>'
        for name, kind in kinds.items()
    )
    assert [*movable_joints(f'<robot name="r">{links}{parts}</robot>')] == ['z', 'a']
