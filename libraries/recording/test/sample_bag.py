# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A recording for the tests, and what others read in one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rosbags.rosbag2 import Reader

from rosbag_files import BagMessage, BagWriter, OfferedQos, Topic, WriterOptions

TEXT = Topic(
    '/text',
    'std_msgs/msg/String',
    'string data\n',
    'RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18',
    (OfferedQos(durability='transient_local'), OfferedQos(reliability='best_effort', lifespan=5)),
)
COUNT = Topic('/count', 'std_msgs/msg/UInt8', 'uint8 data\n', 'RIHS01_' + '0' * 64)
SECOND = 1_000_000_000
EPOCH = 1_700_000_000 * SECOND


def text(data: str) -> bytes:
    """Return a String as CDR."""
    encoded = data.encode() + b'\0'
    return b'\0\1\0\0' + len(encoded).to_bytes(4, 'little') + encoded


def message(number: int, topic: Topic = TEXT, log_time: int | None = None) -> BagMessage:
    """Return the message of a number, one each 10 ms."""
    moment = EPOCH + number * SECOND // 100 if log_time is None else log_time
    return BagMessage(topic.name, text(f'message {number}'), moment, moment - 1000, number + 1)


def write(
    folder: Path, messages: Sequence[BagMessage], options: WriterOptions | None = None
) -> None:
    """Write a recording of both topics."""
    writer = BagWriter(folder, options)
    add(writer, messages)
    writer.close()


def add(writer: BagWriter, messages: Sequence[BagMessage]) -> None:
    """Write both topics and messages."""
    for topic in (TEXT, COUNT):
        writer.set_topic(topic)
    for each in messages:
        writer.write(each.topic, each.data, each.log_time, each.publish_time, each.sequence)


def read_by_rosbags(folder: Path) -> list[tuple[str, int, bytes]]:
    """Return what an implementation that is not ours reads: topic, time, bytes."""
    with Reader(folder) as reader:
        return [(each.topic, time, data) for each, time, data in reader.messages()]


def plain(messages: Sequence[BagMessage]) -> list[tuple[str, int, bytes]]:
    """Return messages as `read_by_rosbags` does."""
    return [(each.topic, each.log_time, each.data) for each in messages]
