# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Watches an arm from its bus alone: what the master asks, and where the drives are.

Positions are increments of the drives, times are those of the steady clock in [s].
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import struct
import threading
import time

from arm_canopen import DriveState
from arm_model import JointLimits
from canopen_core.can import Frame
from canopen_core.standard import drive_state, rpdo_default, tpdo_default

INCREMENTS = 1000.0
"""Of a radian, as the Panda's bus.yml has it."""
PERIOD = 0.01
"""Of SYNC in [s], as the Panda's bus.yml has it."""
REST = 3
"""Increments by which a drive at rest may seem to move."""
TOLERANCE = 20
"""Increments by which a drive may be beside the way that was commanded."""
TARGETS = struct.Struct('<i')
TARGET_AT = 3
"""Place of the target in RPDO 1, behind controlword and mode, as the Panda's bus.yml has it."""
FRESH = 0.05
"""Age in [s] up to which a statusword counts; a drive that reboots sends none."""
SILENT = 0.4
"""Time in [s] without a position after which a drive may have moved unseen."""
HISTORY = 12
"""Changes that are kept for the report of a violation."""


@dataclass
class _Axis:
    """What was seen of one drive."""

    name: str
    lower: float
    upper: float
    largest_step: float
    state: DriveState = DriveState.UNKNOWN
    state_at: float = 0.0
    target: int | None = None
    position: int | None = None
    reported: float = 0.0
    moved: float = 0.0
    allowed: tuple[float, float] | None = None
    history: deque[str] = field(default_factory=lambda: deque(maxlen=HISTORY))


class ArmWatch:
    """Checks the laws of motion on each frame.

    Laws: a set-point is within the position limits, or leads back into them; it is no further from
    the one before than a cycle at the greatest speed, or it is where the drive is; a drive is
    where a command leads it, and without one where it stands.

    Attributes:
        violations: What was against a law, with the drive and what led there.
    """

    def __init__(self, nodes: Mapping[int, str], limits: JointLimits) -> None:
        self.violations: list[str] = []
        self._begin = time.monotonic()
        self._lock = threading.Lock()
        self._axes = {}
        for node_id, name in nodes.items():
            at = limits.names.index(name)
            self._axes[node_id] = _Axis(
                name,
                limits.lower[at] * INCREMENTS - 1,
                limits.upper[at] * INCREMENTS + 1,
                limits.velocity[at] * INCREMENTS * PERIOD + 1,
            )
        self._from_master = {rpdo_default(1, node): axis for node, axis in self._axes.items()}
        self._states = {tpdo_default(1, node): axis for node, axis in self._axes.items()}
        self._positions = {tpdo_default(2, node): axis for node, axis in self._axes.items()}

    def allow(self, positions: Sequence[float]) -> None:
        """Allow each drive any position from where it is to another one in [rad]."""
        with self._lock:
            for axis, position in zip(self._axes.values(), positions, strict=True):
                places = [position * INCREMENTS]
                places += [] if axis.position is None else [axis.position]
                axis.allowed = (min(places) - TOLERANCE, max(places) + TOLERANCE)

    def forbid(self) -> None:
        """Forbid every drive to move from where it is."""
        with self._lock:
            for axis in self._axes.values():
                if axis.position is not None:
                    axis.allowed = (axis.position - REST, axis.position + REST)

    def forget_positions(self) -> None:
        """Take what the drives say next as where they are: they had no power."""
        with self._lock:
            for axis in self._axes.values():
                axis.position, axis.allowed = None, None

    def still_for(self) -> float:
        """Return for how long in [s] all drives have said that they do not move."""
        axes = self._axes.values()
        reported = min(axis.reported for axis in axes)
        if time.monotonic() - reported > SILENT:
            return 0.0
        return reported - max(axis.moved for axis in axes)

    def positions(self) -> list[float]:
        """Return where the drives are in [rad]."""
        return [(axis.position or 0) / INCREMENTS for axis in self._axes.values()]

    def take_from_master(self, frame: Frame) -> None:
        """Look at a frame of the master."""
        axis = self._from_master.get(frame.can_id)
        if axis is None or len(frame.data) < TARGET_AT + TARGETS.size:
            return
        (target,) = TARGETS.unpack_from(frame.data, TARGET_AT)
        before, axis.target = axis.target, target
        if target != before:
            axis.history.append(f'{frame.timestamp - self._begin:.3f} target {target}')
        is_fresh = frame.timestamp - axis.state_at < FRESH
        if not is_fresh or axis.state is not DriveState.OPERATION_ENABLED:
            return
        at = target if axis.position is None else axis.position
        if not min(axis.lower, at - TOLERANCE) <= target <= max(axis.upper, at + TOLERANCE):
            self._violated(axis, f'set-point {target} beyond {axis.lower:.0f}..{axis.upper:.0f}')
        is_there = abs(target - at) <= TOLERANCE + 2 * axis.largest_step
        if before is not None and abs(target - before) > axis.largest_step and not is_there:
            self._violated(axis, f'set-points {before}, {target}: over {axis.largest_step:.1f}')

    def take_from_device(self, frame: Frame) -> None:
        """Look at a frame of a drive."""
        if (axis := self._positions.get(frame.can_id)) is not None:
            self._moved(axis, TARGETS.unpack_from(frame.data)[0], frame.timestamp)
        elif (axis := self._states.get(frame.can_id)) is not None:
            axis.state_at = frame.timestamp
            state = drive_state(int.from_bytes(frame.data[:2], 'little'))
            if state is not axis.state:
                axis.history.append(f'{frame.timestamp - self._begin:.3f} {state.title}')
                axis.state = state

    def see(self, positions: Sequence[int]) -> None:
        """Look at where the drives are, read in another way: without SYNC they send nothing."""
        for axis, position in zip(self._axes.values(), positions, strict=True):
            self._moved(axis, position, time.monotonic())

    def _moved(self, axis: _Axis, position: int, now: float) -> None:
        with self._lock:
            was_silent, axis.reported = now - axis.reported > SILENT, now
            if was_silent or axis.position is None or abs(position - axis.position) > 1:
                axis.moved = now
            axis.position, allowed = position, axis.allowed
        if allowed is not None and not allowed[0] <= position <= allowed[1]:
            low, high = allowed
            self._violated(axis, f'is at {position}, allowed were {low:.0f}..{high:.0f}')
            with self._lock:
                axis.allowed = None  # said once

    def _violated(self, axis: _Axis, words: str) -> None:
        since = time.monotonic() - self._begin
        self.violations.append(f'{since:.3f} s: {axis.name}: {words}; {"; ".join(axis.history)}')
