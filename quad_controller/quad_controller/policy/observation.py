# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds a policy's observation from its contract: terms, scales, clips, history."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math

import numpy as np
import numpy.typing as npt

from quad_description import FEET, ImuSample, RobotState
from quad_description.rotations import Vector

from ..gait.velocity import BodyPose, REST, UPRIGHT, Velocity
from .contract.model import (
    BodyFrame,
    HistoryLayout,
    HistoryStart,
    Newest,
    ObservationTerm,
    PolicyContract,
    QuaternionOrder,
    Source,
)
from .network import Floats
from .options import GravitySource

STANDARD_GRAVITY = 9.80665  # [m/s^2]
TRUSTED = 0.5  # [m/s^2] off 1 g up to which the accelerometer is blended in
PLAUSIBLE = 2.0  # [m/s^2] off 1 g up to which it is believed at all
BLEND_WEIGHT = 0.1


def gravity(imu: ImuSample, source: GravitySource) -> Vector:
    """Return the unit vector of gravity in the body frame, (0, 0, -1) when upright.

    An accelerometer at rest reads +g upward (REP 145).
    """
    down = imu.down
    if source is GravitySource.EULER or imu.acceleration is None:
        return down
    x, y, z = imu.acceleration
    size = math.sqrt(x * x + y * y + z * z)
    off = abs(size - STANDARD_GRAVITY)
    if off > (TRUSTED if source is GravitySource.BLEND else PLAUSIBLE):
        return down
    share = BLEND_WEIGHT if source is GravitySource.BLEND else 1.0
    mixed = tuple(
        (1.0 - share) * a - share * b / size for a, b in zip(down, (x, y, z), strict=True)
    )
    norm = math.hypot(*mixed) or 1.0
    return mixed[0] / norm, mixed[1] / norm, mixed[2] / norm


@dataclass(frozen=True, slots=True)
class Situation(RobotState):
    """Inputs of a motion (gait or policy) in one step; outdated measurements are left out."""

    velocity: Velocity = REST  # that is requested
    pose: BodyPose = UPRIGHT  # of the body that is requested


def _in_frame(vector: Vector | None, frame: BodyFrame) -> Vector:
    x, y, z = vector or (0.0, 0.0, 0.0)
    return (-x, -y, z) if frame is BodyFrame.YAWED else (x, y, z)


def _quaternion(imu: ImuSample, order: QuaternionOrder) -> tuple[float, ...]:
    x, y, z, w = imu.orientation
    return (w, x, y, z) if order is QuaternionOrder.WXYZ else (x, y, z, w)


def _in_order(contacts: tuple[bool, ...] | None, feet: Sequence[str]) -> tuple[float, ...]:
    seen = dict(zip(FEET, contacts or (), strict=False))
    return tuple(float(seen.get(foot, False)) for foot in feet)


Reader = Callable[[Situation, ImuSample], npt.ArrayLike]
"""Gives one step of a term, before clip and scale."""

ROUNDING = 1e-6  # [m/s] of a velocity in a recording


class ObservationBuilder:
    """Fills one observation buffer, step after step."""

    def __init__(self, contract: PolicyContract, source: GravitySource) -> None:
        """Allocate the buffer."""
        self._defaults: Floats = np.array(contract.default_positions, np.float32)
        # of the joints in the order of the policy, in [rad] and [rad/s], and the last action
        self.positions, self.previous = self._defaults.copy(), np.zeros_like(self._defaults)
        self.velocities = np.zeros_like(self._defaults)
        widths = [term.width for term in contract.terms]
        ends = np.cumsum([0, *widths]).tolist()
        self._terms = [
            (self._reader(term, source), slice(start, end))
            for term, start, end in zip(contract.terms, ends, ends[1:], strict=False)
        ]
        self._scale: Floats = _joined([term.scale for term in contract.terms])
        self._offset: Floats = _joined([term.offset for term in contract.terms])
        clips = [term.clip or (-math.inf, math.inf) for term in contract.terms]
        self._lowest: Floats = np.repeat(np.array([c[0] for c in clips], np.float32), widths)
        self._highest: Floats = np.repeat(np.array([c[1] for c in clips], np.float32), widths)
        self._clips = any(term.clip for term in contract.terms)
        self._scales = bool((self._scale != 1.0).any())
        self._offsets = bool(self._offset.any())
        self._clip = contract.clip
        # the newest step first
        self._history: Floats = np.zeros(
            (max((term.history for term in contract.terms), default=1), sum(widths)), np.float32
        )
        self._places = observed_places(contract)
        self._is_one_step = len(self._history) == 1
        self._repeats = contract.history_start is HistoryStart.REPEAT
        self._begun = False
        self._time = 0.0

    def reset(self) -> None:
        """Clear the history and set all clocks to zero."""
        self._history[:] = 0.0
        self._begun = False
        self._time = 0.0

    def advance(self, dt: float) -> None:
        """Advance the clocks by a duration in [s]."""
        self._time += dt

    def build(self, seen: Situation, imu: ImuSample) -> Floats:
        """Return the observation and advance the history by one step."""
        past, frame = self._history[1:], self._history[0]
        if len(past):
            past[:] = self._history[:-1]
        for read, place in self._terms:
            frame[place] = read(seen, imu)
        if self._clips:
            _clip(frame, self._lowest, self._highest)
        if self._scales:
            frame *= self._scale
        if self._offsets:
            frame += self._offset
        if self._clip is not None:
            _clip(frame, -self._clip, self._clip)
        if not self._begun:
            self._begun = True
            if self._repeats:
                past[:] = frame
        row: Floats
        if self._is_one_step:
            row = self._history.copy()
        else:
            row = self._history.ravel()[self._places][np.newaxis, :]
        return row

    def _reader(self, term: ObservationTerm, source: GravitySource) -> Reader:
        """Return the function that reads one term, before clip and scale."""
        if term.source is Source.JOINT_POSITIONS and term.relative:
            return lambda *_: self.positions - self._defaults
        readers: Mapping[Source, Reader] = {
            Source.LINEAR_VELOCITY: lambda seen, _: _in_frame(seen.linear_velocity, term.frame),
            Source.ANGULAR_VELOCITY: lambda _, imu: _in_frame(imu.angular_velocity, term.frame),
            Source.GRAVITY: lambda _, imu: gravity(imu, source),
            Source.ORIENTATION: lambda _, imu: _quaternion(imu, term.quaternion),
            Source.COMMAND: lambda seen, _: seen.velocity,
            Source.PHASE: lambda seen, _: self._phase(term, seen.velocity),
            Source.JOINT_POSITIONS: lambda *_: self.positions,
            Source.JOINT_VELOCITIES: lambda *_: self.velocities,
            Source.LAST_ACTION: lambda *_: self.previous,
            Source.FOOT_CONTACTS: lambda seen, _: _in_order(seen.foot_contacts, term.feet),
        }
        return readers.get(term.source, lambda *_: term.values)

    def _phase(self, term: ObservationTerm, velocity: Velocity) -> tuple[float, float]:
        # a recording rounds to 32 bits, and a replay has to find the same
        if math.hypot(velocity.x, velocity.y, velocity.yaw) < term.phase_threshold - ROUNDING:
            return 0.0, 0.0
        angle = math.tau * math.fmod(self._time / term.phase_period, 1.0)
        return math.sin(angle), math.cos(angle)


def observed_places(contract: PolicyContract) -> npt.NDArray[np.intp]:
    """Return the history index of each number in the observation.

    The history is a table: a row for each step, the newest first; a column for each number of
    one step. The indices count its cells row by row.
    """
    columns = sum(term.width for term in contract.terms)
    newest_first = contract.newest is Newest.FIRST

    def ages(length: int) -> list[int]:
        return list(range(length)) if newest_first else list(range(length - 1, -1, -1))

    places: list[int] = []
    if contract.history_layout is HistoryLayout.FRAMES:
        length = max((term.history for term in contract.terms), default=1)
        for age in ages(length):
            places.extend(range(age * columns, (age + 1) * columns))
    else:
        start = 0
        for term in contract.terms:
            for age in ages(term.history):
                first = age * columns + start
                places.extend(range(first, first + term.width))
            start += term.width
    return np.array(places, np.intp)


def _clip(numbers: Floats, lowest: npt.ArrayLike, highest: npt.ArrayLike) -> None:
    """Clip in place, at a third of what numpy.clip() costs."""
    np.maximum(numbers, lowest, out=numbers)
    np.minimum(numbers, highest, out=numbers)


def _joined(rows: Sequence[Sequence[float]]) -> Floats:
    return np.array([number for row in rows for number in row], np.float32)
