# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the store of joint states."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from robot_primitives import JointSample, JointStateStore

NAMES = ('a', 'b', 'c', 'other')
NUMBERS = st.one_of(st.floats(-10.0, 10.0), st.just(math.nan), st.just(math.inf))
MESSAGES = st.lists(
    st.tuples(
        st.lists(st.tuples(st.sampled_from(NAMES), NUMBERS, NUMBERS), max_size=4), st.booleans()
    ),
    max_size=20,
)


@given(MESSAGES, st.floats(0.0, 20.0))
def test_the_latest_finite_position_of_each_joint_counts(
    messages: list[tuple[list[tuple[str, float, float]], bool]], since: float
) -> None:
    """Whatever messages name, and whether they have velocities."""
    store, latest = JointStateStore(NAMES[:3]), dict[str, JointSample]()
    for time, (rows, has_velocities) in enumerate(messages):
        names, positions = [row[0] for row in rows], [row[1] for row in rows]
        velocities = [row[2] for row in rows] if has_velocities else []
        store.receive(names, positions, velocities, float(time))
        for name, position, velocity in rows:
            if math.isfinite(position) and name != 'other':
                speed = velocity if has_velocities else math.nan
                latest[name] = JointSample(position, speed, float(time))
    fresh = {name: each for name, each in latest.items() if each.time >= since}
    assert str(dict(store.samples(since))) == str(fresh)
    assert all(str(store.sample(name)) == str(latest.get(name)) for name in NAMES)


def test_a_message_that_is_too_short_counts_as_far_as_it_goes() -> None:
    """A joint without a position keeps the one before."""
    store = JointStateStore()
    store.receive(['a', 'b'], [1.0], [0.5, 0.6], 1.0)
    assert dict(store.samples()) == {'a': JointSample(1.0, 0.5, 1.0)}
