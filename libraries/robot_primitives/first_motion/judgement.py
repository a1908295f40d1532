# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Derives errors in a joint's scale from a first motion, and the bus.yml keys to correct.

``factor`` is always observed over reported distance, in the unit of bus.yml. If a scale has too
many increments per unit by a factor, the joint moves too far by that factor.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import Enum
import math


class JointKind(Enum):
    """Kind of a joint; the value is the unit shown to the user."""

    TURNS = 'deg'
    SLIDES = 'mm'

    @property
    def size(self) -> float:
        """Size of the shown unit in that of bus.yml, in [rad] or [m]."""
        return math.pi / 180.0 if self is JointKind.TURNS else 0.001

    def shown(self, value: float) -> str:
        """Format a value in [rad] or [m] in the shown unit."""
        return f'{value / self.size:.4g} {self.value}'


FASTEST = {JointKind.TURNS: math.radians(5.0), JointKind.SLIDES: 0.01}
"""Speeds above which this is no first motion, in [rad/s] and [m/s]."""
FURTHEST = {JointKind.TURNS: math.radians(20.0), JointKind.SLIDES: 0.05}
"""Distances likewise, in [rad] and [m]."""
INCREMENTS_MIN = 4  # of the drive that a motion has to have to be seen


def too_far(kind: JointKind, distance: float) -> str:
    """Return why a distance in [rad] or [m] is too long for a first motion, else empty."""
    if 0.0 < abs(distance) <= FURTHEST[kind]:
        return ''
    return (
        f'{kind.shown(distance)}: a first motion is short, up to {kind.shown(FURTHEST[kind])} and '
        'not 0'
    )


def too_fast(kind: JointKind, speed: float) -> str:
    """Return why a speed in [rad/s] or [m/s] is too high for a first motion, else empty."""
    if 0.0 < speed <= FASTEST[kind]:
        return ''
    return (
        f'{kind.shown(speed)}/s: a first motion is slow; give a speed above 0 and up to '
        f'{kind.shown(FASTEST[kind])} per second'
    )


def too_few_increments(kind: JointKind, distance: float, scale: float) -> str:
    """Return why a distance in [rad] or [m] is too small to see, else empty.

    The scale is in increments per [rad] or [m].
    """
    increments = abs(distance * scale)
    if increments >= INCREMENTS_MIN:
        return ''
    return (
        f'{kind.shown(distance)} are {increments:.2g} increments, too few to be seen; correct '
        'scale_pos_to_dev, or take a larger distance'
    )


LIKE = 1.5  # factor by which a distance that was seen by eye may be off
MOVED = 0.2  # share of the commanded distance from which the drive reports a motion
DEGREES = 180.0 / math.pi
TURN = 2.0 * math.pi


class Verdict(Enum):
    """Verdict on a motion; the value is the text for the user."""

    RIGHT = 'direction and distance are right'
    WRONG_SIGN = 'wrong sign: it moved the other way'
    WRONG_SCALE = 'wrong scale: it moved another distance'
    WRONG_SIGN_AND_SCALE = 'wrong sign and wrong scale'
    NO_MOTION = 'nothing moved'
    ENCODER_ONLY = 'the drive reports a motion that was not seen'
    NOT_REPORTED = 'a motion was seen that the drive does not report'
    OTHER_JOINT = 'another joint moved'

    @property
    def wants_change(self) -> bool:
        """Whether a change of the scales in bus.yml corrects it."""
        return self in {
            Verdict.WRONG_SIGN,
            Verdict.WRONG_SCALE,
            Verdict.WRONG_SIGN_AND_SCALE,
        }


@dataclass(frozen=True, slots=True)
class Cause:
    """Why a scale is wrong by a factor."""

    factor: float  # seen over reported
    text: str  # the cause in words
    kinds: frozenset[JointKind] = frozenset(JointKind)  # joints that it can have


_TURNS, _SLIDES = frozenset({JointKind.TURNS}), frozenset({JointKind.SLIDES})
_LINES = 'encoder lines in the place of their four edges (quadrature)'

CAUSES: tuple[Cause, ...] = (
    Cause(1 / 4, f'the scale counts {_LINES}'),
    Cause(4.0, 'the scale counts four edges (quadrature) of an encoder that has them already'),
    Cause(1 / DEGREES, 'the scale is increments per degree, it has to be per rad', _TURNS),
    Cause(DEGREES, 'the scale was multiplied by 180/pi, it has to be per rad', _TURNS),
    Cause(TURN, 'the scale is increments per turn, it has to be per rad', _TURNS),
    Cause(1 / TURN, 'the scale was divided by 2 pi twice', _TURNS),
    Cause(1 / 360, 'the scale was divided by 360', _TURNS),
    Cause(360.0, 'the scale was multiplied by 360', _TURNS),
    Cause(1 / 1000, 'the scale is increments per mm, it has to be per m', _SLIDES),
    Cause(1000.0, 'the scale was multiplied by 1000; it is increments per m', _SLIDES),
)
"""Usual mistakes; those of gear and factor group are derived from the drive."""


@dataclass(frozen=True, slots=True)
class DriveFacts:
    """What the drive reports about its increments; None if it does not."""

    scale: float  # increments per unit that the master uses; negative for the other direction
    gear: float | None = None  # turns of the motor per turn of the shaft (0x6091)
    # increments per rad by its factor group (0x608F, 0x6091, 0x6092)
    factor_scale: float | None = None


@dataclass(frozen=True, slots=True)
class Seen:
    """What a person observed."""

    direction: int  # 1, -1, or 0 for no motion
    distance: float | None = None  # how far about, in [rad] or [m]; None for what was expected
    other_joint: bool = False  # another joint has moved


@dataclass(frozen=True, slots=True)
class Judgement:
    """Result of :func:`judge`."""

    verdict: Verdict  # the conclusion
    sign: int = 1  # -1 where the scale has the wrong sign, else 1
    measured: float = 1.0  # seen over reported, without the sign; 1 where no distance was said
    # likely causes of a wrong scale, the nearest first; empty when no usual one fits
    causes: tuple[Cause, ...] = field(default=())
    remedy: str = ''  # what else to look at, in words; empty where a change of bus.yml corrects it


def judge(
    kind: JointKind, commanded: float, reported: float, seen: Seen, facts: DriveFacts
) -> Judgement:
    """Judge a motion by its commanded, reported ([rad] or [m]) and observed distances."""
    if seen.other_joint:
        return Judgement(
            Verdict.OTHER_JOINT,
            remedy='two node ids are exchanged: compare node_id of this joint in bus.yml with the '
            'address that its drive is set to, and the motor and encoder cables of both drives',
        )
    has_reported = abs(reported) >= MOVED * abs(commanded)
    if seen.direction == 0:
        return _still(moved=has_reported)
    if not has_reported:
        return Judgement(
            Verdict.NOT_REPORTED,
            remedy='the encoder of the joint does not reach the drive: look at its cable and the '
            'encoder settings of the drive, and at 0x6064 while the joint is moved by hand',
        )
    sign = 1 if seen.direction * reported > 0 else -1
    measured = 1.0 if seen.distance is None else seen.distance / abs(reported)
    is_scaled, causes = _causes(kind, measured, facts)
    if is_scaled:
        verdict = Verdict.WRONG_SCALE if sign > 0 else Verdict.WRONG_SIGN_AND_SCALE
        return Judgement(verdict, sign, measured, causes)
    return Judgement(Verdict.RIGHT if sign > 0 else Verdict.WRONG_SIGN, sign, measured)


def _still(*, moved: bool) -> Judgement:
    if moved:
        return Judgement(
            Verdict.ENCODER_ONLY,
            remedy='either the motion is too small to be seen, so that the scale has too few '
            'increments per unit: repeat it over a larger distance and say how far it went; or '
            'the motor turns and the joint does not: look at the coupling between them',
        )
    return Judgement(
        Verdict.NO_MOTION,
        remedy='look at the brake (does the drive release it, 0x60FE?), at the safe torque off, '
        'at the torque limit 0x6072, and whether the scale has far too few increments per unit: '
        'then repeat it over a larger distance',
    )


def _causes(kind: JointKind, measured: float, facts: DriveFacts) -> tuple[bool, tuple[Cause, ...]]:
    """Return whether the scale is wrong, and possible causes."""
    if measured <= 0.0:
        return False, ()
    own = list(_causes_of_drive(kind, facts))
    usual = [cause for cause in CAUSES if kind in cause.kinds]
    own.sort(key=lambda cause: _apart(measured, cause.factor))
    usual.sort(key=lambda cause: _apart(measured, cause.factor))
    likely = _distinct(
        [cause for cause in (*own, *usual) if _apart(measured, cause.factor) < math.log(LIKE)]
    )
    nearest = min((_apart(measured, cause.factor) for cause in likely), default=math.inf)
    if _apart(measured, 1.0) < math.log(LIKE) and _apart(measured, 1.0) <= nearest:
        return False, ()
    return True, likely


def _causes_of_drive(kind: JointKind, facts: DriveFacts) -> Iterable[Cause]:
    """Yield causes that follow from the drive's facts, except factors near 1."""
    if kind is JointKind.TURNS and facts.factor_scale:
        yield from _unless_one(
            abs(facts.scale) / facts.factor_scale,
            f'the drive has {facts.factor_scale:g} increments per rad by its factor group (0x608F,'
            f' 0x6091, 0x6092), bus.yml {abs(facts.scale):g}',
        )
    if facts.gear:
        gear = f'the gear of {facts.gear:g} (0x6091)'
        yield from _unless_one(1.0 / facts.gear, f'{gear} is missing in the scale')
        yield from _unless_one(facts.gear, f'{gear} is in the scale twice')


def _unless_one(factor: float, text: str) -> Iterable[Cause]:
    if _apart(factor, 1.0) > math.log(1.05):
        yield Cause(factor, text)


def _distinct(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """Keep only the first of the causes with the same factor."""
    kept: list[Cause] = []
    for cause in causes:
        if all(_apart(cause.factor, other.factor) > math.log(1.01) for other in kept):
            kept.append(cause)
    return tuple(kept)


def _apart(first: float, second: float) -> float:
    return abs(math.log(first / second))


SAME = 1e-6  # share by which two scales may differ and still be the same


@dataclass(frozen=True, slots=True)
class AxisScales:
    """Scales of an axis: keys of bus.yml, with the values that the master uses."""

    scale_from_factor_group: bool  # the drive says how it counts (0x608F, 0x6091, 0x6092, 0x6096)
    scale_pos_to_dev: float  # increments per [rad] or [m]
    scale_pos_from_dev: float  # [rad] or [m] per increment
    scale_vel_to_dev: float  # velocity units of the drive per [rad/s] or [m/s]
    scale_vel_from_dev: float  # [rad/s] or [m/s] per velocity unit of the drive
    scale_eff_to_dev: float  # torque units of the drive per unit of effort
    scale_eff_from_dev: float  # units of effort per torque unit of the drive
    offset_pos_from_dev: float  # added to a position after scaling, in [rad] or [m]

    @classmethod
    def of(cls, source: object) -> AxisScales:
        """Copy the scales from an object with attributes of these names."""
        return cls(**{each.name: getattr(source, each.name) for each in fields(cls)})


def corrected(axis: AxisScales, sign: int, factor: float) -> dict[str, float | bool]:
    """Return the keys to change with their new values, in the order of the file.

    A ``sign`` of -1 reverses the direction; ``factor`` is observed over reported distance,
    unsigned.
    """
    change = sign / factor
    to_dev = axis.scale_pos_to_dev * change
    # a velocity in increments per second is wrong by the same factor; in rpm, by none that we know
    in_increments = math.isclose(
        abs(axis.scale_vel_to_dev), abs(axis.scale_pos_to_dev), rel_tol=SAME
    )
    velocity = axis.scale_vel_to_dev * (change if in_increments else sign)
    values: dict[str, float | bool] = {}
    if axis.scale_from_factor_group:
        values['scale_from_factor_group'] = False
    values |= {
        'scale_pos_to_dev': to_dev,
        'scale_pos_from_dev': 1.0 / to_dev,
        'scale_vel_to_dev': velocity,
        'scale_vel_from_dev': 1.0 / velocity,
    }
    effort = math.copysign(axis.scale_eff_to_dev, to_dev)  # torque turns with the position
    if sign < 0 and effort != axis.scale_eff_to_dev:
        values |= {
            'scale_eff_to_dev': effort,
            'scale_eff_from_dev': math.copysign(axis.scale_eff_from_dev, to_dev),
        }
    if axis.offset_pos_from_dev:  # the place of the zero stays
        values['offset_pos_from_dev'] = axis.offset_pos_from_dev / change
    return {name: _rounded(value) for name, value in values.items()}


def _rounded(value: float | bool) -> float | bool:
    """Remove rounding errors of double precision, such as 1.0000000000000002."""
    return value if isinstance(value, bool) else float(f'{value:.12g}')


LIMITS = 'limits 0x607D are in increments: those that were computed with the old scale are wrong'
ACCELERATIONS = 'scale_acc_to_dev, where it is written, changes by the factor of scale_vel_to_dev'
VELOCITIES = 'scale_vel_to_dev is in other units than increments per second: check it, too'


@dataclass(frozen=True, slots=True)
class Correction:
    """Keys of a device to change."""

    values: Mapping[str, float | bool]  # new values by key
    before: Mapping[str, float | bool]  # the values that count now, by key
    reason: str  # why, in a line
    notes: tuple[str, ...]  # what else to look at


def propose(scales: AxisScales, judgement: Judgement, cause: Cause | None) -> Correction:
    """Return the correction of a sign or scale; cause None uses the observed factor."""
    turned = 'the sign was wrong'
    if judgement.verdict is Verdict.WRONG_SIGN:
        factor, why = 1.0, turned
    else:
        sign = f'{turned}, and ' if judgement.sign < 0 else ''
        factor = judgement.measured if cause is None else cause.factor
        what = f'the scale by {factor:.4g}, by eye' if cause is None else cause.text
        why = f'{sign}{what}'
    values = corrected(scales, judgement.sign, factor)
    accelerations = (ACCELERATIONS,) if factor != 1.0 else ()
    same_units = math.isclose(abs(scales.scale_vel_to_dev), abs(scales.scale_pos_to_dev))
    odd_velocity = not same_units and factor != 1.0
    return Correction(
        values,
        {key: getattr(scales, key) for key in values},
        f'first motion: {why}; scale_pos_to_dev was {scales.scale_pos_to_dev!r}',
        (*((VELOCITIES,) if odd_velocity else ()), *accelerations, LIMITS),
    )


def yaml_text(value: float | bool) -> str:
    """Format a value for YAML 1.1, which reads 2e-05 as text, but 2.0e-05 as a number."""
    if isinstance(value, bool):
        return str(value).lower()
    mantissa, exponent, power = repr(value).partition('e')
    return f'{mantissa}{"" if "." in mantissa or not exponent else ".0"}{exponent}{power}'
