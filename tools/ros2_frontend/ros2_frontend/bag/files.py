# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings on disk, and files that belong to them, as a command opens them."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import sys

from rosbag_files import BagError, BagReader, OfferedQos, read_qos

from ..cli.errors import FrontendError


@contextlib.contextmanager
def bag_errors() -> Iterator[None]:
    """End the command with the message of a `BagError`."""
    try:
        yield
    except BagError as error:
        raise FrontendError(str(error)) from None


def open_bag(path: str) -> BagReader:
    """Open a recording, a folder or a file; print on stderr when it was not finished."""
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
