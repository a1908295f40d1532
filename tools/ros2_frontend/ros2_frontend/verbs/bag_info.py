# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 bag info` and `reindex`."""

from __future__ import annotations

from argparse import Namespace
from collections import Counter
from pathlib import Path

from ..bag.files import bag_errors, open_bag, repair
from ..bag.info_text import info_text
from ..cli.verb import argument, flag, verb

_BAG = argument('bag_path', help='Bag to open')
_STORAGE = argument('-s', '--storage', choices=['mcap'], help='Storage identifier: mcap')


@verb(
    _BAG,
    _STORAGE,
    flag('-t', '--topic-name', help='Only display topic names.'),
    flag('-v', '--verbose', help='Display the size of the messages of each topic, too.'),
    argument('--sort', choices=['name', 'type', 'count'], default='name', help='Order of topics'),
)
def info(args: Namespace) -> None:
    """Print what a recording has.

    Raises:
        FrontendError: When there is none.
    """
    reader = open_bag(args.bag_path)
    if args.topic_name:
        for each in sorted(reader.metadata.topics, key=lambda each: each.topic.name):
            print(each.topic.name)
        return
    sizes: Counter[str] = Counter()
    if args.verbose:
        with bag_errors():
            for message in reader.messages():
                sizes[message.topic] += len(message.data)
    print(info_text(reader.metadata, reader.size(), sizes if args.verbose else None, args.sort))


@verb(_BAG, _STORAGE)
def reindex(args: Namespace) -> None:
    """Finish a recording whose recorder was killed.

    Raises:
        FrontendError: When there is none.
    """
    with bag_errors():
        metadata = repair(Path(args.bag_path))
    print(f'Reindexing complete: {metadata.count} messages in {len(metadata.files)} files.')
