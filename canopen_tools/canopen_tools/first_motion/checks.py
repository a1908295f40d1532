# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is looked at before a first motion, and what the drive says about its increments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
import math

from arm_canopen import CanopenMaster
from arm_canopen.config import DriveConfig, FactorGroup
from canopen_core import DriveError, ObjectError, SdoError
from canopen_core.standard import AXIS_OFFSET, CYCLIC_MODES, Index, OperationMode
from first_motion import FASTEST, JointKind, too_few_increments

TURNS_MAX = 20.0  # turns from 0 beyond which a position is hardly one of an arm
LENGTH_MAX = 10.0  # [m] likewise


@dataclass(frozen=True, slots=True)
class AxisFacts:
    """What a drive says about an axis."""

    axis: DriveConfig  # its configuration, with the scales that the master uses
    factors: FactorGroup  # its factor group
    # software limits 0x607D less 0x607C in [rad] or [m], the lower one first; None without
    limits: tuple[float, float] | None
    # 0x6081 for the motion, in velocity units of the drive; None in the modes 7, 8
    speed_dev: int | None
    speed: float  # what that is in [rad/s] or [m/s]


def motion_mode(axis: DriveConfig) -> OperationMode:
    """Return the mode of the motion: that of bus.yml, else profile position."""
    return OperationMode(axis.position_mode or OperationMode.PROFILE_POSITION)


def read_facts(master: CanopenMaster, axis: DriveConfig, speed: float) -> AxisFacts:
    """Read from a booted drive what a first motion at a speed in [rad/s] or [m/s] has to know.

    Raises:
        DriveError: Its units are unknown.
    """
    sdo, offset = master.drive(axis.name).sdo, AXIS_OFFSET * axis.channel

    def read(index: int, subindex: int) -> int | None:
        try:
            value = sdo.read(index + offset, subindex)
        except (SdoError, ObjectError):
            return None
        return value if isinstance(value, int) else None

    factors = FactorGroup.read(read)
    if axis.scale_from_factor_group:
        axis = _by_factors(axis, factors)
    low, high = (read(Index.SOFTWARE_POSITION_LIMIT, subindex) for subindex in (1, 2))
    limits = None
    if low is not None and high is not None and low < high:
        home = read(Index.HOME_OFFSET, 0) or 0  # the limits count from home
        ends = sorted(
            (end - home) * axis.scale_pos_from_dev + axis.offset_pos_from_dev
            for end in (low, high)
        )
        limits = ends[0], ends[1]
    if motion_mode(axis) in CYCLIC_MODES:
        return AxisFacts(axis, factors, limits, None, speed)
    speed_dev = max(1, round(abs(speed * axis.scale_vel_to_dev)))
    return AxisFacts(axis, factors, limits, speed_dev, speed_dev / abs(axis.scale_vel_to_dev))


def _by_factors(axis: DriveConfig, factors: FactorGroup) -> DriveConfig:
    position, velocity = factors.position_scale, factors.velocity_scale
    if not position or not velocity:
        raise DriveError(
            f'{axis.name}: scale_from_factor_group is true in bus.yml, and the drive has neither '
            '0x6092 nor 0x608F; write scale_pos_to_dev and the other scales instead'
        )
    return replace(
        axis,
        scale_pos_to_dev=position,
        scale_pos_from_dev=1.0 / position,
        scale_vel_to_dev=velocity,
        scale_vel_from_dev=1.0 / velocity,
    )


def obstacles(
    kind: JointKind, facts: AxisFacts, position: float, distance: float
) -> Iterator[str]:
    """Yield why a motion cannot be made, each with its remedy."""
    axis = facts.axis
    if not math.isfinite(position):
        yield 'the drive reports no position: map 0x6064 into a TPDO of bus.yml'
        return
    if motion_mode(axis) not in {
        OperationMode.PROFILE_POSITION,
        OperationMode.CYCLIC_POSITION,
        OperationMode.INTERPOLATED_POSITION,
    }:
        yield (
            f'position_mode of bus.yml is {axis.position_mode}, which goes to no position; '
            'write 1, 7 or 8'
        )
    target = position + distance
    if facts.limits is not None and not facts.limits[0] <= target <= facts.limits[1]:
        low, high = (kind.shown(end) for end in facts.limits)
        yield (
            f'the target {kind.shown(target)} is beyond the software limits of the drive, {low} '
            f'to {high} (0x607D); give --distance with the other sign, or correct 0x607D'
        )
    if few := too_few_increments(kind, distance, axis.scale_pos_to_dev):
        yield few
    if facts.speed > FASTEST[kind]:
        yield (
            f'one velocity unit of the drive is {kind.shown(1.0 / abs(axis.scale_vel_to_dev))}/s, '
            f'so the slowest motion has {kind.shown(facts.speed)}/s; correct scale_vel_to_dev: '
            'it is velocity units of the drive per rad/s or m/s'
        )


def doubts(
    kind: JointKind, facts: AxisFacts, position: float, asked_speed: float
) -> Iterator[str]:
    """Yield what is odd, but may be so."""
    far = LENGTH_MAX if kind is JointKind.SLIDES else TURNS_MAX * 2.0 * math.pi
    if abs(position) > far:
        yield (
            f'it stands at {kind.shown(position)}, far for a joint: has it been homed, and are '
            'the scales right?'
        )
    if facts.limits is None:
        yield 'the drive has no software limits (0x607D): look that the way is free'
    elif not facts.limits[0] <= position <= facts.limits[1]:
        yield 'it stands beyond its software limits (0x607D): has it been homed?'
    if facts.speed > 1.5 * asked_speed:
        yield (f'its speed will be {kind.shown(facts.speed)}/s, the smallest that 0x6081 can hold')
