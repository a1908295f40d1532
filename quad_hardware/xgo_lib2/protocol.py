# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Packing, checksum and parsing of frames."""

from quad_hardware.protocol import (
    checksum,
    Frame,
    HOST_KINDS,
    Kind,
    NEW,
    OLD,
    Protocol,
    ROBOT_KINDS,
    StreamParser,
)

__all__ = [
    'HOST_KINDS',
    'NEW',
    'OLD',
    'ROBOT_KINDS',
    'Frame',
    'Kind',
    'Protocol',
    'StreamParser',
    'checksum',
]
