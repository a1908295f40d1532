# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Findings of a policy check: the verdict, text tables, a CSV file."""

from __future__ import annotations

from collections.abc import Iterator
import csv
from dataclasses import dataclass, field
import math
from typing import TextIO

import numpy as np

from ..gait.velocity import Velocity
from ..policy.contract.model import PolicyContract, Source
from ..policy.network import Floats, OnnxNetwork
from ..policy.observation import observed_places
from .course import AXES, CourseFigures, Passage

MAX_LACK, MAX_EXCESS = 0.5, 0.2
"""Shares of what is commanded along an axis that may be missing, and be too much."""
MAX_DRIFT = Velocity(0.04, 0.04, 0.1)
"""What a policy may be off along an axis in any case in [m/s] and [rad/s]."""
MAX_SATURATION = 0.2
"""Share of the time that servos may be at their limits, where the gait's are not."""
MIN_EFFECT = 0.1
"""Of a term on the actions, as part of how they vary, to be seen on a walk."""
TINY = 1e-6
LATENCY_GOAL, JITTER_GOAL = 0.003, 0.002
"""Of commands on the wire with real-time priority: median and 99th percentile in [s]."""


def astray(went: Velocity, commanded: Velocity) -> Iterator[str]:
    """Yield the axes with a large velocity error, each with a hint at the cause."""
    for axis in ('x', 'y', 'yaw'):
        got, want, drift = (getattr(each, axis) for each in (went, commanded, MAX_DRIFT))
        most = MAX_EXCESS if got * want > want**2 else MAX_LACK
        if abs(got - want) <= max(most * abs(want), drift):
            continue
        if abs(got) <= drift:
            hint = 'hardly any: look at the command, action.scale, and the servos (--servo)'
        elif got * want < 0.0:
            hint = 'the other way: look at the order of its joints, and at signs (scales below 0)'
        elif abs(got) < abs(want):
            hint = 'too slow: is it made for other servos (--servo), or a smaller scale?'
        else:
            hint = 'too far: look at its scales, and at the frame of the IMU'
        yield f'{axis} went {got:+.3f} of {want:+.3f}, {hint}'


def unseen_terms(
    network: OnnxNetwork, contract: PolicyContract, observed: Floats
) -> Iterator[str]:
    """Yield observation terms with too little influence for a walk to verify them.

    The network must not be recurrent; each row of ``observed`` is an observation of the walk.
    """
    plain = _answers(network, observed)
    # what varies is mirrored about its mean: all of gravity turned round is another robot
    varies = observed.std(0) > TINY
    mirrored = np.where(varies, 2.0 * observed.mean(0), 0.0).astype(np.float32) - observed
    usual = math.sqrt(float(plain.var(0).mean()))
    places = observed_places(contract) % sum(term.width for term in contract.terms)
    start = 0
    for term in contract.terms:
        mine = (places >= start) & (places < start + term.width)
        start += term.width
        if term.source is Source.CONSTANT:
            continue
        other = _answers(network, np.where(mine, mirrored, observed))
        effect = math.sqrt(float(((other - plain) ** 2).mean())) / max(usual, TINY)
        if effect < MIN_EFFECT:
            yield (
                f'{term.name} hardly counts (mirrored, it changes the actions by {effect:.0%} of '
                'how they vary): a walk need not show that its frame, a sign or its scale is wrong'
            )


def _answers(network: OnnxNetwork, observed: Floats) -> Floats:
    return np.concatenate([network.run(row[np.newaxis]) for row in observed])


def against_gait(policy: CourseFigures, gait: CourseFigures) -> Iterator[str]:
    """Yield why a policy fails on a course that the gait also walked."""
    if not any(each.time for each in policy.passages):
        yield 'it never came to walk'
        return
    if policy.falls > gait.falls:
        yield f'it fell {policy.falls} times, the gait {gait.falls}'
    for each, other in zip(policy.passages, gait.passages, strict=True):
        gone_astray = list(astray(each.went, each.commanded)) if each.time else []
        if gone_astray:
            so_did_the_gait = other.time and any(astray(other.went, other.commanded))
            alike = ' (so does the gait: look at the servos)' if so_did_the_gait else ''
            yield f'commanded {velocity_text(each.commanded)}: {"; ".join(gone_astray)}{alike}'
    for name, what in (('torque_saturation', 'torque'), ('speed_saturation', 'speed')):
        share, others = policy.mean(name), gait.mean(name)
        if share > MAX_SATURATION and share > 2.0 * others:
            yield (
                f'its servos are at their largest {what} for {share:.0%} of the time, '
                f'those of the gait for {others:.0%}'
            )


def timing_notes(figures: CourseFigures) -> Iterator[str]:
    """Yield notes on late commands on the wire, which are no fault of the policy."""
    timing = figures.timing
    if timing is None:
        return
    latency, jitter = timing.latency(0.5), timing.jitter(0.99)
    if latency > LATENCY_GOAL:
        yield (
            f'observation to command took {latency * 1e3:.1f} ms (median), '
            f'goal {LATENCY_GOAL * 1e3:g} ms'
        )
    if jitter > JITTER_GOAL:
        yield (
            f'commands were {jitter * 1e3:.1f} ms off their period (p99), '
            f'goal {JITTER_GOAL * 1e3:g} ms: a busy machine, or no real-time priority'
        )


def is_too_late(figures: CourseFigures, period: float) -> bool:
    """Return whether commands were too late for the walk to be judged."""
    return figures.timing is not None and figures.timing.jitter(0.99) > period


def velocity_text(velocity: Velocity) -> str:
    """Return a velocity as readable text."""
    return f'{velocity.x:+.3f} {velocity.y:+.3f} m/s {velocity.yaw:+.2f} rad/s'


POLICY, GAIT = 'policy', 'gait'


@dataclass(frozen=True, slots=True)
class Compared:
    """Results of policy and gait on the same course."""

    title: str  # where that was
    policy: CourseFigures  # what the policy came to
    gait: CourseFigures  # what the gait came to


@dataclass(slots=True)
class Findings:
    """All findings of a policy check."""

    courses: list[Compared] = field(default_factory=list)  # courses that policy and gait walked
    walks: list[CourseFigures] = field(default_factory=list)  # those of a policy alone
    reasons: list[str] = field(default_factory=list)  # why it does not stand up
    notes: list[str] = field(default_factory=list)  # what else is to be known


Table = list[tuple[str, ...]]
"""Rows of cells; the first one has the headings."""


def tracking_table(compared: Compared) -> Table:
    """Return the table of commanded velocities and those that policy and gait reached."""
    table: Table = [('axis', 'commanded', POLICY, 'off by', GAIT, 'off by')]
    for mine, other in zip(compared.policy.passages, compared.gait.passages, strict=True):
        axis = mine.axis
        commanded = _along(axis, mine.commanded)
        cells = [axis, f'{commanded:+.3f} {"rad/s" if axis == "turn" else "m/s"}']
        for each in (mine, other):
            error = each.turning_error if axis == 'turn' else each.error
            cells += [_number(_along(axis, each.went), '+.3f'), _number(error, '.3f')]
        table.append(tuple(cells))
    return table


def figures_table(compared: Compared) -> Table:
    """Return the table of results for whole courses."""
    pair = compared.policy, compared.gait
    rows: Table = [('', POLICY, GAIT)]
    for axis in AXES:
        name, unit = ('turning_error', 'rad/s') if axis == 'turn' else ('error', 'm/s')
        cells = [_number(each.mean(name, axis), '.3f') for each in pair]
        if any(passage.axis == axis for passage in pair[0].passages):
            rows.append((f'{axis}, off by [{unit}]', *cells))
    rows.append(('falls in a minute', *(_number(each.falls_per_minute, '.1f') for each in pair)))
    for title, name, form, factor in (
        ('largest tilt, mean [deg]', 'tilt', '.1f', 180.0 / math.pi),
        ('servos at their largest torque [%]', 'torque_saturation', '.1f', 100.0),
        ('joints at their largest speed [%]', 'speed_saturation', '.1f', 100.0),
        ('bend of the targets, rms [mrad]', 'smoothness', '.1f', 1e3),
        ('cost of transport', 'cost_of_transport', '.2f', 1.0),
    ):
        rows.append((title, *(_number(factor * each.mean(name), form) for each in pair)))
    timings = [each.timing for each in pair]
    if any(timings):
        for title, share, kind in (
            ('observation to command, p50 [ms]', 0.5, 'latency'),
            ('observation to command, p99 [ms]', 0.99, 'latency'),
            ('jitter of commands, p99 [ms]', 0.99, 'jitter'),
        ):
            figures = [
                math.nan if each is None else getattr(each, kind)(share) for each in timings
            ]
            rows.append((title, *(_number(1e3 * each, '.1f') for each in figures)))
    return rows


CSV_COLUMNS = (
    *('tried', 'walker', 'axis', 'commanded x [m/s]', 'commanded y [m/s]'),
    *('commanded yaw [rad/s]', 'went x [m/s]', 'went y [m/s]', 'went yaw [rad/s]'),
    *('tilt [rad]', 'time [s]', 'falls', 'torque saturation', 'speed saturation'),
    *('smoothness [rad]', 'cost of transport', 'latency p50 [s]', 'latency p99 [s]'),
    'jitter p99 [s]',
)


def write_csv(file: TextIO, findings: Findings) -> None:
    """Write one row for each command that policy or gait walked; unmeasured cells are empty."""
    writer = csv.writer(file, lineterminator='\n')
    writer.writerow(CSV_COLUMNS)
    courses = [('walk', POLICY, figures) for figures in findings.walks]
    for compared in findings.courses:
        courses += [(compared.title, POLICY, compared.policy)]
        courses += [(compared.title, GAIT, compared.gait)]
    for title, who, course in courses:
        writer.writerows(_csv_row(title, who, each) for each in course.passages)


def _csv_row(title: str, who: str, passage: Passage) -> list[str | float]:
    timing = passage.timing
    times = () if timing is None else (
        timing.latency(0.5), timing.latency(0.99), timing.jitter(0.99)
    )  # fmt: skip
    figures = (
        *(passage.tilt, passage.time, passage.falls, passage.torque_saturation),
        *(passage.speed_saturation, passage.smoothness, passage.cost_of_transport),
    )
    values = *passage.commanded, *passage.went, *figures, *times
    row = [title, who, passage.axis, *('' if math.isnan(value) else value for value in values)]
    return row + [''] * (len(CSV_COLUMNS) - len(row))


def _along(axis: str, velocity: Velocity) -> float:
    return float(getattr(velocity, AXES[axis]))


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else '-'
