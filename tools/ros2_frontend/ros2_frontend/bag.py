# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Opens recordings for a command, and selects their topics."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
import contextlib
from pathlib import Path
import re
import sys

from rosbag_files import BagError, BagReader, OfferedQos, read_qos

from .cli.commands import argument, FrontendError
from .names import absolute, is_hidden

Accepts = Callable[[str, str], bool]  # whether a topic, by its name and type, is chosen

STORAGE = argument(
    '-s', '--storage', default='mcap', choices=['mcap'], help='Storage identifier: mcap'
)
CHOICE = (
    argument('--topics', default=[], metavar='Topic', nargs='+', help='Topics to choose.'),
    argument('-e', '--regex', default='', help='Choose topics with this regular expression.'),
    argument(
        '-x',
        '--exclude-regex',
        '--exclude',
        default='',
        help='Leave out topics with this regular expression.',
    ),
    argument(
        '--exclude-topics', default=[], metavar='Topic', nargs='+', help='Topics to leave out.'
    ),
    argument(
        '--qos-profile-overrides-path',
        metavar='FILE',
        help='YAML file with QoS profiles for specific topics.',
    ),
)
"""Options that select topics, from the graph or a recording."""


@contextlib.contextmanager
def bag_errors() -> Iterator[None]:
    """Convert a `BagError` in the block to a `FrontendError` with its message."""
    try:
        yield
    except BagError as error:
        raise FrontendError(str(error)) from None


def open_bag(path: str) -> BagReader:
    """Open a recording, a folder or a file; report an unfinished one on stderr."""
    with bag_errors():
        reader = BagReader(Path(path))
    if not reader.finished and Path(path).is_dir():
        print(
            f"'{path}' was not finished: metadata.yaml is missing, what was written is there. "
            f'"ros2 bag reindex {path}" finishes it.',
            file=sys.stderr,
        )
    return reader


def load_overrides(path: str | None) -> dict[str, OfferedQos]:
    """Read a file with QoS profiles by topic; None for no overrides.

    Raises:
        FrontendError: The file cannot be read, or has entries unknown in QoS profiles.
    """
    if path is None:
        return {}
    import yaml

    try:
        document = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise FrontendError(f'{path}: {error}') from None
    if not isinstance(document, dict):
        raise FrontendError(f'{path}: expected QoS profiles by topic, found {document!r}')
    with bag_errors():
        return {
            str(name): read_qos(values, f'{path}: {name}') for name, values in document.items()
        }


def topic_filter(args: Namespace, everything: bool, hidden: bool) -> Accepts:
    """Make the topic filter of a command line as in rosbag2: selected less excluded topics.

    `everything` selects all topics; hidden ones only with `hidden`, or by their names.

    Raises:
        FrontendError: A regular expression is malformed.
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
