# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nearest names for a name that does not exist."""

from __future__ import annotations

from collections.abc import Iterable

_LIMIT = 3
_CUTOFF = 0.6  # likeness below which a name is no likely slip
_SPREAD = 0.12  # names that are this much less like than the best are left out
_INSIDE = 0.8  # likeness of a name that holds the wanted one
_SAME_END = 0.95  # weight of the likeness of the last parts alone


def likeness(wanted: str, known: str) -> float:
    """How much one name is like another.

    Args:
        wanted: What the user typed.
        known: A name that exists.

    Returns:
        0 (nothing in common) to 1 (equal but for case and outer slashes). Names that hold the
        wanted one or end like it count as alike: `init` and `/panda_joint1/init`.
    """
    one, other = wanted.strip('/').lower(), known.strip('/').lower()
    ends = _ratio(one.rpartition('/')[2], other.rpartition('/')[2])
    if '/' in one and ends < _CUTOFF:
        return 0.0  # two services of one node are alike in their beginning only
    inside = _INSIDE if one and one in other else 0.0
    alike = ends * _SAME_END if '/' not in one else 0.0
    return max(_ratio(one, other), inside, alike)


def _ratio(one: str, other: str) -> float:
    from difflib import SequenceMatcher  # only a command that fails needs it

    return SequenceMatcher(None, one, other).ratio()


def nearest(name: str, known: Iterable[str], limit: int = _LIMIT) -> list[str]:
    """The known names that are most like a name, best first.

    Args:
        name: What the user typed.
        known: The names that exist.
        limit: How many to answer at most.

    Returns:
        Up to `limit` names, without repetition; none when nothing is near.
    """
    ranked = sorted((-likeness(name, candidate), candidate) for candidate in set(known))
    best = -ranked[0][0] if ranked else 0.0
    floor = max(_CUTOFF, best - _SPREAD)
    return [candidate for score, candidate in ranked[:limit] if -score >= floor]


def hint(name: str, known: Iterable[str]) -> str:
    """A line that names the nearest alternatives, or nothing.

    Args:
        name: What the user typed.
        known: The names that exist.

    Returns:
        A line feed and `Did you mean ...?`, or an empty text when nothing is near.
    """
    names = [f"'{candidate}'" for candidate in nearest(name, known)]
    if not names:
        return ''
    *head, last = names
    listed = f'{", ".join(head)} or {last}' if head else last
    return f'\nDid you mean {listed}?'
