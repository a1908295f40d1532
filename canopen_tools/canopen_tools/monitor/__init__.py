# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Decodes the frames of a CANopen bus into text."""

from .describe import Description, FrameDescriber, FrameFilter, FrameKind

__all__ = ['Description', 'FrameDescriber', 'FrameFilter', 'FrameKind']
