# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Packing, checksum and parsing of frames."""

from quad_hardware.protocol import (
    checksum,
    Frame,
    HOST_KINDS,
    Kind,
    Protocol,
    ROBOT_KINDS,
    StreamParser,
    V1,
    V2,
)

__all__ = [
    'HOST_KINDS',
    'ROBOT_KINDS',
    'V1',
    'V2',
    'Frame',
    'Kind',
    'Protocol',
    'StreamParser',
    'checksum',
]
