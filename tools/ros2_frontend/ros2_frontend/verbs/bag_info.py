# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 bag info` and `reindex`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
import time

from rosbag_files import BagMetadata, repair

from ..bag import bag_errors, open_bag, STORAGE
from ..cli.commands import argument, flag, verb

_INDENT = 19
_NANO = 1_000_000_000
_UNITS = ('B', 'KiB', 'MiB', 'GiB', 'TiB')

_BAG = argument('bag_path', help='Bag to open')


def info_text(metadata: BagMetadata, size: int) -> str:
    """Return the text of `info` for a recording with a total size in [byte]."""
    topics = [
        f'Topic: {each.topic.name} | Type: {each.topic.type} | Count: {each.count} | '
        f'Serialization Format: {each.topic.serialization}'
        for each in sorted(metadata.topics, key=lambda each: each.topic.name)
    ]
    lines = [
        '',
        _block('Files:', [file.path for file in metadata.files]),
        _block('Bag size:', [size_text(size)]),
        _block('Storage id:', [metadata.storage]),
        _block('ROS Distro:', [metadata.distro]),
        _block('Duration:', [f'{_seconds(metadata.duration)}s']),
        _block('Start:', [_moment(metadata.start)]),
        _block('End:', [_moment(metadata.start + metadata.duration)]),
        _block('Messages:', [str(metadata.count)]),
        _block('Topic information:', topics),
        _block('Service:', ['0']),
        'Service information: ',
    ]
    return '\n'.join(lines)


def size_text(size: int) -> str:
    """Format a size in [byte] with a suitable unit."""
    value, unit = float(size), 0
    while value >= 1024 and unit < len(_UNITS) - 1:
        value, unit = value / 1024, unit + 1
    return f'{value:.{1 if unit else 0}f} {_UNITS[unit]}'


def _block(title: str, lines: list[str]) -> str:
    return title.ljust(_INDENT) + f'\n{" " * _INDENT}'.join(lines)


def _seconds(nanoseconds: int) -> str:
    seconds, rest = divmod(nanoseconds, _NANO)
    return f'{seconds}.{rest:09d}'


def _moment(nanoseconds: int) -> str:
    seconds, rest = divmod(nanoseconds, _NANO)
    day = time.strftime('%b %e %Y %H:%M:%S', time.localtime(seconds))
    return f'{day}.{rest:09d} ({_seconds(nanoseconds)})'


@verb(_BAG, STORAGE, flag('-t', '--topic-name', help='Only display topic names.'))
def info(args: Namespace) -> None:
    """Print the summary of a recording."""
    reader = open_bag(args.bag_path)
    if args.topic_name:
        print(*sorted(each.topic.name for each in reader.metadata.topics), sep='\n')
    else:
        print(info_text(reader.metadata, reader.size()))


@verb(_BAG, STORAGE)
def reindex(args: Namespace) -> None:
    """Finish a recording whose recorder was killed."""
    with bag_errors():
        metadata = repair(Path(args.bag_path))
    print(f'Reindexing complete: {metadata.count} messages in {len(metadata.files)} files.')
