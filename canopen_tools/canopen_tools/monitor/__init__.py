# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames in words: what each one on a CANopen bus means."""

from .describe import FrameDescriber
from .description import Description, FrameFilter, FrameKind

__all__ = ['Description', 'FrameDescriber', 'FrameFilter', 'FrameKind']
