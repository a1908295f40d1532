# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""The gains of a training against the servos of the robot, and what a difference does.

A position servo with stiffness :math:`k`, damping :math:`d` and an inertia :math:`J` at its joint
is a low-pass of second order with :math:`\omega = \sqrt{k / J}` and
:math:`\zeta = d / (2 \sqrt{k J})`; its bandwidth is where it has lost 3 dB.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math

from .contract.model import Gains
from .report import Row, Verdict

MAX_RATIO = 1.5  # of two gains or bandwidths that count as near each other
STATED = 'gains of the training'


@dataclass(frozen=True, slots=True)
class ServoResponse:
    """How a servo follows its target."""

    stiffness: float  # torque per position error in [N m/rad]
    damping: float  # torque per speed in [N m s/rad], of motor and control together
    inertia: float  # of rotor and gear at the joint in [kg m2]
    latency: float = 0.0  # from a target to a set-point that is there, in the mean, in [s]

    @property
    def bandwidth(self) -> float:
        """Frequency at which it has lost 3 dB in [Hz]."""
        natural = math.sqrt(self.stiffness / self.inertia)
        ratio = self.damping / (2.0 * math.sqrt(self.stiffness * self.inertia))
        bend = 1.0 - 2.0 * ratio**2
        return natural * math.sqrt(bend + math.sqrt(bend**2 + 1.0)) / math.tau


def gain_rows(gains: Gains | None, servo: ServoResponse | None, period: float) -> Iterator[Row]:
    """Compare the gains of a training with the servos.

    Args:
        gains: Of the training; None when nobody said.
        servo: Of the robot; None when nobody knows.
    """
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
    """Warn where the servos have much more or much less than the training."""
    if 1.0 / MAX_RATIO <= ratio <= MAX_RATIO:
        return Row(subject, expected, found, Verdict.OK)
    text = does[0].format(ratio) if ratio > 1.0 else does[1].format(1.0 / ratio)
    return Row(subject, expected, f'{found}: here {text}', Verdict.WARN)


def _farthest(values: Sequence[float], from_value: float) -> float:
    """Return the value whose ratio to another one is the farthest from one."""
    return max(values, key=lambda value: abs(math.log(value / from_value)))


def _span(values: Sequence[float], form: str = 'g') -> str:
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f'{low} to {high}'
