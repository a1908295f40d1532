# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serializes frequent messages fast: only stamp and numbers are written into fixed bytes."""

from .serialized import FastPublisher, FastReader, MessageTemplate, SerializedTemplate, stamp_of

__all__ = ['FastPublisher', 'FastReader', 'MessageTemplate', 'SerializedTemplate', 'stamp_of']
