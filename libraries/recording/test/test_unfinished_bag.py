# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A recorder that was killed: what was flushed is read, and can be finished."""

from __future__ import annotations

from pathlib import Path
import shutil

from hypothesis import example, given, settings, strategies
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from sample_bag import add, message, plain, read_by_rosbags, TEXT, write

from rosbag_files import (
    BagError,
    BagReader,
    BagWriter,
    METADATA_FILE,
    Preset,
    repair,
    WriterOptions,
)
from rosbag_files.reader import recording_files

MESSAGES = [message(number) for number in range(100)]


def killed(folder: Path) -> Path:
    """Write a recording that ends without its end; the last ten messages were not flushed."""
    writer = BagWriter(folder / 'open')
    add(writer, MESSAGES[:50])
    for part in (MESSAGES[50:90], MESSAGES[90:]):
        writer.flush()
        for each in part:
            writer.write(each.topic, each.data, each.log_time, each.publish_time, each.sequence)
    return Path(shutil.copytree(folder / 'open', folder / 'bag'))


def test_what_was_flushed_is_read_and_can_be_finished(tmp_path: Path) -> None:
    """Without metadata.yaml and without an index; then others read it as any other."""
    folder = killed(tmp_path)
    reader = BagReader(folder)
    assert not reader.finished
    assert reader.metadata.count == 90
    assert list(reader.messages()) == MESSAGES[:90]
    assert reader.metadata.topics[0].topic.qos[0].durability == 'transient_local'
    assert repair(folder).count == 90
    assert BagReader(folder).finished
    assert read_by_rosbags(folder) == plain(MESSAGES[:90])
    assert list(BagReader(folder).messages()) == MESSAGES[:90]


@settings(deadline=None, max_examples=40)
@example(0.002, Preset.NONE)  # shorter than the end of a file
@given(strategies.floats(min_value=0.0, max_value=1.0), strategies.sampled_from(Preset))
def test_a_file_cut_anywhere(
    tmp_path_factory: pytest.TempPathFactory, part: float, preset: Preset
) -> None:
    """Never an error: its beginning is there, whole chunk by whole chunk."""
    tmp_path = tmp_path_factory.mktemp('cut')
    write(tmp_path / 'bag', MESSAGES, WriterOptions(preset=preset))
    file = tmp_path / 'bag' / 'bag_0.mcap'
    data = file.read_bytes()
    file.write_bytes(data[: round(len(data) * part)])
    (tmp_path / 'bag' / METADATA_FILE).unlink()
    found = list(BagReader(tmp_path / 'bag').messages())
    assert found == MESSAGES[: len(found)]
    assert repair(tmp_path / 'bag').count == len(found)
    assert list(BagReader(tmp_path / 'bag').messages()) == found


@pytest.mark.parametrize('finished', [True, False])
@pytest.mark.parametrize('mode', [CompressionMode.MESSAGE, CompressionMode.FILE])
def test_compressed_by_others(tmp_path: Path, mode: CompressionMode, finished: bool) -> None:
    """By message or by file; nothing but metadata.yaml says that messages are."""
    writer = Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection(TEXT.name, TEXT.type, msgdef=TEXT.definition, rihs01='x')
        for each in MESSAGES:
            writer.write(topic, each.log_time, each.data)
    (file,) = (path for path in (tmp_path / 'bag').iterdir() if path.name != METADATA_FILE)
    if not finished:
        file.rename(file.with_name(file.name.replace('bag', 'bag_0')))
        (tmp_path / 'bag' / METADATA_FILE).unlink()
    found = BagReader(tmp_path / 'bag').messages()
    assert [(each.topic, each.log_time, each.data) for each in found] == plain(MESSAGES)


def test_a_single_file_is_a_recording(tmp_path: Path) -> None:
    """As every tool that opens MCAP files has it."""
    write(tmp_path / 'bag', MESSAGES)
    assert list(BagReader(tmp_path / 'bag' / 'bag_0.mcap').messages()) == MESSAGES


@pytest.mark.parametrize(
    ('text', 'problem'),
    [
        ('', 'not the metadata of a recording'),
        ('[', 'metadata.yaml'),
        ('rosbag2_bagfile_information: {version: 10}', 'version 10; up to 9'),
        ('rosbag2_bagfile_information: {version: 9}', 'not the metadata of a recording'),
    ],
)
def test_damaged_metadata_is_named(tmp_path: Path, text: str, problem: str) -> None:
    """No traceback of a parser."""
    write(tmp_path / 'bag', MESSAGES)
    (tmp_path / 'bag' / METADATA_FILE).write_text(text)
    with pytest.raises(BagError, match=problem):
        BagReader(tmp_path / 'bag')


def test_a_folder_without_a_recording(tmp_path: Path) -> None:
    """It says so."""
    with pytest.raises(BagError, match='holds no recording'):
        BagReader(tmp_path)
    with pytest.raises(BagError, match='does not exist'):
        BagReader(tmp_path / 'nothing')


def test_a_file_that_is_being_compressed_counts_once(tmp_path: Path) -> None:
    """A recorder that is killed meanwhile leaves both; the one that is whole is read."""
    for name in ('bag_0.mcap', 'bag_0.mcap.zstd', 'bag_1.mcap.zstd'):
        (tmp_path / name).touch()
    names = [path.name for path in recording_files(tmp_path)]
    assert names == ['bag_0.mcap', 'bag_1.mcap.zstd']
