# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Records what is on a bus, from outside of all processes under test."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from canopen_core.can import Frame, open_bus
from canopen_core.standard import CobId, drive_state

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self


class BusRecorder:
    """Keeps every frame from its start on."""

    def __init__(self, bus: str) -> None:
        """Listen."""
        self.frames: list[Frame] = []
        self._bus = open_bus(bus)
        self._stopping = False
        self._thread = threading.Thread(target=self._record, daemon=True)
        self._thread.start()

    def first_after(self, time: float, can_id: int, data: bytes, at: int = 0) -> Frame | None:
        """Return the first frame after a steady time with some bytes at a place of its data."""
        return next(
            (
                frame
                for frame in self.frames
                if frame.timestamp >= time
                and frame.can_id == can_id
                and frame.data[at : at + len(data)] == data
            ),
            None,
        )

    def last_before(self, time: float, first_id: int, last_id: int) -> Frame | None:
        """Return the last frame before a steady time with an identifier of a range."""
        for frame in reversed(self.frames):
            if frame.timestamp < time and first_id <= frame.can_id <= last_id:
                return frame
        return None

    def pause(self) -> None:
        """Stop to listen; what was recorded stays."""
        self._stopping = True
        self._bus.wake()
        self._thread.join()

    def last_states(self) -> dict[int, str]:
        """Return the state in the last TPDO1 of each node, by node id."""
        states = {}
        for frame in list(self.frames):
            node_id = frame.can_id - CobId.TPDO1
            if 1 <= node_id <= 127:
                states[node_id] = drive_state(int.from_bytes(frame.data[:2], 'little')).title
        return states

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop to listen."""
        self.pause()
        self._bus.close()

    def _record(self) -> None:
        while not self._stopping:
            self.frames += self._bus.receive(0.5)
