# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads a recording, even an unfinished one.

The reader of rosbags (0.11.9) is no substitute: it reads the files of a split bag one after the
other, so that messages are out of order, keeps all of them open, and silently skips a topic if
metadata.yaml has more QoS profiles of it than a file.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator
import contextlib
from dataclasses import dataclass, replace
import heapq
import itertools
import os
from pathlib import Path
import re
import struct
import tempfile
from typing import IO

from mcap.exceptions import McapError
from mcap.reader import FOOTER_SIZE, make_reader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import MAGIC_SIZE, StreamReader
from mcap.summary import Summary
import zstandard

from .metadata import (
    BagError,
    BagFile,
    BagMetadata,
    load_metadata,
    METADATA_FILE,
    parse_profiles,
    STORAGE,
    Topic,
    TopicCount,
)

# a file that ends in the midst of a record, or has something else in the place of one
_DAMAGE = (McapError, ValueError, LookupError, EOFError, struct.error, zstandard.ZstdError)
_ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'  # CDR begins with 0
_NO_SCHEMA = Schema(id=0, data=b'', encoding='', name='')
_NUMBER = re.compile(r'(\d+)\.mcap(?:\.zstd)?\Z')


@dataclass(frozen=True, slots=True)
class BagMessage:
    """A recorded message; times in [ns since 1970], sequence as numbered by its publisher."""

    topic: str
    data: bytes
    log_time: int
    publish_time: int
    sequence: int


class BagReader:
    """A recording: a folder, or a single MCAP file."""

    def __init__(self, path: Path) -> None:
        """Open a recording.

        Raises:
            BagError: There is no recording, or its storage is not MCAP.
        """
        self.folder = path if path.is_dir() else path.parent
        # whether it has a metadata.yaml; without, its files were read through for it
        self.finished = (path / METADATA_FILE).is_file()
        if self.finished:
            self.metadata = self._with_definitions(load_metadata(path / METADATA_FILE))
        elif path.is_dir():
            self.metadata = scan(path, recording_files(path))
        elif path.is_file():
            self.metadata = scan(self.folder, [path])
        else:
            raise BagError(f"Bag path '{path}' does not exist!")

    def size(self) -> int:
        """Size of all files in [byte]."""
        return sum((self.folder / file.path).stat().st_size for file in self.metadata.files)

    def messages(
        self, topics: Collection[str] | None = None, start: int | None = None
    ) -> Iterator[BagMessage]:
        """Yield the messages of some or all topics in the order in which they were received.

        `start` is the time of the first one in [ns since 1970].
        """
        by_message = self.metadata.compression_mode == 'MESSAGE'
        unpack = zstandard.ZstdDecompressor().decompress if by_message else bytes
        # files of a split overlap a little: a message of another topic may come late
        files = deque(sorted(self.metadata.files, key=lambda file: file.start))
        current: list[tuple[int, int, BagMessage, Iterator[BagMessage]]] = []
        numbers = itertools.count()  # of messages with the same time, the one found first
        while files or current:
            if files and (not current or files[0].start <= current[0][0]):
                found = self._file_messages(files.popleft(), topics, start, unpack)
            else:
                _, _, message, found = heapq.heappop(current)
                yield message
            for message in itertools.islice(found, 1):
                heapq.heappush(current, (message.log_time, next(numbers), message, found))

    def _file_messages(
        self,
        file: BagFile,
        topics: Collection[str] | None,
        start: int | None,
        unpack: Callable[[bytes], bytes],
    ) -> Iterator[BagMessage]:
        if not file.count or (start is not None and file.start + file.duration < start):
            return
        with opened(self.folder / file.path) as stream:
            for channel, message in _in_order(stream, topics, start):
                yield BagMessage(
                    channel.topic,
                    unpack(message.data),
                    message.log_time,
                    message.publish_time,
                    message.sequence,
                )

    def _with_definitions(self, metadata: BagMetadata) -> BagMetadata:
        """Add what the files contain: message definitions, and their own times and counts."""
        if metadata.storage != STORAGE:
            raise BagError(f"{self.folder}: storage '{metadata.storage}'; only MCAP can be read")
        definitions: dict[str, str] = {}
        files: list[BagFile] = []
        for file in metadata.files:
            with opened(self.folder / file.path) as stream:
                summary = _summary(stream)
            if summary is not None:
                definitions |= {each.name: each.data.decode() for each in summary.schemas.values()}
            files.append(_with_statistics(file, summary))
        topics = (
            replace(
                each, topic=replace(each.topic, definition=definitions.get(each.topic.type, ''))
            )
            for each in metadata.topics
        )
        return replace(metadata, files=tuple(files), topics=tuple(topics))


def recording_files(folder: Path) -> list[Path]:
    """Return the files of a recording in order."""
    named = (path for path in folder.iterdir() if _NUMBER.search(path.name))
    # one that is being compressed is there twice, whole where it is not compressed
    by_number = {_number(path): path for path in sorted(named, key=lambda p: p.suffix != '.zstd')}
    found = list(by_number.values())
    if not found:
        raise BagError(f"'{folder}' holds no recording: neither {METADATA_FILE} nor MCAP files")
    return sorted(found, key=lambda path: int(_number(path)))


def _number(path: Path) -> str:
    match = _NUMBER.search(path.name)
    return match[1] if match else '0'


def scan(folder: Path, paths: list[Path]) -> BagMetadata:
    """Rebuild the content of metadata.yaml, with compression, by reading the files."""
    files: list[BagFile] = []
    topics: dict[str, Topic] = {}
    counts: Counter[str] = Counter()
    by_message = False
    for path in paths:
        start = end = count = 0
        with opened(path) as stream:
            for record in records(stream):
                if isinstance(record, Topic):
                    topics[record.name] = record
                    continue
                channel, message = record
                counts[channel.topic] += 1
                by_message = by_message or message.data.startswith(_ZSTD_MAGIC)
                start = min(start, message.log_time) if count else message.log_time
                end, count = max(end, message.log_time), count + 1
        files.append(
            BagFile(str(path.relative_to(folder)), start, end - start if count else 0, count)
        )
    by_file = any(path.suffix == '.zstd' for path in paths)
    return BagMetadata(
        tuple(files),
        tuple(TopicCount(topic, counts[name]) for name, topic in topics.items()),
        'zstd' if by_file or by_message else '',
        'FILE' if by_file else 'MESSAGE' if by_message else '',
    )


def records(stream: IO[bytes]) -> Iterator[Topic | tuple[Channel, Message]]:
    """Yield topics and messages in file order, up to the first damage."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    with contextlib.suppress(*_DAMAGE):
        for record in StreamReader(stream).records:
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel) and record.id not in channels:
                channels[record.id] = record
                yield _topic(record, schemas.get(record.schema_id, _NO_SCHEMA))
            elif isinstance(record, Message):
                yield channels[record.channel_id], record


def _topic(channel: Channel, schema: Schema) -> Topic:
    where = f'topic {channel.topic}'
    return Topic(
        channel.topic,
        schema.name,
        schema.data.decode(),
        channel.metadata.get('topic_type_hash', ''),
        parse_profiles(channel.metadata.get('offered_qos_profiles'), where),
        channel.message_encoding,
    )


def _in_order(
    stream: IO[bytes], topics: Collection[str] | None, start: int | None
) -> Iterator[tuple[Channel, Message]]:
    """Yield messages in order of time: by the index or, without one, sorted in memory."""
    if has_index(stream):
        found = make_reader(stream).iter_messages(topics, starting_at=start)
        yield from ((channel, message) for _, channel, message in found)
        return
    stream.seek(0)
    messages = [record for record in records(stream) if not isinstance(record, Topic)]
    for channel, message in sorted(messages, key=lambda record: record[1].log_time):
        wanted = topics is None or channel.topic in topics
        if wanted and (start is None or message.log_time >= start):
            yield channel, message


def has_index(stream: IO[bytes]) -> bool:
    """Whether a file has an index, so that messages are found by time without reading it all."""
    summary = _summary(stream)
    return summary is not None and bool(summary.chunk_indexes) and bool(summary.channels)


def _summary(stream: IO[bytes]) -> Summary | None:
    """Return the summary at the end of a file; None if it is missing or damaged."""
    if stream.seek(0, os.SEEK_END) < FOOTER_SIZE + MAGIC_SIZE:
        return None  # the library would seek to before the begin
    stream.seek(0)  # where it expects the magic
    try:
        return make_reader(stream).get_summary()
    except _DAMAGE:
        return None


def _with_statistics(file: BagFile, summary: Summary | None) -> BagFile:
    """Set times and count from the file: metadata.yaml has none before version 5."""
    found = summary.statistics if summary is not None else None
    if found is None:
        return file
    start, end = found.message_start_time, found.message_end_time
    return BagFile(file.path, start, end - start, found.message_count)


@contextlib.contextmanager
def opened(path: Path) -> Iterator[IO[bytes]]:
    """Open a file of a recording; decompress one that is compressed as a whole."""
    try:
        source = path.open('rb')
    except OSError as error:
        raise BagError(f"Cannot read '{path}': {error.strerror}") from None
    with source:
        if path.suffix != '.zstd':
            yield source
            return
        with tempfile.TemporaryFile() as unpacked:
            with contextlib.suppress(zstandard.ZstdError):  # cut off: as far as it goes
                zstandard.ZstdDecompressor().copy_stream(source, unpacked)
            unpacked.seek(0)
            yield unpacked
