# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Meaning of a target of 1.0 for each drive, and warnings of units that move nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
import math

from canopen_core import Findings
from canopen_core.standard import AXIS_OFFSET, Index, object_address, OperationMode

from .boot_plan import is_requested
from .bus import BusConfig, NodeConfig
from .device_checks import Subject
from .drive import DriveConfig, FactorGroup, REVOLUTION

POSITION_KEY, VELOCITY_KEY = 'scale_pos_to_dev', 'scale_vel_to_dev'
ACCELERATION_KEY = 'scale_acc_to_dev'
FACTOR_KEY = 'scale_from_factor_group'
OFFSET_FROM_KEY, OFFSET_TO_KEY = 'offset_pos_from_dev', 'offset_pos_to_dev'
POSITION_TOLERANCE = 0.01
"""User units (rad, m) by which a position may miss its target because increments are whole."""
COARSE_SCALE = 1.0
"""Device units per user unit of velocity below which more than half a user unit becomes 0."""
POSITION_MAX = 2**31 - 1  # [inc] of 0x6064, an INTEGER32
MOTION_OBJECTS = (
    Index.PROFILE_VELOCITY,
    Index.MAX_PROFILE_VELOCITY,
    Index.PROFILE_ACCELERATION,
    Index.PROFILE_DECELERATION,
    Index.QUICK_STOP_DECELERATION,
)
"""What the moves of a drive's own are made with: velocities, and then accelerations."""
ACCELERATION_OBJECTS = MOTION_OBJECTS[2:]
SECONDS_PER_MINUTE = 60.0
MIN_RADIANS = 0.1
"""Turn of the shaft in [rad] for 1 rad or 1 m of the joint, below which the scale is doubted: it
takes a gear that makes the joint faster than its motor."""
SAME_SCALE = 1e-3  # relative difference up to which two scales count as equal


class UnitRule(Enum):
    """Source of the scale of an axis; the value is the text for the user."""

    BUS_YML = f'{POSITION_KEY} of bus.yml'
    UPSTREAM = f'default of ros2_canopen (no {POSITION_KEY})'
    FACTOR_GROUP = 'factor group of the EDS'


@dataclass(frozen=True, slots=True)
class AxisUnits:
    """Meaning of a target of 1.0 for an axis."""

    name: str
    rule: UnitRule  # source of the scale
    increments: float  # position increments of 1.0; 0 if unknown
    velocity: float  # device velocity units of 1.0 per second
    acceleration: float  # device acceleration units of 1.0 per second squared
    # source of ``acceleration``; empty if velocity units per second are assumed
    acceleration_by: str
    # shaft angle for a target of 1.0 in [rad], by the factor group of the EDS; None if the EDS
    # lacks it
    radians: float | None
    factors: tuple[Index, ...] = ()  # objects of the factor group that define ``radians``
    # speeds and accelerations of the drive after boot, by object, in user units per second
    # and second squared
    motion: Mapping[Index, float] = field(default_factory=dict)


def axis_units(subject: Subject, axis: DriveConfig) -> AxisUnits:
    """Return the meaning of a target of 1.0 for an axis of a drive."""
    factors = _factor_group(subject, axis)
    rule, increments, velocity = UnitRule.BUS_YML, axis.scale_pos_to_dev, axis.scale_vel_to_dev
    if axis.scale_from_factor_group:
        rule = UnitRule.FACTOR_GROUP
        increments, velocity = factors.position_scale, factors.velocity_scale
    elif increments == DriveConfig().scale_pos_to_dev and not (
        subject.bus.locations and is_requested(subject.bus, subject.node, POSITION_KEY)
    ):
        rule = UnitRule.UPSTREAM
    acceleration, by = axis.scale_acc_to_dev, ACCELERATION_KEY
    if acceleration is None:
        acceleration = velocity * (factors.acceleration_ratio or 1.0)
        by = ', '.join(f'0x{index:04X}' for index in factors.acceleration_objects)
    per_radian = factors.position_scale
    motion = {}  # in user units
    for index in MOTION_OBJECTS:
        held = subject.value(index + AXIS_OFFSET * axis.channel)
        scale = acceleration if index in ACCELERATION_OBJECTS else velocity
        if held is not None and scale:
            motion[index] = held / abs(scale)
    return AxisUnits(
        name=axis.name or subject.node.name,
        rule=rule,
        increments=increments,
        velocity=velocity,
        acceleration=acceleration,
        acceleration_by=by,
        radians=increments / per_radian if per_radian else None,
        factors=factors.position_objects,
        motion=motion,
    )


def reported_increments(
    bus: BusConfig, node: NodeConfig, axis: DriveConfig, position: float
) -> int:
    """Return the value of 0x6064 in [inc] for a position in user units.

    Raises:
        ValueError: It is not a number, or does not fit 0x6064 (INTEGER32).
    """
    per_increment = axis.scale_pos_from_dev
    if axis.scale_from_factor_group:
        per_increment = 1.0 / axis_units(Subject(bus, node, Findings()), axis).increments
    scaled = (position - axis.offset_pos_from_dev) / per_increment
    if not -POSITION_MAX - 1 <= scaled <= POSITION_MAX:
        raise ValueError(
            f'{axis.name}: position {position:g} is {scaled:g} increments, and 0x6064 is an '
            'INTEGER32'
        )
    return round(scaled)


def rate_units(bus: BusConfig, node: NodeConfig, axis: DriveConfig) -> tuple[float, float]:
    """Return one velocity unit of an axis in [inc/s], and one acceleration unit in [inc/s2].

    They follow from the ratio of its scales in bus.yml, else from the EDS (0x6096, 0x6097, 0x60A9,
    0x60AA). They are 1 if neither defines them, as most drives count increments.
    """
    subject = Subject(bus, node, Findings())
    units = axis_units(subject, axis)
    velocity, acceleration = _factor_group(subject, axis).rate_units
    ratio = velocity / acceleration
    if units.velocity and units.velocity != DriveConfig().scale_vel_to_dev:
        velocity = abs(units.increments / units.velocity)
    acceleration = velocity / ratio
    if axis.scale_acc_to_dev is not None:
        acceleration = abs(units.increments / axis.scale_acc_to_dev)
    return _plain(velocity), _plain(acceleration)


def _plain(unit: float) -> float:
    return 1.0 if math.isclose(unit, 1.0, rel_tol=SAME_SCALE) else unit


def check_units(subject: Subject) -> None:
    """Warn of units with which targets move nothing, or another distance than intended."""
    for axis in subject.node.axes if subject.node.is_drive else ():
        units = axis_units(subject, axis)
        if units.rule is UnitRule.FACTOR_GROUP and not units.increments:
            subject.findings.error(
                subject.place(FACTOR_KEY),
                'the EDS has no factor group: neither 0x6092 (feed constant) nor 0x608F (encoder '
                'resolution) says how far an increment is',
                f'write {POSITION_KEY} and the other scales instead',
            )
            continue
        _check_coarse(subject, units)
        _check_velocity_default(subject, axis, units)
        _check_acceleration(subject, units)
        _check_offsets(subject, axis, units)
        _check_against_factors(subject, units)
        _check_profile_velocity(subject, axis)


def _check_coarse(subject: Subject, units: AxisUnits) -> None:
    for key, scale, what, refused in (
        (POSITION_KEY, units.increments, 'position', 'targets between them are refused'),
        (VELOCITY_KEY, units.velocity, 'velocity', 'targets below half of that are refused'),
    ):
        coarse = is_coarse(scale) if key == POSITION_KEY else abs(scale) < COARSE_SCALE
        if coarse:
            subject.findings.warning(
                subject.place(key),
                f'1.0 is {scale:g} device units of {what}, so one of them is '
                f'{1 / abs(scale):g} user units: {refused}',
                f'correct {key}: it is device units per user unit (ros2_canopen has 1000), the '
                'inverse of the one from the device',
                about=units.name,
            )


def _check_velocity_default(subject: Subject, axis: DriveConfig, units: AxisUnits) -> None:
    """Warn if positions have a scale and velocities none; without either, both match."""
    position, velocity = axis.scale_pos_to_dev, axis.scale_vel_to_dev
    default = DriveConfig().scale_vel_to_dev
    if units.rule is not UnitRule.BUS_YML or velocity != default or position == default:
        return
    if is_coarse(position) or is_requested(subject.bus, subject.node, VELOCITY_KEY):
        return  # a coarse scale has a warning of its own
    in_rpm = math.copysign(SECONDS_PER_MINUTE / REVOLUTION, position)
    subject.findings.warning(
        subject.place(POSITION_KEY),
        f'positions have a scale, velocities the default {default:g}: a drive that '
        f'counts increments per second moves at {default / abs(position):.4g} where 1.0 is asked',
        f'write {VELOCITY_KEY}: {position:g} (increments per second: the same as {POSITION_KEY}; '
        f'rpm of the joint: {in_rpm:.7g}, of the motor: times its gear), and its inverse',
        about=units.name,
    )


def _check_acceleration(subject: Subject, units: AxisUnits) -> None:
    """Warn when neither bus.yml nor the EDS gives the unit of accelerations."""
    if units.acceleration_by or units.rule is UnitRule.UPSTREAM:
        return  # the defaults of ros2_canopen assume all units
    given = is_requested(subject.bus, subject.node, VELOCITY_KEY)
    subject.findings.warning(
        subject.place(VELOCITY_KEY if given else POSITION_KEY),
        f'1.0 per s2 is assumed to be {units.acceleration:g} device units of '
        'acceleration, velocity units per second: where the drive counts others, its ramps and '
        'stops are longer or shorter than the master believes',
        f'write {ACCELERATION_KEY}: {units.acceleration:g} where the manual says so for 0x6083, '
        'else what it says',
        about=units.name,
    )


def _check_offsets(subject: Subject, axis: DriveConfig, units: AxisUnits) -> None:
    """Warn if a target equal to the displayed position would move the axis."""
    if not units.increments:
        return
    to_dev, from_dev = axis.offset_pos_to_dev, axis.offset_pos_from_dev
    increment = 1.0 / abs(units.increments)
    jump = from_dev + to_dev / units.increments
    if abs(jump) <= max(increment, SAME_SCALE * abs(from_dev)):
        return
    subject.findings.warning(
        subject.place(OFFSET_FROM_KEY if from_dev else OFFSET_TO_KEY),
        f'{OFFSET_FROM_KEY} {from_dev:g} and {OFFSET_TO_KEY} {to_dev:g} do not '
        f'cancel: a target at the position that is shown moves the axis by {jump:g}',
        f'write {OFFSET_TO_KEY}: {-from_dev * units.increments:.10g} '
        f'(-{OFFSET_FROM_KEY} * {POSITION_KEY})',
        about=units.name,
    )


def is_coarse(scale: float) -> bool:
    """Return whether rounding to whole increments exceeds the position tolerance."""
    return 0.5 / abs(scale) > POSITION_TOLERANCE


def _check_against_factors(subject: Subject, units: AxisUnits) -> None:
    """Warn if the position scale contradicts the factor group of the EDS."""
    if units.rule is UnitRule.UPSTREAM and units.radians is not None:
        if math.isclose(units.radians, 1.0, rel_tol=SAME_SCALE):
            return
        subject.findings.warning(
            subject.place(POSITION_KEY),
            f'without {POSITION_KEY} 1.0 is {units.increments:g} increments, as '
            f'with ros2_canopen; by the factor group of the EDS they are {units.radians:.4g} rad',
            f"write {POSITION_KEY} and the other scales, or '{FACTOR_KEY}: true' for radians",
            about=units.name,
        )
    elif units.rule is UnitRule.BUS_YML and _is_far_off(units):
        subject.findings.warning(
            subject.place(POSITION_KEY),
            f'1.0 is {units.increments:g} increments, and by the factor group of '
            f'the EDS only {abs(units.radians or 0.0):.4g} rad: one of them is wrong',
            'try which it is by a first motion on the page, or leave the scales out for '
            f"'{FACTOR_KEY}: true' (canopen new: without --turn)",
            about=units.name,
        )


def _is_far_off(units: AxisUnits) -> bool:
    """Return whether 1.0 is so small an angle by the EDS that a scale must be wrong."""
    if units.radians is None or is_coarse(units.increments):
        return False  # a coarse scale has a warning of its own
    return abs(units.radians) < MIN_RADIANS


def _check_profile_velocity(subject: Subject, axis: DriveConfig) -> None:
    index = Index.PROFILE_VELOCITY + AXIS_OFFSET * axis.channel
    written = subject.node.write_of(index, 0) is not None
    is_used = axis.position_mode == OperationMode.PROFILE_POSITION
    if subject.value(index) == 0 and (is_used or (written and axis.position_mode is None)):
        subject.findings.warning(
            subject.object_place(index, 0),
            f'{object_address(index)} (profile velocity) is 0: in mode 1 the drive would not '
            'move, so its targets are refused',
            'write the speed of its moves, in velocity units of the drive',
        )


def _factor_group(subject: Subject, axis: DriveConfig) -> FactorGroup:
    offset = AXIS_OFFSET * axis.channel
    return FactorGroup.read(lambda index, subindex: subject.value(index + offset, subindex))
