# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads and writes metadata.yaml in the format of rosbag2 in Jazzy (version 9)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import yaml


class BagError(RuntimeError):
    """A recording cannot be read or written; the message names the file.

    Scenarios: the folder exists already, there is no recording in it, its storage is not MCAP, its
    metadata.yaml is of a later version or damaged, the disk is full.
    """


UNLIMITED = 2**63 - 1  # the duration in [ns] that stands for no limit

_NANO = 1_000_000_000

# what rmw calls them, at their numbers, which versions before 9 of metadata.yaml have
_NAMES: Mapping[str, tuple[str, ...]] = {
    'history': ('system_default', 'keep_last', 'keep_all', 'unknown'),
    'reliability': ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available'),
    'durability': ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available'),
    'liveliness': (
        'system_default',
        'automatic',
        '',
        'manual_by_topic',
        'unknown',
        'best_available',
    ),
}
_DURATIONS = ('deadline', 'lifespan', 'liveliness_lease_duration')


@dataclass(frozen=True, slots=True)
class OfferedQos:
    """QoS that a publisher offers. Durations are in [ns]; policies have the names of rmw.

    A subscription cannot discover history and depth; they are `unknown` and 0 then.
    """

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    deadline: int = UNLIMITED
    lifespan: int = UNLIMITED
    liveliness: str = 'automatic'
    liveliness_lease_duration: int = UNLIMITED
    avoid_ros_namespace_conventions: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return the profile as in metadata.yaml, version 9."""
        values = asdict(self)
        for name in _DURATIONS:
            seconds, rest = divmod(values[name], _NANO)
            values[name] = {'sec': seconds, 'nsec': rest}
        return values


def read_qos(values: object, where: str) -> OfferedQos:
    """Read a QoS profile of metadata.yaml, or of a file with overrides.

    Missing keys get their defaults; `where` names the source in error messages.

    Raises:
        BagError: A key or a value is unknown in QoS profiles.
    """
    if not isinstance(values, Mapping):
        raise BagError(f'{where}: a QoS profile is a mapping, not {values!r}')
    known = OfferedQos.__dataclass_fields__
    if unknown := [key for key in values if key not in known]:
        raise BagError(f'{where}: unknown key {unknown[0]!r}; choose from {", ".join(known)}')
    return OfferedQos(**{key: _value(key, value, where) for key, value in values.items()})


def _value(key: str, value: object, where: str) -> Any:  # noqa: ANN401  # as the field has it
    if key in _NAMES:
        return _policy(key, value, where)
    if key in _DURATIONS:
        return _duration(key, value, where)
    expected = bool if key == 'avoid_ros_namespace_conventions' else int
    if type(value) is not expected or value < 0:
        raise BagError(f'{where}: {key} is {value!r}, not {expected.__name__} of 0 or more')
    return value


def _policy(key: str, value: object, where: str) -> str:
    names = _NAMES[key]
    if isinstance(value, int) and 0 <= value < len(names):
        return names[value]
    if value not in names or not isinstance(value, str):
        choice = ', '.join(filter(None, names))
        raise BagError(f'{where}: unknown {key} {value!r}; choose one of {choice}')
    return value


def _duration(key: str, value: object, where: str) -> int:
    if isinstance(value, Mapping) and set(value) <= {'sec', 'nsec'}:
        parts = [value.get('sec', 0), value.get('nsec', 0)]
        if all(isinstance(part, int) and part >= 0 for part in parts):
            # 0 and more than 2**63 - 1 are other ways to write that there is no limit
            return min(parts[0] * _NANO + parts[1], UNLIMITED) or UNLIMITED
    raise BagError(f'{where}: {key} is {value!r}; write it as {{sec: 1, nsec: 0}}')


METADATA_FILE = 'metadata.yaml'
STORAGE = 'mcap'
_VERSION = 9
_ROOT = 'rosbag2_bagfile_information'


@dataclass(frozen=True, slots=True)
class Topic:
    """A recorded topic."""

    name: str  # its absolute name
    type: str  # name of its messages, `package/msg/Name`
    # text of their definition with those of all nested types (`ros2msg`); empty where it could not
    # be found
    definition: str = ''
    type_hash: str = ''  # hash of the type, `RIHS01_...`
    qos: tuple[OfferedQos, ...] = ()  # what its publishers offered
    serialization: str = 'cdr'  # format of its messages

    def qos_dicts(self) -> list[dict[str, Any]]:
        """Return the QoS profiles in the format of metadata.yaml."""
        return [profile.to_dict() for profile in self.qos]


@dataclass(frozen=True, slots=True)
class TopicCount:
    """A topic and its number of messages."""

    topic: Topic
    count: int


@dataclass(frozen=True, slots=True)
class BagFile:
    """One file of a recording: its path in the folder, start and duration in [ns], messages."""

    path: str
    start: int
    duration: int
    count: int


@dataclass(frozen=True, slots=True)
class BagMetadata:
    """Summary of a recording: its files, topics and message counts."""

    files: tuple[BagFile, ...]  # its files in order
    topics: tuple[TopicCount, ...]  # its topics with their counts
    compression_format: str = ''  # `zstd` or empty
    compression_mode: str = ''  # `FILE`, `MESSAGE` or empty
    distro: str = 'jazzy'  # the ROS that it was recorded with
    custom: Mapping[str, str] | None = None  # what the user wrote down with it
    storage: str = STORAGE  # how its files are written

    @property
    def start(self) -> int:
        """Time of the first message in [ns since 1970]; 0 when there is none."""
        return min((file.start for file in self.files if file.count), default=0)

    @property
    def duration(self) -> int:
        """Time from the first message to the last in [ns]."""
        ends = [file.start + file.duration for file in self.files if file.count]
        return max(ends, default=0) - self.start

    @property
    def count(self) -> int:
        """Number of messages."""
        return sum(each.count for each in self.topics)

    def to_yaml(self) -> str:
        """Return the text of metadata.yaml."""
        information = {
            'version': _VERSION,
            'storage_identifier': self.storage,
            'duration': {'nanoseconds': self.duration},
            'starting_time': {'nanoseconds_since_epoch': self.start},
            'message_count': self.count,
            'topics_with_message_count': [_topic_dict(each) for each in self.topics],
            'compression_format': self.compression_format,
            'compression_mode': self.compression_mode,
            'relative_file_paths': [file.path for file in self.files],
            'files': [_file_dict(file) for file in self.files],
            'custom_data': dict(self.custom) if self.custom else None,
            'ros_distro': self.distro,
        }
        return yaml.safe_dump({_ROOT: information}, sort_keys=False, allow_unicode=True)

    def save(self, folder: Path) -> None:
        """Write metadata.yaml to a folder atomically."""
        half = folder / f'.{METADATA_FILE}.part'
        half.write_text(self.to_yaml(), encoding='utf-8')
        half.replace(folder / METADATA_FILE)


def _topic_dict(each: TopicCount) -> dict[str, Any]:
    topic = each.topic
    return {
        'topic_metadata': {
            'name': topic.name,
            'type': topic.type,
            'serialization_format': topic.serialization,
            'offered_qos_profiles': topic.qos_dicts(),
            'type_description_hash': topic.type_hash,
        },
        'message_count': each.count,
    }


def _file_dict(file: BagFile) -> dict[str, Any]:
    return {
        'path': file.path,
        'starting_time': {'nanoseconds_since_epoch': file.start},
        'duration': {'nanoseconds': file.duration},
        'message_count': file.count,
    }


def load_metadata(path: Path) -> BagMetadata:
    """Read a metadata.yaml of any version up to 9."""
    try:
        document = yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BagError(f'{path}: {error}') from None
    try:
        return _parse(document[_ROOT], path)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise BagError(f'{path}: not the metadata of a recording ({error!r})') from None


def _parse(information: Mapping[str, Any], path: Path) -> BagMetadata:
    version = int(information['version'])
    if version > _VERSION:
        raise BagError(f'{path}: version {version}; up to {_VERSION} can be read')
    mode = str(information.get('compression_mode') or '')
    return BagMetadata(
        tuple(_files(information)),
        tuple(_topic(each, path) for each in information['topics_with_message_count']),
        str(information.get('compression_format') or ''),
        '' if mode.upper() == 'NONE' else mode.upper(),
        str(information.get('ros_distro') or 'unknown'),
        information.get('custom_data') or None,
        str(information['storage_identifier']),
    )


def _files(information: Mapping[str, Any]) -> Sequence[BagFile]:
    paths = [str(each) for each in information['relative_file_paths']]
    listed = information.get('files')
    if not listed:  # before version 5 only those of the whole recording
        start = int(information['starting_time']['nanoseconds_since_epoch'])
        duration = int(information['duration']['nanoseconds'])
        count = int(information['message_count'])
        return [BagFile(path, start, duration, count) for path in paths]
    return [
        BagFile(
            path,
            int(each['starting_time']['nanoseconds_since_epoch']),
            int(each['duration']['nanoseconds']),
            int(each['message_count']),
        )
        for path, each in zip(paths, listed, strict=True)
    ]


def _topic(each: Mapping[str, Any], path: Path) -> TopicCount:
    values = each['topic_metadata']
    profiles = parse_profiles(values.get('offered_qos_profiles'), f'{path}: {values["name"]}')
    topic = Topic(
        str(values['name']),
        str(values['type']),
        '',
        str(values.get('type_description_hash') or ''),
        profiles,
        str(values['serialization_format']),
    )
    return TopicCount(topic, int(each['message_count']))


def parse_profiles(profiles: object, where: str) -> tuple[OfferedQos, ...]:
    """Read a list of QoS profiles; before version 9 it is a string of YAML."""
    if isinstance(profiles, str):
        try:
            profiles = yaml.safe_load(profiles)
        except yaml.YAMLError as error:
            raise BagError(f'{where}: {error}') from None
    if not profiles:
        return ()
    if not isinstance(profiles, list):
        raise BagError(f'{where}: QoS profiles are a list, not {profiles!r}')
    return tuple(read_qos(profile, where) for profile in profiles)
