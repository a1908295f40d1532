# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 bag info` and `reindex`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from rosbag_files import repair

from ..bag.files import bag_errors, open_bag
from ..bag.info_text import info_text
from ..cli.verb import argument, flag, verb

_BAG = argument('bag_path', help='Bag to open')
_STORAGE = argument('-s', '--storage', choices=['mcap'], help='Storage identifier: mcap')


@verb(_BAG, _STORAGE, flag('-t', '--topic-name', help='Only display topic names.'))
def info(args: Namespace) -> None:
    """Print what a recording has."""
    reader = open_bag(args.bag_path)
    if args.topic_name:
        print(*sorted(each.topic.name for each in reader.metadata.topics), sep='\n')
    else:
        print(info_text(reader.metadata, reader.size()))


@verb(_BAG, _STORAGE)
def reindex(args: Namespace) -> None:
    """Finish a recording whose recorder was killed."""
    with bag_errors():
        metadata = repair(Path(args.bag_path))
    print(f'Reindexing complete: {metadata.count} messages in {len(metadata.files)} files.')
