# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings as rosbag2 keeps them: a folder with metadata.yaml and MCAP files.

Messages are bytes here (CDR), and times nanoseconds since 1970. ROS is not needed.
"""

from .exceptions import BagError
from .metadata import BagFile, BagMetadata, load_metadata, METADATA_FILE, Topic, TopicCount
from .qos import OfferedQos, read_qos, UNLIMITED
from .reader import BagMessage, BagReader
from .recovery import repair
from .writer import BagWriter, Preset, WriterOptions

__all__ = [
    'METADATA_FILE',
    'UNLIMITED',
    'BagError',
    'BagFile',
    'BagMessage',
    'BagMetadata',
    'BagReader',
    'BagWriter',
    'OfferedQos',
    'Preset',
    'Topic',
    'TopicCount',
    'WriterOptions',
    'load_metadata',
    'read_qos',
    'repair',
]
