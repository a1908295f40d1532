# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Options for running a policy, and the report of its check.

Training gains are compared with the servos of the robot. A position servo with stiffness
:math:`k`, damping :math:`d` and an inertia :math:`J` at its joint is a low-pass of second order
with :math:`\omega = \sqrt{k / J}` and :math:`\zeta = d / (2 \sqrt{k J})`; its bandwidth is
the -3 dB frequency.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
import json
import math
from pathlib import Path
from typing import Any

from robot_primitives import setting, settings_of, switch

from ..exceptions import check_settings, ParameterError
from .contract.model import Gains


class Verdict(Enum):
    """Result of one check."""

    OK = 'ok'
    WARN = 'warn'
    REFUSE = 'REFUSE'


@dataclass(frozen=True, slots=True)
class Row:
    """One check and its result."""

    subject: str  # what
    expected: str  # what it should be
    found: str  # what it is
    verdict: Verdict  # what follows


@dataclass(frozen=True, slots=True)
class Report:
    """All rows of a check."""

    rows: tuple[Row, ...]

    @property
    def refused(self) -> bool:
        """Whether the policy was rejected."""
        return any(row.verdict is Verdict.REFUSE for row in self.rows)

    @property
    def reason(self) -> str:
        """Why the policy was rejected, in one line."""
        return '; '.join(
            f'{row.subject}: {row.found} instead of {row.expected}'
            for row in self.rows
            if row.verdict is Verdict.REFUSE
        )

    def __str__(self) -> str:
        """Return the report as a text table."""
        rows = [('check', 'expected', 'found', '')]
        rows += [(row.subject, row.expected, row.found, row.verdict.value) for row in self.rows]
        return table_text(rows)


def table_text(rows: Sequence[Sequence[str]], *, numbers: bool = False, widest: int = 1000) -> str:
    """Format rows as a text table with aligned columns.

    Args:
        rows: Their cells; the first row has the headings.
        numbers: Right-align all columns but the first.
        widest: Longer cells overflow and do not widen their column.
    """
    widths = [min(max(map(len, column)), widest) for column in zip(*rows, strict=True)]
    return '\n'.join(
        '  '.join(
            cell.rjust(width) if numbers and column else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


MAX_RATIO = 1.5  # of two gains or bandwidths that count as near each other
STATED = 'gains of the training'


@dataclass(frozen=True, slots=True)
class ServoResponse:
    """Response of a servo to its target."""

    stiffness: float  # torque per position error in [N m/rad]
    damping: float  # torque per speed in [N m s/rad], of motor and control together
    inertia: float  # of rotor and gear at the joint in [kg m2]
    latency: float = 0.0  # from a target to a set-point that is there, in the mean, in [s]

    @property
    def bandwidth(self) -> float:
        """-3 dB bandwidth in [Hz]."""
        natural = math.sqrt(self.stiffness / self.inertia)
        ratio = self.damping / (2.0 * math.sqrt(self.stiffness * self.inertia))
        bend = 1.0 - 2.0 * ratio**2
        return natural * math.sqrt(bend + math.sqrt(bend**2 + 1.0)) / math.tau


def gain_rows(gains: Gains | None, servo: ServoResponse | None, period: float) -> Iterator[Row]:
    """Compare the training gains with those of the servos; None means unknown."""
    if gains is None:
        if servo is not None:
            here = f'{servo.stiffness:g} N m/rad, {servo.bandwidth:.1f} Hz'
            yield Row(STATED, f"near the servos' {here}", 'not stated', Verdict.OK)
        return
    if servo is None:
        found = f'{_span(gains.stiffness)} N m/rad, {_span(gains.damping)} N m s/rad'
        yield Row(STATED, "near the servos'", found, Verdict.OK)
        return
    if min(gains.stiffness) <= 0.0 or min(gains.damping) < 0.0:
        found = f'{_span(gains.stiffness)} N m/rad, {_span(gains.damping)} N m s/rad'
        yield Row(STATED, 'stiffness above 0', found, Verdict.WARN)
        return
    yield _row(
        'stiffness of the training',
        f"the servos' {servo.stiffness:g}",
        f'{_span(gains.stiffness)} N m/rad',
        servo.stiffness / _farthest(gains.stiffness, servo.stiffness),
        ('a target pulls {:.1f} times as hard, steps get hard and overshoot',
         'joints sag {:.1f} times as far, it goes lower and slower'),
    )  # fmt: skip
    trained = [
        ServoResponse(stiffness, damping, servo.inertia).bandwidth
        for stiffness, damping in zip(gains.stiffness, gains.damping, strict=True)
    ]
    yield _row(
        'bandwidth of the training',
        f"the servos' {servo.bandwidth:.1f} Hz with {servo.damping:g}",
        f'{_span(trained, ".1f")} Hz with {_span(gains.damping)} N m s/rad',
        servo.bandwidth / _farthest(trained, servo.bandwidth),
        ('joints follow {:.1f} times as fast, what it smoothed gets through',
         'joints follow {:.1f} times as slowly, feet lift and land late'),
    )  # fmt: skip
    verdict = Verdict.OK if servo.latency <= 0.5 * period else Verdict.WARN
    found = f'{servo.latency * 1e3:g} ms more than a training without any'
    expected = f'up to {0.5 * period * 1e3:g} ms'
    yield Row('latency of the servos', expected, found, verdict)


def _row(subject: str, expected: str, found: str, ratio: float, does: tuple[str, str]) -> Row:
    """Warn if the servos differ much from the training."""
    if 1.0 / MAX_RATIO <= ratio <= MAX_RATIO:
        return Row(subject, expected, found, Verdict.OK)
    text = does[0].format(ratio) if ratio > 1.0 else does[1].format(1.0 / ratio)
    return Row(subject, expected, f'{found}: here {text}', Verdict.WARN)


def _farthest(values: Sequence[float], from_value: float) -> float:
    """Return the value whose ratio to the reference is farthest from one."""
    return max(values, key=lambda value: abs(math.log(value / from_value)))


def _span(values: Sequence[float], form: str = 'g') -> str:
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f'{low} to {high}'


class GravitySource(Enum):
    """Source of the gravity direction.

    ``BLEND`` mixes a little of the accelerometer into the orientation while it reads about 1 g.
    """

    ACCEL = 'accel'
    EULER = 'euler'
    BLEND = 'blend'


class ImuFrame(Enum):
    """Frame of the angular velocity that the policy expects; ``AUTO`` reads the contract."""

    AUTO = 'auto'
    BASE = 'base'
    YAWED = 'yawed'


@dataclass(frozen=True, slots=True)
class PolicyOptions:
    """Options of the policy runner."""

    # file whose values count before those in the policy's own; None for none
    contract: Path | None = None
    phase_period: float = setting(0.0, 0.0, 10.0, '[s]; 0: that of the contract')
    imu_frame: ImuFrame = switch(  # noqa: RUF009  # a field
        ImuFrame.AUTO,
        'frame of the angular velocity; yawed: turned by 180 degrees; auto: that of the file',
    )
    gravity_source: GravitySource = switch(  # noqa: RUF009  # a field
        GravitySource.BLEND, 'of the direction of gravity'
    )
    hold_missing: bool = switch(
        False, 'joints of the policy that the robot lacks count as being at their default'
    )
    soft_limits: float = setting(
        0.9, 0.1, 1.0, "share of a joint's range that its targets may use"
    )
    low_pass: float = setting(0.0, 0.0, 100.0, 'cut-off of a filter of its targets [Hz]; 0: none')
    # how the servos of the robot follow, to be compared with those of the training; None when
    # nobody knows
    servo: ServoResponse | None = None

    def __post_init__(self) -> None:
        """Reject values outside of their ranges.

        Raises:
            ParameterError: A value is out of range.
        """
        check_settings(self, 'policy_')

    def to_json(self) -> str:
        """Return all options that affect observations and targets, except the contract file."""
        values = {name: getattr(self, name) for name, *_ in settings_of(self)}
        return json.dumps(values, default=lambda choice: choice.value)

    @classmethod
    def from_json(cls, text: str, contract: Path | None = None) -> PolicyOptions:
        """Read the result of :meth:`to_json`, with a contract file added.

        Raises:
            ParameterError: The text has another format.
        """
        try:
            values: dict[str, Any] = json.loads(text)
            for name, default, *_ in settings_of(cls):
                if name in values and isinstance(default, Enum):
                    values[name] = type(default)(values[name])
            return cls(contract=contract, **values)
        except (ValueError, TypeError, AttributeError) as error:
            raise ParameterError(f'options of a policy {text!r}: {error}') from error
