# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is written is read again: by us, and by implementations that are not ours."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import resource
import tempfile
from typing import Any

from hypothesis import given, settings, strategies
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.interfaces import ConnectionExtRosbag2, QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from sample_bag import add, COUNT, EPOCH, message, plain, read_by_rosbags, SECOND, TEXT, write
import yaml

from rosbag_files import (
    BagError,
    BagMessage,
    BagReader,
    BagWriter,
    METADATA_FILE,
    Preset,
    WriterOptions,
)
from rosbag_files.reader import has_index

TIMES = strategies.integers(min_value=0, max_value=2**62)
MESSAGES = strategies.lists(
    strategies.builds(
        BagMessage,
        strategies.sampled_from([TEXT.name, COUNT.name]),
        strategies.binary(max_size=300).map(lambda data: b'\0\1\0\0' + data),
        TIMES,
        TIMES,
        strategies.integers(min_value=0, max_value=2**32 - 1),
    ),
    max_size=30,
)


def by_time(messages: Sequence[BagMessage]) -> list[BagMessage]:
    """Sort as a player wants them."""
    return sorted(messages, key=lambda each: each.log_time)


@settings(deadline=None)
@given(MESSAGES, strategies.sampled_from(Preset), strategies.sampled_from([0, 500]))
def test_every_message_comes_back(
    messages: list[BagMessage], preset: Preset, max_size: int
) -> None:
    """All bytes, times and numbers, with every way to write them, in one file or several."""
    options = WriterOptions(max_size=max_size, preset=preset)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, 'bag')
        write(path, messages, options)
        reader = BagReader(path)
        assert reader.metadata.count == len(messages)
        found = list(reader.messages())
        assert [each.log_time for each in found] == sorted(each.log_time for each in messages)
        key = repr
        assert sorted(found, key=key) == sorted(messages, key=key)


@pytest.mark.parametrize('preset', [Preset.NONE, Preset.ZSTD_FAST, Preset.ZSTD_SMALL])
def test_rosbags_reads_it(tmp_path: Path, preset: Preset) -> None:
    """Split in files; topics, types, hashes, QoS and definitions, too."""
    messages = [message(number, (TEXT, COUNT)[number % 2]) for number in range(200)]
    options = WriterOptions(max_duration=SECOND, preset=preset)
    write(tmp_path / 'bag', messages, options)
    assert read_by_rosbags(tmp_path / 'bag') == plain(messages)
    topics = BagReader(tmp_path / 'bag').metadata.topics  # definitions are in the files alone
    assert {each.topic.definition for each in topics} == {TEXT.definition, COUNT.definition}
    with Reader(tmp_path / 'bag') as reader:
        assert reader.message_count == 200
        assert reader.start_time == EPOCH
        assert reader.ros_distro == 'jazzy'
        topic = reader.topics[TEXT.name]
        assert (topic.msgtype, topic.msgcount) == (TEXT.type, 100)
        (connection,) = (each for each in reader.connections if each.topic == TEXT.name)
        assert connection.digest == TEXT.type_hash
        assert connection.msgdef.data == TEXT.definition
        assert isinstance(connection.ext, ConnectionExtRosbag2)
        first, second = connection.ext.offered_qos_profiles
        assert first.durability == QosDurability.TRANSIENT_LOCAL
        assert second.reliability == QosReliability.BEST_EFFORT
        assert (second.lifespan.sec, second.lifespan.nsec) == (0, 5)


def test_mcap_ros2_decodes_it(tmp_path: Path) -> None:
    """A file stands for itself: it carries the definitions of its messages."""
    messages = [message(number) for number in range(50)]
    write(tmp_path / 'bag', messages)
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages())
    assert [each.decoded_message.data for each in found] == [f'message {n}' for n in range(50)]
    assert [each.message.sequence for each in found] == [n + 1 for n in range(50)]


def test_metadata_of_a_split_recording(tmp_path: Path) -> None:
    """Each file has its own start, duration and count; together they are the recording's."""
    write(tmp_path / 'bag', [message(n) for n in range(250)], WriterOptions(max_duration=SECOND))
    text = (tmp_path / 'bag' / METADATA_FILE).read_text()
    information = yaml.safe_load(text)['rosbag2_bagfile_information']
    assert information['version'] == 9
    assert information['relative_file_paths'] == [f'bag_{n}.mcap' for n in range(3)]
    assert [each['message_count'] for each in information['files']] == [100, 100, 50]
    starts = [each['starting_time']['nanoseconds_since_epoch'] for each in information['files']]
    assert starts == [EPOCH + n * SECOND for n in range(3)]
    assert information['duration']['nanoseconds'] == 249 * SECOND // 100
    assert information['message_count'] == 250


def test_a_size_limit_counts_what_is_not_on_disk_yet(tmp_path: Path) -> None:
    """Far below a chunk."""
    write(tmp_path / 'bag', [message(n) for n in range(100)], WriterOptions(max_size=2000))
    counts = [file.count for file in BagReader(tmp_path / 'bag').metadata.files]
    assert sum(counts) == 100
    assert max(counts) < 50
    assert len(counts) > 2


def test_topics_and_start_are_chosen(tmp_path: Path) -> None:
    """What comes before is left out, whatever file it is in."""
    messages = [message(number, (TEXT, COUNT)[number % 2]) for number in range(300)]
    write(tmp_path / 'bag', messages, WriterOptions(max_duration=SECOND))
    start = EPOCH + 3 * SECOND // 2
    found = list(BagReader(tmp_path / 'bag').messages({COUNT.name}, start))
    assert found == [each for each in messages[150:] if each.topic == COUNT.name]


def test_messages_of_two_files_come_in_order(tmp_path: Path) -> None:
    """One of the first file may be later than one of the second."""
    times = [0, 3 * SECOND // 2, 2 * SECOND, SECOND]
    messages = [message(n, log_time=EPOCH + time) for n, time in enumerate(times)]
    write(tmp_path / 'bag', messages, WriterOptions(max_duration=2 * SECOND))
    reader = BagReader(tmp_path / 'bag')
    assert len(reader.metadata.files) == 2
    assert list(reader.messages()) == by_time(messages)


def test_more_files_than_a_process_may_open(tmp_path: Path) -> None:
    """A long recording is split into many; only those that overlap are open at the same time."""
    messages = [message(number) for number in range(100)]
    write(tmp_path / 'bag', messages, WriterOptions(max_duration=SECOND // 100))
    reader = BagReader(tmp_path / 'bag')
    assert len(reader.metadata.files) == 100
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    with Path('/dev/null').open() as lowest:
        free = lowest.fileno()
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (free + 20, limits[1]))
        assert list(reader.messages()) == messages
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)


def test_metadata_before_version_5(tmp_path: Path) -> None:
    """It lists no file with its own times: the files say them."""
    messages = [message(number) for number in range(250)]
    write(tmp_path / 'bag', messages, WriterOptions(max_duration=SECOND))
    path = tmp_path / 'bag' / METADATA_FILE
    document = yaml.safe_load(path.read_text())
    information = document['rosbag2_bagfile_information']
    information['version'] = 4
    del information['files']
    path.write_text(yaml.safe_dump(document))
    reader = BagReader(tmp_path / 'bag')
    assert [file.count for file in reader.metadata.files] == [100, 100, 50]
    assert list(reader.messages()) == messages
    assert list(reader.messages(start=messages[200].log_time)) == messages[200:]


@pytest.mark.parametrize('options', [{}, {'repeat_channels': False}, {'use_chunking': False}])
def test_files_of_other_writers(options: dict[str, Any], tmp_path: Path) -> None:
    """With an index, with one that names no channel, and with none; the first is read by it."""
    path = tmp_path / 'other_0.mcap'
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=100, **options)
        writer.start('ros2')
        schema = writer.register_schema(TEXT.type, 'ros2msg', TEXT.definition.encode())
        channel = writer.register_channel(TEXT.name, 'cdr', schema)
        for number in range(20):
            each = message(number)
            writer.add_message(channel, each.log_time, each.data, each.publish_time, each.sequence)
        writer.finish()  # type: ignore[no-untyped-call]
    assert list(BagReader(path).messages()) == [message(number) for number in range(20)]
    with path.open('rb') as stream:
        assert has_index(stream) == (not options)


def test_an_existing_folder_is_not_touched(tmp_path: Path) -> None:
    """No recording replaces another."""
    with pytest.raises(BagError, match='already exists'):
        BagWriter(tmp_path)


def test_more_of_a_topic_is_learned(tmp_path: Path) -> None:
    """A second publisher with other QoS."""
    writer = BagWriter(tmp_path / 'bag')
    writer.set_topic(COUNT)
    add(writer, [message(0)])
    writer.set_topic(TEXT)
    metadata = writer.close()
    assert [each.topic.name for each in metadata.topics] == [COUNT.name, TEXT.name]
    assert [each.count for each in metadata.topics] == [0, 1]
