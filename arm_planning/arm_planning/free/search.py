# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""RRT-Connect: two trees, from start and goals, grow towards each other; then shortcuts.

Kuffner, LaValle, "RRT-Connect: An efficient approach to single-query path planning", ICRA 2000;
with the balancing of the trees that OMPL has. Under constraints the trees grow by short edges
whose ends are led back to them: Berenson et al., "Manipulation planning on constraint manifolds"
(CBiRRT), ICRA 2009. One is ours because the collision check decides over its speed, and that of
the scene is quicker here than a library's that calls back for each state; the bench has the
comparison. Straight motions between places on a path replace what lies between them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import count

import numpy as np

from arm_model import Array

from .motion_check import MotionCheck

MAX_EXTENSION = 1.2  # greatest length of an edge in [rad]
FIRST_NODES = 256  # nodes that a tree has room for at first

FURTHER_PERIOD = 25
"""Edges between two looks for a further goal, each of which takes as long as several of them."""

SAME = 1e-9  # distance of states that are one in [rad]
MAX_TRIALS = 30  # shortcuts that are tried at most
MAX_FAILURES = 8  # shortcuts that fail in a row before the path counts as short
MIN_GAIN = 0.05  # length that a shortcut saves at least in [rad]


class _Tree:
    """States, and the state from which each was reached."""

    def __init__(self, roots: Sequence[Array]) -> None:
        self.count = 0
        self._states: Array = np.zeros((max(FIRST_NODES, 2 * len(roots)), len(roots[0])))
        self._parents: list[int] = []
        for root in roots:
            self.add(root, -1)

    def add(self, state: Array, parent: int) -> int:
        """Add a state, and return its number."""
        if self.count == len(self._states):
            self._states = np.concatenate((self._states, np.zeros_like(self._states)))
        self._states[self.count] = state
        self._parents.append(parent)
        self.count += 1
        return self.count - 1

    def state(self, node: int) -> Array:
        """Return the state of a node."""
        state: Array = self._states[node]
        return state

    def nearest(self, state: Array) -> int:
        """Return the node that is nearest to a state."""
        apart = self._states[: self.count] - state
        return int(np.einsum('mn,mn->m', apart, apart).argmin())

    def branch(self, node: int) -> list[Array]:
        """Return the states from a root to a node."""
        found = []
        while node >= 0:
            found.append(self._states[node].copy())
            node = self._parents[node]
        return found[::-1]


def rrt_connect(
    start: Array,
    goals: Sequence[Array],
    sample: Callable[[], Array],
    check: MotionCheck,
    expired: Callable[[], bool],
    *,
    further: Iterator[Array | None],
) -> Array | None:
    """Return the places of a path that looks free (m, n); None where the time is over.

    Args:
        goals: Joint positions in [rad] (n), free; one of them is reached.
        further: Goals that are looked for meanwhile: each is one, or a try that found none.
    """
    for goal in goals:
        if check.clear(start, goal):
            return np.array((start, goal))
    from_start, from_goal = _Tree([start]), _Tree(goals)
    growing, other = from_start, from_goal
    for number in count():
        if expired():
            break
        if number % FURTHER_PERIOD == 0:
            _add_goal(from_goal, next(further, None), check)
        if growing.count > other.count:
            growing, other = other, growing
        reached = _extend(growing, sample(), check)
        if reached is None:
            continue
        target = growing.state(reached).copy()
        met = _connect(other, target, check)
        if met is not None:
            here, there = growing.branch(reached), other.branch(met)
            if growing is from_goal:
                here, there = there, here
            return np.array([*here, *there[-2::-1]])
        growing, other = other, growing
    return None


def _add_goal(tree: _Tree, goal: Array | None, check: MotionCheck) -> None:
    if goal is not None and check.admits(goal):
        tree.add(goal, -1)


def _extend(tree: _Tree, target: Array, check: MotionCheck) -> int | None:
    """Grow a tree by an edge towards a target, and return its end; None where it is blocked."""
    near = tree.nearest(target)
    if check.constraints is not None:
        return _crawl(tree, near, target, check)
    begin = tree.state(near)
    way = target - begin
    length = float(np.linalg.norm(way))
    if length < SAME:
        return near
    end = target if length <= MAX_EXTENSION else begin + way * (MAX_EXTENSION / length)
    return tree.add(end, near) if check.clear(begin, end) else None


def _crawl(tree: _Tree, near: int, target: Array, check: MotionCheck) -> int | None:
    """Grow a tree by several edges that heed the constraints, as CBiRRT does."""
    node, begin = near, tree.state(near).copy()
    while float(np.linalg.norm(target - begin)) >= SAME:
        end = check.towards(begin, target)
        if end is None or not check.clear(begin, end):
            return node if node != near else None
        node, begin = tree.add(end, node), end
    return node


def _connect(tree: _Tree, target: Array, check: MotionCheck) -> int | None:
    """Grow a tree until it reaches a target, and return the node there; None where blocked."""
    while True:
        end = _extend(tree, target, check)
        if end is None:
            return None
        if float(np.abs(tree.state(end) - target).max()) < SAME:
            return end


def shortened(
    places: Array, draw: np.random.Generator, check: MotionCheck, expired: Callable[[], bool]
) -> Array:
    """Return a path of the same ends that is no longer, as far as the check can see.

    Args:
        places: Joint positions in [rad] (m, n) with straight motions between them.
    """
    places = _without_needless(places, check, expired)
    failures = 0
    for _ in range(MAX_TRIALS):
        if len(places) < 3 or failures >= MAX_FAILURES or expired():
            break
        along = lengths_along(places)
        first, last = np.sort(draw.uniform(0.0, along[-1], 2)).tolist()
        before, after = (int(np.searchsorted(along, each, 'right')) for each in (first, last))
        begin, end = (_at(places, along, each) for each in (first, last))
        gain = last - first - float(np.linalg.norm(end - begin))
        if before == after or gain < MIN_GAIN or not check.clear(begin, end):
            failures += 1
            continue
        failures = 0
        places = np.concatenate((places[:before], (begin, end), places[after:]))
    return _without_needless(places, check, expired)


def lengths_along(places: Array) -> Array:
    """Return the length from the first place to each in [rad] (m)."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.concatenate(((0.0,), np.cumsum(steps)))


def _at(places: Array, along: Array, length: float) -> Array:
    """Return the place at a length of the path."""
    after = min(max(int(np.searchsorted(along, length)), 1), len(places) - 1)
    whole = along[after] - along[after - 1]
    share = (length - along[after - 1]) / whole if whole > 0.0 else 0.0
    place: Array = places[after - 1] + share * (places[after] - places[after - 1])
    return place


def _without_needless(places: Array, check: MotionCheck, expired: Callable[[], bool]) -> Array:
    """Return places without those whose neighbours are joined by a free straight motion."""
    kept = [0]
    while kept[-1] < len(places) - 1:
        here = kept[-1]
        farther = range(len(places) - 1, here + 1, -1)
        seen = (
            each for each in farther if not expired() and check.clear(places[here], places[each])
        )
        kept.append(next(seen, here + 1))
    return places[kept]
