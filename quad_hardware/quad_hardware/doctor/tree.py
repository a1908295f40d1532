# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which links of a robot the transforms reach."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

ROOT = 'odom'


def links_without_place(links: Iterable[str], parents: Mapping[str, str]) -> list[str]:
    """Return the links that have no chain of transforms from odom."""
    return [link for link in links if not _reaches(link, parents)]


def _reaches(link: str, parents: Mapping[str, str]) -> bool:
    seen: set[str] = set()
    while link != ROOT:
        if link in seen or link not in parents:  # a loop is no way either
            return False
        seen.add(link)
        link = parents[link]
    return True
