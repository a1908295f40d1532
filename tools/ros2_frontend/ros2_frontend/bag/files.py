# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings on disk, by the package `rosbag_files` of this checkout.

It need not be built, as `ros2` itself need not be.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import sys

from ..cli.errors import FrontendError

sys.path.append(str(Path(__file__).resolve().parents[4] / 'libraries' / 'rosbag_files'))

from rosbag_files import (
    BagError,
    BagMessage,
    BagMetadata,
    BagReader,
    BagWriter,
    Compression,
    OfferedQos,
    Preset,
    read_qos,
    repair,
    Topic,
    UNLIMITED,
    WriterOptions,
)

__all__ = [
    'UNLIMITED',
    'BagError',
    'BagMessage',
    'BagMetadata',
    'BagReader',
    'BagWriter',
    'Compression',
    'OfferedQos',
    'Preset',
    'Topic',
    'WriterOptions',
    'bag_errors',
    'load_overrides',
    'open_bag',
    'repair',
]


@contextlib.contextmanager
def bag_errors() -> Iterator[None]:
    """End the command with the message of a `BagError`.

    Raises:
        FrontendError: In its place.
    """
    try:
        yield
    except BagError as error:
        raise FrontendError(str(error)) from None


def open_bag(path: str) -> BagReader:
    """Open a recording; print on stderr when it was not finished.

    Args:
        path: Its folder, or one of its files.

    Raises:
        FrontendError: There is none.
    """
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
    """Read a file with QoS profiles by topic.

    Args:
        path: The file; None for no overrides.

    Raises:
        FrontendError: It cannot be read, or has what no QoS profile has.
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
