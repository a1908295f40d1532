# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong; all of it is a :class:`ViewerError`."""

from __future__ import annotations


class ViewerError(Exception):
    """A viewer that cannot begin; the message has the remedy."""


class BridgeError(ViewerError):
    """A bridge to Foxglove that cannot begin."""
