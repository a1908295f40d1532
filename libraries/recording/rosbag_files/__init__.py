# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads and writes rosbag2 recordings: a folder with metadata.yaml and MCAP files.

Messages are bytes (CDR), times are nanoseconds since 1970. ROS is not needed.
"""

from .metadata import (
    BagError,
    BagFile,
    BagMetadata,
    load_metadata,
    METADATA_FILE,
    OfferedQos,
    read_qos,
    Topic,
    TopicCount,
    UNLIMITED,
)
from .reader import BagMessage, BagReader
from .writer import BagWriter, Preset, repair, WriterOptions

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
