# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finishes a recording that was not: after a kill, or a power failure."""

from __future__ import annotations

from pathlib import Path

from .metadata import BagMetadata, Topic
from .reader import has_index, opened, recording_files, records, scan
from .writer import McapFile, Preset


def repair(folder: Path) -> BagMetadata:
    """Write metadata.yaml of a folder, and the index of files that have none.

    A file without an index is written anew up to where it is damaged, and then takes the place of
    the old one.

    Raises:
        BagError: The folder holds no recording.
    """
    paths = recording_files(folder)
    for path in paths:
        if path.suffix == '.mcap':
            _add_index(folder, path)
    metadata = scan(folder, paths)
    metadata.save(folder)
    return metadata


def _add_index(folder: Path, path: Path) -> None:
    with opened(path) as stream:
        if has_index(stream):
            return
        stream.seek(0)
        whole = path.with_name(f'.{path.name}.part')
        whole.unlink(missing_ok=True)
        file = McapFile(whole, Preset.NONE)
        for record in records(stream):
            if isinstance(record, Topic):
                file.add_topic(record)
                continue
            channel, message = record
            file.write(
                channel.topic,
                message.data,
                message.log_time,
                message.publish_time,
                message.sequence,
            )
    found = scan(folder, [path])
    file.close(found.to_yaml())
    whole.replace(path)
