# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What rosbag_files raises."""

from __future__ import annotations


class BagError(RuntimeError):
    """A recording cannot be read or written; the message names the file.

    Scenarios: the folder exists already, there is no recording in it, its storage is not MCAP, its
    metadata.yaml is of a later version or damaged, the disk is full.
    """
