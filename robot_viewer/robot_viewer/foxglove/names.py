# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which names a bridge shows, by regular expressions that match all of a name."""

from __future__ import annotations

from collections.abc import Iterable
import re

EVERYTHING = '.*'


class NameFilter:
    """Accepts names that one of its expressions matches from begin to end."""

    def __init__(self, patterns: Iterable[str]) -> None:
        """Compile them.

        Raises:
            ValueError: One of them is none; the message has it and the reason.
        """
        self._patterns = [_compiled(pattern) for pattern in patterns]

    def accepts(self, name: str) -> bool:
        """Whether a name is to be shown."""
        return any(pattern.fullmatch(name) for pattern in self._patterns)


def is_hidden(name: str) -> bool:
    """Whether ROS hides a name: a part of it begins with an underscore."""
    return any(part.startswith('_') for part in name.split('/'))


def _compiled(pattern: str) -> re.Pattern[str]:
    try:
        return re.compile(pattern)
    except re.error as error:
        raise ValueError(f'{pattern!r} is no regular expression: {error}') from None
