# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which links and objects may touch, as in MoveIt's AllowedCollisionMatrix."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from urdf_reader import Pair, SemanticDescription


@dataclass(frozen=True, slots=True)
class AllowedCollisionMatrix:
    """Pairs of links and objects that are not checked, or are checked in any case; immutable.

    An entry of a pair decides. Where there is none, the defaults of its two names do: with one
    default, that; with two, both must allow. Where there are none, the pair is checked.
    """

    # true where a pair may touch, by pair
    entries: Mapping[Pair, bool] = field(default_factory=dict)
    # true where a name may touch anything, by name
    defaults: Mapping[str, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Copy both, so that they cannot change."""
        object.__setattr__(self, 'entries', MappingProxyType(dict(self.entries)))
        object.__setattr__(self, 'defaults', MappingProxyType(dict(self.defaults)))

    @classmethod
    def of_srdf(cls, semantic: SemanticDescription) -> AllowedCollisionMatrix:
        """Return what an SRDF allows; ``disable_collisions`` has the last word, as in MoveIt."""
        entries = dict.fromkeys(semantic.enabled, False) | dict.fromkeys(semantic.disabled, True)
        return cls(entries, dict.fromkeys(semantic.unchecked, True))

    def allows(self, first: str, second: str) -> bool:
        """Whether two links or objects may touch, and are not checked."""
        entry = self.entries.get(frozenset((first, second)))
        if entry is not None:
            return entry
        found = [self.defaults[name] for name in (first, second) if name in self.defaults]
        return bool(found) and all(found)

    def with_entries(self, pairs: Iterable[Pair], allowed: bool) -> AllowedCollisionMatrix:
        """Return the matrix with the same entry for some pairs."""
        return replace(self, entries={**self.entries, **dict.fromkeys(pairs, allowed)})

    def without(self, name: str) -> AllowedCollisionMatrix:
        """Return the matrix without the entries and the default of a name."""
        return AllowedCollisionMatrix(
            {pair: allowed for pair, allowed in self.entries.items() if name not in pair},
            {each: allowed for each, allowed in self.defaults.items() if each != name},
        )
