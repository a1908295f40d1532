# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frequent messages as serialized bytes in which only the stamp and numbers change."""

from .serialized import FastPublisher, FastReader, MessageTemplate, SerializedTemplate, stamp_of

__all__ = ['FastPublisher', 'FastReader', 'MessageTemplate', 'SerializedTemplate', 'stamp_of']
