# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames in words: what each one on a CANopen bus means."""

from .describe import Description, FrameDescriber, FrameFilter, FrameKind

__all__ = ['Description', 'FrameDescriber', 'FrameFilter', 'FrameKind']
