# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Waiting for frames in tests: by event, with a deadline."""

from __future__ import annotations

from time import monotonic

from canopen_core.can import Bus, Frame

DEADLINE = 20.0  # [s] longer than any machine is ever late


def receive_count(bus: Bus, count: int, deadline: float = DEADLINE) -> list[Frame]:
    """Receive until there are so many frames, or the deadline in [s] is over."""
    frames: list[Frame] = []
    end = monotonic() + deadline
    while len(frames) < count and (left := end - monotonic()) > 0.0:
        frames += bus.receive(left)
    return frames


def unstamped(frames: list[Frame]) -> list[Frame]:
    """Return the frames without their time stamps, to be compared with those sent."""
    return [frame._replace(timestamp=0.0) for frame in frames]
