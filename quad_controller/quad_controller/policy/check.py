# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The check of a policy before it may move anything: one row for each thing that must agree."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from quad_description import Quadruped, Targets

from .metadata import PolicyMetadata
from .network import FLOAT, Floats, Network
from .observation import ALIASES, TERMS, width
from .options import ImuFrame, PolicyOptions, VENDOR_PHASE_PERIOD, VENDOR_STEP_PERIOD

MAX_POSE_DISTANCE = 0.8  # [rad] of the default pose from where the gait stands
MAX_SCALE = 1.0  # [rad] an action of one may move a joint by
MAX_RESTING_ACTION = 1.0  # [rad] a policy that wants more while standing is another robot's
MAX_PERIOD_ERROR = 0.02  # of the loop's period, that of the training may differ by
PHASE_PERIODS = (0.1, 5.0)  # [s] of a gait of legs of this size
MAX_THRESHOLD = 1.0  # a gait that has no phase at faster commands is none
WARM_UP = 20
TIMED_RUNS = 100
MAX_LATENCY_RATIO = 0.25  # of the period


class Verdict(Enum):
    """What follows from a row."""

    OK = 'ok'
    WARN = 'warn'
    REFUSE = 'REFUSE'


@dataclass(frozen=True, slots=True)
class Row:
    """One thing that was looked at.

    Attributes:
        subject: What.
        expected: What it should be.
        found: What it is.
        verdict: What follows.
    """

    subject: str
    expected: str
    found: str
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Report:
    """All rows."""

    rows: tuple[Row, ...]

    @property
    def refused(self) -> bool:
        """Whether the policy must not be followed."""
        return any(row.verdict is Verdict.REFUSE for row in self.rows)

    @property
    def reason(self) -> str:
        """What the policy is refused for, in one line."""
        return '; '.join(
            f'{row.subject}: {row.found} instead of {row.expected}'
            for row in self.rows
            if row.verdict is Verdict.REFUSE
        )

    def __str__(self) -> str:
        """Return a table for people."""
        cells = [('check', 'expected', 'found', '')]
        cells += [(row.subject, row.expected, row.found, row.verdict.value) for row in self.rows]
        widths = [max(len(line[column]) for line in cells) for column in range(3)]
        return '\n'.join(
            '  '.join(
                [*(cell.ljust(size) for cell, size in zip(line, widths, strict=False)), line[3]]
            )
            for line in cells
        )


def check_contract(
    network: Network,
    metadata: PolicyMetadata,
    robot: Quadruped,
    stand: Targets,
    *,
    options: PolicyOptions,
    period: float,
) -> Iterator[Row]:
    """Compare what a policy declares with the robot; yields a row for each.

    Args:
        network: The network.
        metadata: What its file has.
        robot: The robot.
        stand: Where the gait stands [rad].
        options: How it shall be run.
        period: Time between two steps in [s].
    """
    count = len(metadata.joint_names)
    yield _shape('input', network.inputs, width(count), f'11 + 3 x {count} joints')
    yield _shape('output', network.outputs, count, f'{count} joints')
    yield from _sizes('observation', metadata.observation_sizes, width(count))
    yield from _sizes('action', metadata.action_sizes, count)
    yield from _rates(metadata, period)
    yield from _joints(metadata, robot, options)
    yield from _lengths(metadata)
    yield from _defaults(metadata, robot, stand)
    largest = max((abs(scale) for scale in metadata.action_scale), default=0.0)
    fits = all(0.0 < scale <= MAX_SCALE for scale in metadata.action_scale)
    yield _row('action_scale', f'0 to {MAX_SCALE:g} rad', f'{largest:g}', fits)
    yield _observation(metadata.observation_names)
    unusual = ', '.join(f'{key} = {value}' for key, value in metadata.unusual.items())
    yield _row('history, scale, clip', 'none', unusual or 'none', not unusual)
    if metadata.unknown:
        unknown = ', '.join(f'{key} = {value}' for key, value in metadata.unknown.items())
        yield Row('keys', 'understood', f'not understood: {unknown}', Verdict.WARN)
    yield from _assumptions(metadata, options)


def check_answers(
    run: Callable[[Floats], Floats],
    standing: Floats,
    scale: Floats,
    period: float,
    clock: Callable[[], float],
) -> Iterator[Row]:
    """Ask a policy for actions as it will be asked, and look at them.

    Args:
        run: The network.
        standing: The observation of a robot that stands.
        scale: Positions in [rad] for an action of one.
        period: Time between two steps in [s].
        clock: A monotonic clock in [s].
    """
    # all zero is no state of a robot (gravity has a direction): finite numbers will do
    finite = bool(np.isfinite(run(np.zeros_like(standing))).all())
    yield _row('answer to all zero', 'numbers', 'numbers' if finite else 'NaN', finite)
    action = run(standing)
    largest = float(np.abs(action[0] * scale).max())
    # a NaN is not below anything
    fits = largest < MAX_RESTING_ACTION
    yield _row('action standing', f'below {MAX_RESTING_ACTION:g} rad', f'{largest:.3f} rad', fits)
    first = run(standing).copy()
    same = bool(np.array_equal(first, run(standing), equal_nan=True))
    yield _row('the same answer twice', 'yes', 'yes' if same else 'no', same)
    for _ in range(WARM_UP):
        run(standing)
    times = []
    for _ in range(TIMED_RUNS):
        start = clock()
        run(standing)
        times.append(clock() - start)
    late = sorted(times)[int(0.99 * (TIMED_RUNS - 1))]
    most = MAX_LATENCY_RATIO * period
    verdict = Verdict.OK if late < most else Verdict.WARN
    yield Row('time, p99', f'below {most * 1e3:.1f} ms', f'{late * 1e3:.3f} ms', verdict)


def _shape(
    what: str,
    ports: Sequence[tuple[str, str, tuple[object, ...]]],
    expected: int,
    meaning: str,
) -> Row:
    found = ', '.join(f'{kind} {list(shape)}' for _, kind, shape in ports)
    fits = (
        len(ports) == 1
        and ports[0][1] == FLOAT
        and len(ports[0][2]) == 2
        and ports[0][2][1] == expected
        and (ports[0][2][0] == 1 or not isinstance(ports[0][2][0], int))
    )
    return _row(what, f'float [1, {expected}] ({meaning})', found, fits)


def _sizes(what: str, sizes: Mapping[str, float], expected: int) -> Iterator[Row]:
    for key, size in sizes.items():
        yield _row(f'{key} ({what})', f'{expected}', f'{size:g}', size == expected)


def _rates(metadata: PolicyMetadata, period: float) -> Iterator[Row]:
    """Compare the rate that the policy was trained for with that of the loop."""
    said = metadata.step_periods or {"the vendor's": VENDOR_STEP_PERIOD}
    for key, step in said.items():
        fits = abs(step - period) <= MAX_PERIOD_ERROR * period
        expected = f'{1.0 / step:g} Hz ({key})' if step > 0.0 else f'{step:g} s ({key})'
        yield _row('loop_rate', expected, f'{1.0 / period:g} Hz', fits)


def _joints(metadata: PolicyMetadata, robot: Quadruped, options: PolicyOptions) -> Iterator[Row]:
    names = metadata.joint_names
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        yield _row('joint_names', 'each once', f'twice: {", ".join(twice)}', fits=False)
    missing = [name for name in names if name not in robot.names]
    legs = [robot.names[index] for indices in robot.leg_indices for index in indices]
    unmoved = [name for name in legs if name not in names]
    found = f'{len(names)} joints'
    if missing:
        found = f'not in the robot: {", ".join(missing)}'
    if unmoved:
        found += f'; legs without: {", ".join(unmoved)}'
    held = bool(missing) and not unmoved and options.hold_missing
    if held:
        found += ' (held at default)'
    fits = not unmoved and (not missing or held)
    verdict = Verdict.REFUSE if not fits else Verdict.WARN if held else Verdict.OK
    yield Row('joint_names', f"all of the legs', of {len(robot.names)}", found, verdict)
    ours = [name for name in robot.names if name in names]
    order = [name for name in names if name in robot.names]
    moved = 'as in the URDF' if ours == order else 'permuted, by name'
    yield Row('order of joints', 'any', moved, Verdict.OK)


def _lengths(metadata: PolicyMetadata) -> Iterator[Row]:
    count = len(metadata.joint_names)
    for key, values in (
        ('default_joint_pos', metadata.default_joint_pos),
        ('action_scale', metadata.action_scale),
    ):
        if len(values) != count:
            yield _row(f'length of {key}', f'{count}', f'{len(values)}', fits=False)


def _defaults(metadata: PolicyMetadata, robot: Quadruped, stand: Targets) -> Iterator[Row]:
    named = dict(zip(metadata.joint_names, metadata.default_joint_pos, strict=False))
    legs = {index for indices in robot.leg_indices for index in indices}
    outside, farthest, where = [], 0.0, ''
    for index, (name, limits) in enumerate(zip(robot.names, robot.limits, strict=True)):
        if name not in named:
            continue
        # the file has three decimals
        if not limits.lower - 1e-3 <= named[name] <= limits.upper + 1e-3:
            outside.append(f'{name} {named[name]:g}')
        if index in legs and abs(named[name] - stand[index]) > farthest:
            farthest, where = abs(named[name] - stand[index]), name
    yield _row('default pose', 'within limits', ', '.join(outside) or 'within', not outside)
    found = f'{farthest:.2f} rad' + (f' ({where})' if where else '')
    expected = f'{MAX_POSE_DISTANCE:g} rad from our stand'
    yield _row('default pose', expected, found, farthest <= MAX_POSE_DISTANCE)


def _observation(names: tuple[str, ...]) -> Row:
    ours = tuple(ALIASES.get(name, name) for name in names)
    return _row('observation_names', ' '.join(TERMS), ' '.join(names), ours == TERMS)


def _assumptions(metadata: PolicyMetadata, options: PolicyOptions) -> Iterator[Row]:
    """Yield what a file may leave open: some of it is assumed to be the vendor's."""
    known = metadata.phase_period if metadata.phase_period is not None else VENDOR_PHASE_PERIOD
    period = options.phase_period or known
    said = bool(options.phase_period) or metadata.phase_period is not None
    found = f'{period:g} s' if said else f"{period:g} s, the vendor's"
    verdict = Verdict.OK if said else Verdict.WARN
    least, most = PHASE_PERIODS
    fits = least <= period <= most
    expected = f'known, {least:g} to {most:g} s'
    yield Row('phase period', expected, found, verdict if fits else Verdict.REFUSE)
    threshold = metadata.phase_threshold
    if threshold is not None:
        fits = 0.0 <= threshold <= MAX_THRESHOLD
        yield _row('phase threshold', f'0 to {MAX_THRESHOLD:g}', f'{threshold:g}', fits)
    frame = metadata.imu_frame if options.imu_frame is ImuFrame.AUTO else options.imu_frame.value
    known_frames = {ImuFrame.BASE.value, ImuFrame.YAWED.value}
    # no measurement shows which it is, and with the wrong one the policy falls
    found = 'not in the file: set policy_imu_frame' if frame is None else frame
    yield _row('imu frame', 'base or yawed', found, frame in known_frames)


def _row(subject: str, expected: str, found: str, fits: bool) -> Row:
    return Row(subject, expected, found, Verdict.OK if fits else Verdict.REFUSE)
