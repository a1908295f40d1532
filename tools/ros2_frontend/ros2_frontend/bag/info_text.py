# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What `ros2 bag info` prints, in the form of rosbag2."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import time

from .files import BagMetadata

_INDENT = 19
_NANO = 1_000_000_000
_UNITS = ('B', 'KiB', 'MiB', 'GiB', 'TiB')


def info_text(
    metadata: BagMetadata, size: int, sizes: Mapping[str, int] | None = None, sort: str = 'name'
) -> str:
    """The text for a recording.

    Args:
        metadata: What it has.
        size: Size of its files in [byte].
        sizes: Size of the messages of each topic in [byte], for `--verbose`.
        sort: `name`, `type` or `count`.
    """
    end = metadata.start + metadata.duration
    lines = [
        '',
        _block('Files:', [file.path for file in metadata.files]),
        _block('Bag size:', [size_text(size)]),
        _block('Storage id:', [metadata.storage]),
        _block('ROS Distro:', [metadata.distro]),
        _block('Duration:', [f'{_seconds(metadata.duration)}s']),
        _block('Start:', [_moment(metadata.start)]),
        _block('End:', [_moment(end)]),
        _block('Messages:', [str(metadata.count)]),
        _block('Topic information:', list(_topics(metadata, sizes, sort))),
        _block('Service:', ['0']),
        'Service information: ',
    ]
    return '\n'.join(lines)


def size_text(size: int) -> str:
    """A size in the unit that suits it.

    Args:
        size: In [byte].
    """
    value, unit = float(size), 0
    while value >= 1024 and unit < len(_UNITS) - 1:
        value, unit = value / 1024, unit + 1
    return f'{value:.{1 if unit else 0}f} {_UNITS[unit]}'


def _block(title: str, lines: list[str]) -> str:
    return title.ljust(_INDENT) + f'\n{" " * _INDENT}'.join(lines)


def _topics(metadata: BagMetadata, sizes: Mapping[str, int] | None, sort: str) -> Iterator[str]:
    by = {
        'name': lambda each: each.topic.name,
        'type': lambda each: (each.topic.type, each.topic.name),
        'count': lambda each: (each.count, each.topic.name),
    }
    for each in sorted(metadata.topics, key=by[sort]):
        parts = [f'Topic: {each.topic.name}', f'Type: {each.topic.type}', f'Count: {each.count}']
        if sizes is not None:
            parts.append(f'Size Contribution: {size_text(sizes.get(each.topic.name, 0))}')
        yield ' | '.join([*parts, f'Serialization Format: {each.topic.serialization}'])


def _seconds(nanoseconds: int) -> str:
    seconds, rest = divmod(nanoseconds, _NANO)
    return f'{seconds}.{rest:09d}'


def _moment(nanoseconds: int) -> str:
    seconds, rest = divmod(nanoseconds, _NANO)
    day = time.strftime('%b %e %Y %H:%M:%S', time.localtime(seconds))
    return f'{day}.{rest:09d} ({_seconds(nanoseconds)})'
