# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which topics are recorded, or played."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import dataclass
import re

from ..cli.errors import FrontendError


@dataclass(frozen=True, slots=True)
class TopicFilter:
    """Chooses topics as rosbag2 does: what is chosen, less what is excluded.

    Attributes:
        everything: Whether all topics are chosen.
        topics: Chosen names.
        types: Chosen types.
        regex: Chooses names in which it is found; None for none.
        excluded_topics: Names that are left out.
        excluded_types: Types that are left out.
        excluded_regex: Leaves out names in which it is found; None for none.
        hidden: Whether names with a part that starts with an underscore count; one that is
            chosen by name counts anyway.
    """

    everything: bool = False
    topics: frozenset[str] = frozenset()
    types: frozenset[str] = frozenset()
    regex: re.Pattern[str] | None = None
    excluded_topics: frozenset[str] = frozenset()
    excluded_types: frozenset[str] = frozenset()
    excluded_regex: re.Pattern[str] | None = None
    hidden: bool = False

    def accepts(self, name: str, type_: str) -> bool:
        """Whether a topic is chosen."""
        if name in self.excluded_topics or type_ in self.excluded_types:
            return False
        if self.excluded_regex is not None and self.excluded_regex.search(name):
            return False
        if name in self.topics:
            return True
        if not self.hidden and any(part.startswith('_') for part in name.split('/')):
            return False
        if self.everything or type_ in self.types:
            return True
        return self.regex is not None and self.regex.search(name) is not None


def topic_filter(args: Namespace, everything: bool, hidden: bool) -> TopicFilter:
    """Make the filter of a command line.

    Args:
        args: With the arguments `topics`, `regex`, `exclude_regex`, `exclude_topics`, and perhaps
            `topic_types` and `exclude_topic_types`.
        everything: Whether all topics are chosen.
        hidden: Whether hidden topics count.

    Raises:
        FrontendError: A regular expression is none.
    """
    return TopicFilter(
        everything,
        frozenset(_absolute(name) for name in args.topics),
        frozenset(getattr(args, 'topic_types', ())),
        _pattern(args.regex),
        frozenset(_absolute(name) for name in args.exclude_topics),
        frozenset(getattr(args, 'exclude_topic_types', ())),
        _pattern(args.exclude_regex),
        hidden,
    )


def _absolute(name: str) -> str:
    return name if name.startswith('/') else f'/{name}'


def _pattern(text: str) -> re.Pattern[str] | None:
    if not text:
        return None
    try:
        return re.compile(text)
    except re.error as error:
        raise FrontendError(f"'{text}' is no regular expression: {error}") from None
