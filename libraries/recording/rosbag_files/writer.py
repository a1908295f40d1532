# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writes a recording: a folder with MCAP files and, at its end, metadata.yaml.

Data stays readable after `BagWriter.flush`, even if the process is killed: a chunk of MCAP holds
its schemas, channels and messages. After a kill or a power failure, only the index at the end of
the file and metadata.yaml are missing; `BagReader` does not need them, and `repair` adds them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
import contextlib
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from mcap.writer import CompressionType, Writer
import yaml

from .metadata import BagError, BagFile, BagMetadata, Topic, TopicCount
from .reader import has_index, opened, recording_files, records, scan

_MESSAGE_OVERHEAD = 31  # [byte] of a message record of MCAP besides its data
_CHUNK = 768 * 1024  # [byte], as rosbag2 has it
_LARGE_CHUNK = 4 * 1024 * 1024  # [byte]
_SEQUENCES = 2**32
_LIBRARY = 'rosbag_files'


class Preset(Enum):
    """Compression and index settings, as of rosbag2's `--storage-preset-profile`."""

    NONE = 'none'  # chunks with an index, not compressed
    FAST_WRITE = 'fastwrite'  # no chunks, no index
    ZSTD_FAST = 'zstd_fast'  # compressed chunks
    ZSTD_SMALL = 'zstd_small'  # large compressed chunks


@dataclass(frozen=True, slots=True)
class WriterOptions:
    """How to write a recording."""

    max_size: int = 0  # size in [byte] from which a new file begins; 0 for no limit
    max_duration: int = 0  # duration in [ns] from which a new file begins; 0 for no limit
    preset: Preset = Preset.NONE  # how MCAP files are written
    distro: str = 'jazzy'  # the ROS that is recorded
    custom: Mapping[str, str] | None = None  # what the user writes down with it


class BagWriter:
    """Writes one recording; `close` it at the end. A failed write raises a BagError."""

    def __init__(self, folder: Path, options: WriterOptions | None = None) -> None:
        """Create the folder and its first file.

        Raises:
            BagError: The folder exists, or cannot be created.
        """
        self.folder = folder
        self._options = options or WriterOptions()
        self._topics: dict[str, Topic] = {}
        self._counts: Counter[str] = Counter()
        self._done: list[BagFile] = []
        with _errors(folder):
            try:
                folder.mkdir(parents=True)
            except FileExistsError:
                raise BagError(f"Output folder '{folder}' already exists.") from None
            self._file = self._open()

    def set_topic(self, topic: Topic) -> None:
        """Register a topic before its first message, or update a registered one.

        An update changes the QoS profiles in metadata.yaml and in the next file.
        """
        if topic.name not in self._topics:
            with _errors(self._file.path):
                self._file.add_topic(topic)
        self._topics[topic.name] = topic

    def write(
        self, name: str, data: bytes, log_time: int, publish_time: int, sequence: int = 0
    ) -> None:
        """Add a serialized message of a registered topic.

        It was received at `log_time` and published at `publish_time` in [ns since 1970]; MCAP
        keeps 32 bits of the publisher's sequence number.
        """
        with _errors(self._file.path):
            if self._is_full(log_time):
                self._finish_file()
                self._file = self._open()
            self._file.write(name, data, log_time, publish_time, sequence % _SEQUENCES)
        self._counts[name] += 1

    def flush(self) -> None:
        """Write everything to the operating system, so that it survives a kill of this process."""
        with _errors(self._file.path):
            self._file.flush()

    def close(self) -> BagMetadata:
        """Finish the last file and write metadata.yaml."""
        with _errors(self.folder):
            self._finish_file()
            metadata = self._metadata(self._done)
            metadata.save(self.folder)
        return metadata

    def _is_full(self, log_time: int) -> bool:
        options, file = self._options, self._file
        if not file.count:
            return False
        long = options.max_duration and log_time - file.start >= options.max_duration
        return bool(long) or bool(options.max_size and file.size() >= options.max_size)

    def _open(self) -> McapFile:
        path = self.folder / f'{self.folder.name}_{len(self._done)}.mcap'
        file = McapFile(path, self._options.preset)
        for topic in self._topics.values():
            file.add_topic(topic)
        return file

    def _finish_file(self) -> None:
        file = self._file
        found = BagFile(file.path.name, file.start, file.duration, file.count)
        file.close(self._metadata([found], file.counts).to_yaml())
        self._done.append(found)

    def _metadata(
        self, files: list[BagFile], counts: Mapping[str, int] | None = None
    ) -> BagMetadata:
        counts = self._counts if counts is None else counts
        topics = [TopicCount(topic, counts.get(name, 0)) for name, topic in self._topics.items()]
        options = self._options
        return BagMetadata(
            tuple(files), tuple(topics), distro=options.distro, custom=options.custom
        )


@contextlib.contextmanager
def _errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BagError(f"Cannot write to '{path}': {error.strerror}") from None


class McapFile:
    """One MCAP file with rosbag2's profile."""

    def __init__(self, path: Path, preset: Preset) -> None:
        self.path = path
        self.start = 0  # earliest time in it in [ns]
        self.counts: Counter[str] = Counter()  # how many messages of each topic there are
        self._end = 0
        self._stream = path.open('xb')
        compressed = preset in {Preset.ZSTD_FAST, Preset.ZSTD_SMALL}
        self._mcap = Writer(
            self._stream,
            chunk_size=_LARGE_CHUNK if preset is Preset.ZSTD_SMALL else _CHUNK,
            compression=CompressionType.ZSTD if compressed else CompressionType.NONE,
            use_chunking=preset is not Preset.FAST_WRITE,
        )
        self._mcap.start('ros2', _LIBRARY)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._written = 0  # [byte] that the stream had at the last message
        self._pending = 0  # [byte] of messages that are in no chunk yet

    @property
    def count(self) -> int:
        """Number of messages."""
        return self.counts.total()

    @property
    def duration(self) -> int:
        """Time from the earliest message to the latest in [ns]."""
        return self._end - self.start

    def size(self) -> int:
        """Size in [byte], including the unfinished chunk."""
        return self._stream.tell() + self._pending  # codespell:ignore

    def add_topic(self, topic: Topic) -> None:
        """Register a topic, and its message type if it is new."""
        if topic.type not in self._schemas:
            encoding = 'ros2msg' if topic.definition else ''
            self._schemas[topic.type] = self._mcap.register_schema(
                topic.type, encoding, topic.definition.encode()
            )
        self._channels[topic.name] = self._mcap.register_channel(
            topic.name,
            topic.serialization,
            self._schemas[topic.type],
            {
                'offered_qos_profiles': yaml.safe_dump(topic.qos_dicts(), sort_keys=False),
                'topic_type_hash': topic.type_hash,
            },
        )

    def write(
        self, name: str, data: bytes, log_time: int, publish_time: int, sequence: int
    ) -> None:
        """Add a message."""
        first = not self.counts
        self.start = log_time if first else min(self.start, log_time)
        self._end = log_time if first else max(self._end, log_time)
        self._mcap.add_message(self._channels[name], log_time, data, publish_time, sequence)
        self.counts[name] += 1
        written = self._stream.tell()  # codespell:ignore
        self._pending = (
            self._pending + len(data) + _MESSAGE_OVERHEAD if written == self._written else 0
        )
        self._written = written

    def flush(self) -> None:
        """End the chunk."""
        self._mcap.flush()
        self._written, self._pending = self._stream.tell(), 0  # codespell:ignore

    def close(self, metadata: str) -> None:
        """Write the index."""
        with self._stream:
            self._mcap.add_metadata('rosbag2', {'serialized_metadata': metadata})
            self._mcap.finish()


def repair(folder: Path) -> BagMetadata:
    """Write metadata.yaml of a folder, and the missing indices of its files.

    A file without an index is rewritten up to the first damage, and then replaces the old one.

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
