# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which topics are recorded, or played."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
import re

from ..cli.errors import FrontendError
from ..names import absolute, is_hidden

Accepts = Callable[[str, str], bool]
"""Whether a topic, by its name and type, is chosen."""


def topic_filter(args: Namespace, everything: bool, hidden: bool) -> Accepts:
    """Make the filter of a command line as rosbag2 does: what is chosen, less what is excluded.

    Args:
        args: With the arguments `topics`, `regex`, `exclude_regex`, `exclude_topics`, and perhaps
            `topic_types` and `exclude_topic_types`.
        everything: Whether all topics are chosen.
        hidden: Whether hidden topics count; one that is chosen by name counts anyway.

    Raises:
        FrontendError: A regular expression is none.
    """
    topics, excluded = (set(map(absolute, names)) for names in (args.topics, args.exclude_topics))
    types = getattr(args, 'topic_types', ())
    excluded_types = getattr(args, 'exclude_topic_types', ())
    regex, excluded_regex = _pattern(args.regex), _pattern(args.exclude_regex)

    def accepts(name: str, type_: str) -> bool:
        if name in excluded or type_ in excluded_types:
            return False
        if excluded_regex is not None and excluded_regex.search(name):
            return False
        if name in topics:
            return True
        if not hidden and is_hidden(name):
            return False
        if everything or type_ in types:
            return True
        return regex is not None and regex.search(name) is not None

    return accepts


def _pattern(text: str) -> re.Pattern[str] | None:
    if not text:
        return None
    try:
        return re.compile(text)
    except re.error as error:
        raise FrontendError(f"'{text}' is no regular expression: {error}") from None
