# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shortens paths: straight motions between places on it replace what lies between them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from arm_model import Array

from .motion_check import MotionCheck

MAX_TRIALS = 30  # shortcuts that are tried at most
MAX_FAILURES = 8  # shortcuts that fail in a row before the path counts as short
MIN_GAIN = 0.05  # length that a shortcut saves at least in [rad]


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
    """Leave out places whose neighbours see each other, from the start to the farthest one."""
    kept = [0]
    while kept[-1] < len(places) - 1:
        here = kept[-1]
        farther = range(len(places) - 1, here + 1, -1)
        seen = (
            each for each in farther if not expired() and check.clear(places[here], places[each])
        )
        kept.append(next(seen, here + 1))
    return places[kept]
