# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""RRT-Connect: grows two trees, from start and goals, towards each other; then shortcuts.

Kuffner, LaValle, "RRT-Connect: An efficient approach to single-query path planning", ICRA 2000;
with OMPL's balancing of the trees. Under constraints the trees grow by short edges whose ends
are projected onto the constraints: Berenson et al., "Manipulation planning on constraint
manifolds" (CBiRRT), ICRA 2009. This is an implementation of our own because collision checks
dominate the time, and a library would call back for each state; the bench compares both. Without
constraints the compiled search of arm_model is used if it is available. Shortcuts replace parts
of a path by straight motions. A :class:`MotionCheck` decides which motions are free of contact
and satisfy the path constraints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
import math

import numpy as np

from arm_model import Array, CompiledSearch
from arm_trajectory import Path

from .constraints import ConstraintCheck
from .validity import ValidityCheck, Violation

STRIDE = 0.15  # length of a motion between two states that heed constraints in [rad]
MIN_PROGRESS = 0.01  # by how much such a motion comes nearer to its target at least in [rad]
LOOK = 0.03  # turn of all joints together between two looks at constraints in [rad]


class MotionCheck:
    """Contact and path-constraint checks of one search. Not thread-safe."""

    def __init__(
        self,
        check: ValidityCheck,
        ends: Sequence[Array],
        constraints: ConstraintCheck | None = None,
    ) -> None:
        self.constraints, self._check = constraints, check
        self.required, self.compiled = check.required(*ends), check.compiled

    def admits(self, goal: Array) -> bool:
        """Whether a valid state may become a further goal after the search began."""
        return bool((self._check.required(goal) >= self.required).all())

    def clear(self, begin: Array, end: Array) -> bool:
        """Whether a straight motion from a free state is free along its whole length."""
        way = end - begin
        if self.constraints is not None:  # as far as a quick look shows
            shares = _coarse_first(math.ceil(float(np.abs(way).sum()) / LOOK) + 1)
            if not all(map(self.constraints.heeds, begin + shares[:, None] * way)):
                return False
        return self._check.near(begin, end, self.required) is None

    def waypoints(self, places: Array) -> Violation | None:
        """Return where straight motions between waypoints are not valid, or None."""
        violation = self._check.waypoints(places)
        if violation is None and self.constraints is not None:
            return self.constraints.lines(places)
        return violation

    def path(self, path: Path) -> Violation | None:
        """Return where a path is not valid; None if it is valid."""
        violation = self._check.path(path)
        if violation is None and self.constraints is not None:
            return self.constraints.path(path)
        return violation

    def towards(self, begin: Array, target: Array) -> Array | None:
        """Return the next state towards a target under the constraints; None if there is none."""
        way = target - begin
        length = float(np.linalg.norm(way))
        wanted = target if length <= STRIDE else begin + way * (STRIDE / length)
        end = wanted if self.constraints is None else self.constraints.projected(wanted)
        if end is None or float(np.linalg.norm(end - begin)) > 2.0 * STRIDE:
            return None
        left = float(np.linalg.norm(target - end))
        return end if left < length - MIN_PROGRESS or left == 0.0 else None


@lru_cache(maxsize=1024)
def _coarse_first(count: int) -> Array:
    """Return the shares 1/count .. 1 in an order whose early ones are far apart."""
    bits = max(count - 1, 1).bit_length()
    numbers = np.arange(1 << bits)
    reversed_bits = np.zeros_like(numbers)
    for bit in range(bits):
        reversed_bits |= ((numbers >> bit) & 1) << (bits - 1 - bit)
    order = reversed_bits[reversed_bits < count]
    shares: Array = (count - order) / count
    return shares


MAX_EXTENSION = 1.2  # greatest length of an edge in [rad]
FIRST_NODES = 256  # nodes that a tree has room for at first

BLOCK = 25
"""Samples between two checks of the time and for a further goal, which costs several samples."""

SAME = 1e-9  # distance of states that are one in [rad]
MAX_TRIALS = 30  # shortcuts that are tried at most
MAX_FAILURES = 8  # shortcuts that fail in a row before the path counts as short
MIN_GAIN = 0.05  # length that a shortcut saves at least in [rad]


class _Tree:
    """States, and the parent of each."""

    def __init__(self, joints: int) -> None:
        self.count = 0
        self._states: Array = np.zeros((FIRST_NODES, joints))
        self._parents: list[int] = []

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


class Search:
    """Two trees, from the start and from goals; reference of the compiled search."""

    def __init__(self, start: Array, check: MotionCheck) -> None:
        self._check, self._goals = check, _Tree(len(start))
        self._start = self._growing = _Tree(len(start))
        self._start.add(start, -1)
        self._other = self._goals

    def add_goal(self, goal: Array) -> None:
        """Add a root of the goal tree."""
        self._goals.add(goal, -1)

    def grow(self, targets: Array) -> Array | None:
        """Grow towards samples (m, n); return the waypoints (k, n) if the trees meet, or None."""
        for target in targets:
            if self._growing.count > self._other.count:
                self._growing, self._other = self._other, self._growing
            reached = _extend(self._growing, target, self._check)
            if reached is None:
                continue
            met = _connect(self._other, self._growing.state(reached).copy(), self._check)
            if met is not None:
                here, there = self._growing.branch(reached), self._other.branch(met)
                if self._growing is self._goals:
                    here, there = there, here
                return np.array([*here, *there[-2::-1]])
            self._growing, self._other = self._other, self._growing
        return None


def rrt_connect(
    start: Array,
    goals: list[Array],
    sample: Callable[[int], Array],
    check: MotionCheck,
    expired: Callable[[], bool],
    *,
    further: Iterator[Array | None],
    most: int,
) -> Array | None:
    """Return the waypoints of a path that looks free (m, n); None if none was found.

    Args:
        goals: Joint positions in [rad] (n), free of contact; the path ends at one of them.
        sample: Draws a number of states (m, n).
        further: Yields goals found during the search; None for a try without result.
        most: Number of samples after which the search ends.
    """
    search: Search | CompiledSearch
    if check.compiled is None or check.constraints is not None:
        search = Search(start, check)
    else:
        search = CompiledSearch(check.compiled, start, check.required, MAX_EXTENSION)
    for goal in goals:
        search.add_goal(goal)
    for _ in range(math.ceil(most / BLOCK)):
        if expired():
            break
        another = next(further, None)
        if another is not None and check.admits(another):
            search.add_goal(another)
            goals.append(another)
        places = search.grow(sample(BLOCK))
        if places is not None:
            return places
    return None


def _extend(tree: _Tree, target: Array, check: MotionCheck) -> int | None:
    """Grow a tree by an edge towards a target, and return its end node; None if blocked."""
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
    """Grow a tree by several edges that satisfy the constraints, as in CBiRRT."""
    node, begin = near, tree.state(near).copy()
    while float(np.linalg.norm(target - begin)) >= SAME:
        end = check.towards(begin, target)
        if end is None or not check.clear(begin, end):
            return node if node != near else None
        node, begin = tree.add(end, node), end
    return node


def _connect(tree: _Tree, target: Array, check: MotionCheck) -> int | None:
    """Grow a tree until it reaches a target, and return that node; None if blocked."""
    while True:
        end = _extend(tree, target, check)
        if end is None:
            return None
        if float(np.abs(tree.state(end) - target).max()) < SAME:
            return end


def shortened(
    places: Array, draw: np.random.Generator, check: MotionCheck, expired: Callable[[], bool]
) -> Array:
    """Shorten a path of straight motions, as far as the check allows; the ends stay."""
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
    """Return the path length from the first waypoint to each in [rad] (m)."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.concatenate(((0.0,), np.cumsum(steps)))


def _at(places: Array, along: Array, length: float) -> Array:
    """Return the state at a length along the path."""
    after = min(max(int(np.searchsorted(along, length)), 1), len(places) - 1)
    whole = along[after] - along[after - 1]
    share = (length - along[after - 1]) / whole if whole > 0.0 else 0.0
    place: Array = places[after - 1] + share * (places[after] - places[after - 1])
    return place


def _without_needless(places: Array, check: MotionCheck, expired: Callable[[], bool]) -> Array:
    """Remove waypoints whose neighbours a free straight motion connects."""
    kept = [0]
    while kept[-1] < len(places) - 1:
        here = kept[-1]
        farther = range(len(places) - 1, here + 1, -1)
        seen = (
            each for each in farther if not expired() and check.clear(places[here], places[each])
        )
        kept.append(next(seen, here + 1))
    return places[kept]
