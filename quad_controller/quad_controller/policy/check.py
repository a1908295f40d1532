# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks a policy before it may move the robot: one row per property that must match."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import time

import numpy as np

from quad_description import Quadruped, Targets

from .contract import mjlab
from .contract.document import ContractDocument
from .contract.model import PolicyContract
from .network import FLOAT, Floats, observation_ports, OnnxNetwork, Port
from .observation import observed_places
from .options import gain_rows, Row, ServoResponse, Verdict

MAX_POSE_DISTANCE = 0.8  # [rad] of the default pose from where the gait stands
MAX_LEAN = 0.35  # of the hips' height that feet may be ahead of where they carry the weight
MAX_SCALE = 1.0  # [rad] an action of one may move a joint by
MAX_RESTING_ACTION = 1.0  # [rad] a policy that wants more while standing is another robot's
MAX_PERIOD_ERROR = 0.02  # of the loop's period, that of the training may differ by
WARM_UP = 20
TIMED_RUNS = 100
MAX_LATENCY_RATIO = 0.25  # of the period
PROBES, PROBE = 20, 0.1  # changes of an observation, and their deviation
ROUNDED = 0.01  # a scale below is more than 5 % off where it has three decimals
STATES = 'several: recurrent states are named as recurrence: {h_in: h_out, c_in: c_out}'
NOT_ONE = 'several, and none is a recurrent state (no output has its shape): export the actor '
NOT_ONE += 'alone, with its own observation'
MIN_NEWEST = 0.1  # share of what the oldest step of a history does that the newest must do


def check_contract(
    network: OnnxNetwork,
    contract: PolicyContract,
    robot: Quadruped,
    stand: Targets,
    *,
    document: ContractDocument,
    hold_missing: bool,
    period: float,
    servo: ServoResponse | None = None,
) -> Iterator[Row]:
    """Compare the contract of a policy with the robot; yield one row per property.

    Args:
        document: Origins of the contract's values.
        hold_missing: Treat joints that the robot lacks as being at their defaults.
        period: Time between two steps of the control loop in [s].
        servo: Response of the robot's servos; None if unknown.
    """
    count = len(contract.joint_names)
    inputs, outputs = observation_ports(network, contract.recurrence, contract.action.output)
    terms = ' + '.join(
        f'{term.name} {term.width}' + (f' x {term.history}' if term.history > 1 else '')
        for term in contract.terms
    )
    yield _shape('input', inputs, contract.width, terms)
    if len(inputs) > 1:
        recurs = {_sizes_of(port) for port in inputs} & {_sizes_of(port) for port in outputs}
        yield Row('input', 'one', STATES if recurs else NOT_ONE, Verdict.REFUSE)
    yield _shape('output', outputs, count, f'{count} joints')
    if len(outputs) > 1:
        yield Row('output', 'one', 'several: name it with action.output', Verdict.REFUSE)
    if network.sides:
        found = f'in {", ".join(network.sides)} beside the file; the sha256 is of both'
        yield Row('weights', 'any', found, Verdict.OK)
    for warning in network.warnings:
        yield Row('weights', 'in the file', warning, Verdict.WARN)
    yield from _recurrent(network, contract)
    metadata = network.metadata
    yield from _sizes(
        'observation', mjlab.numbers_of(metadata, mjlab.OBSERVATION_SIZE_KEYS), contract.width
    )
    yield from _sizes('action', mjlab.numbers_of(metadata, mjlab.ACTION_SIZE_KEYS, -1), count)
    yield from _rates(contract, mjlab.numbers_of(metadata, mjlab.STEP_KEYS), document, period)
    yield from _joints(contract.joint_names, robot, hold_missing=hold_missing)
    yield from _defaults(contract, robot, stand)
    largest = max((abs(scale) for scale in contract.action.scale), default=0.0)
    yield _row('action.scale', f'up to {MAX_SCALE:g} rad', f'{largest:g}', largest <= MAX_SCALE)
    yield from scale_rows(contract, document)
    yield from gain_rows(contract.gains, servo, period)
    yield from _commands(contract)
    if strange := mjlab.not_understood(metadata):
        unknown = ', '.join(f'{key} = {value}' for key, value in strange.items())
        yield Row('keys', 'understood', f'not understood: {unknown}', Verdict.WARN)
    for path, value, origin in document.rows():
        if origin == mjlab.VENDOR:
            yield Row(path, 'known', f'{value}, of {mjlab.VENDOR}', Verdict.WARN)


def check_answers(
    network: OnnxNetwork,
    standing: Floats,
    contract: PolicyContract,
    stand: Floats,
    period: float,
) -> Iterator[Row]:
    """Run a policy as the controller will, and check its actions.

    Args:
        standing: Observation of a standing robot.
        stand: Joint positions of the standing robot, in the policy's order [rad].
    """

    def run(observation: Floats) -> Floats:
        network.reset()
        return network.run(observation)

    # all zero is no state of a robot (gravity has a direction): finite numbers will do
    finite = bool(np.isfinite(run(np.zeros_like(standing))).all())
    yield _row('answer to all zero', 'numbers', 'numbers' if finite else 'NaN', finite)
    action = run(standing).copy()
    raw = action[0]
    if contract.action.clip is not None:
        raw = np.clip(raw, *np.array(contract.action.clip, np.float32).T)
    targets = np.array(contract.action.offset) + np.array(contract.action.scale) * raw
    largest = float(np.abs(targets - stand).max())
    # a NaN is not below anything
    fits = largest < MAX_RESTING_ACTION
    expected = f'below {MAX_RESTING_ACTION:g} rad off the stand'
    yield _row('targets standing', expected, f'{largest:.3f} rad', fits)
    draw = np.random.default_rng(0).normal(size=standing.shape)
    moved = run(standing + (PROBE * draw).astype(np.float32))
    differs = not np.array_equal(action, moved)
    yield _row('another observation', 'another answer', 'yes' if differs else 'no', differs)
    first = run(standing).copy()
    same = bool(np.array_equal(first, run(standing), equal_nan=True))
    yield _row('the same answer twice', 'yes', 'yes' if same else 'no', same)
    network.reset()
    steady = all(bool(np.isfinite(network.run(standing)).all()) for _ in range(WARM_UP))
    yield _row('answers one after the other', 'numbers', 'numbers' if steady else 'NaN', steady)
    yield from _history(run, standing, contract)
    times = []
    for _ in range(TIMED_RUNS):
        start = time.perf_counter()
        run(standing)
        times.append(time.perf_counter() - start)
    late = sorted(times)[int(0.99 * (TIMED_RUNS - 1))]
    most = MAX_LATENCY_RATIO * period
    verdict = Verdict.OK if late < most else Verdict.WARN
    yield Row('time, p99', f'below {most * 1e3:.1f} ms', f'{late * 1e3:.3f} ms', verdict)


def _history(
    run: Callable[[Floats], Floats], standing: Floats, contract: PolicyContract
) -> Iterator[Row]:
    """Compare the influence of the newest and the oldest history step on the action."""
    ages = observed_places(contract) // sum(term.width for term in contract.terms)
    if not ages.any():
        return
    draw, rest = np.random.default_rng(0), run(standing).copy()

    def effect(age: int) -> float:
        changes = PROBE * draw.normal(size=(PROBES, len(ages))) * (ages == age)
        moved = [run(standing + change.astype(np.float32)[np.newaxis, :]) for change in changes]
        return float(np.mean([np.abs(action - rest).mean() for action in moved]))

    newest, oldest = effect(0), effect(int(ages.max()))
    verdict = Verdict.OK if newest >= oldest else Verdict.WARN
    if newest < MIN_NEWEST * oldest:
        verdict = Verdict.REFUSE
    found = f'it moves an action by {newest:.2g}, the oldest by {oldest:.2g}'
    yield Row('newest step of the history', 'counts most', found, verdict)


def _shape(
    what: str,
    ports: Sequence[tuple[str, str, tuple[object, ...]]],
    expected: int,
    meaning: str,
) -> Row:
    """Compare the shape of an input or output with the expected width."""
    found = ', '.join(f'{name} {kind} {list(shape)}' for name, kind, shape in ports)
    fits = (
        len(ports) == 1
        and ports[0][1] == FLOAT
        and len(ports[0][2]) == 2
        and ports[0][2][1] == expected
        and (ports[0][2][0] == 1 or not isinstance(ports[0][2][0], int))
    )
    return _row(what, f'float [1, {expected}] ({meaning})', found, fits)


def _sizes_of(port: Port) -> tuple[int | None, ...]:
    """Return the shape with dynamic dimensions left unnamed."""
    return tuple(size if isinstance(size, int) else None for size in port[2])


def _sizes(what: str, sizes: Mapping[str, float], expected: int) -> Iterator[Row]:
    for key, size in sizes.items():
        yield _row(f'{key} ({what})', f'{expected}', f'{size:g}', size == expected)


def _recurrent(network: OnnxNetwork, contract: PolicyContract) -> Iterator[Row]:
    """Compare type and fixed sizes of each recurrent input and its output."""
    inputs = {name: (kind, shape) for name, kind, shape in network.inputs}
    outputs = {name: (kind, shape) for name, kind, shape in network.outputs}
    for state in contract.recurrence:
        fed, kept = inputs.get(state.input), outputs.get(state.output)
        fits = fed is not None and kept is not None and fed[0] == kept[0] == FLOAT
        if fits and fed and kept:
            sizes = list(zip(fed[1], kept[1], strict=False))
            fits = len(fed[1]) == len(kept[1]) and not any(
                one != two and isinstance(one, int) and isinstance(two, int) for one, two in sizes
            )
        found = f'{fed} from {kept}'
        yield _row(f'recurrence.{state.input}', f'an input, from {state.output}', found, fits)


def _rates(
    contract: PolicyContract,
    periods: Mapping[str, float],
    document: ContractDocument,
    period: float,
) -> Iterator[Row]:
    """Compare the policy's training rate with the rate of the control loop."""
    origin = document.origins.get('period', '')
    for key, step in (periods or {origin: contract.period}).items():
        fits = abs(step - contract.period) <= MAX_PERIOD_ERROR * contract.period
        if not periods or fits:
            several = max(round(step / period), 1) if step > 0.0 else 1
            fits = abs(step - several * period) <= MAX_PERIOD_ERROR * step
        expected = f'{1.0 / step:g} Hz ({key})' if step > 0.0 else f'{step:g} s ({key})'
        found = f'{1.0 / period:g} Hz'
        yield _row('loop_rate', f'{expected}, or several times that', found, fits)


def scale_rows(contract: PolicyContract, document: ContractDocument) -> Iterator[Row]:
    """Reject scales of 0; warn about scales rounded to three decimals."""
    scales = {f'observation.terms.{term.name}.scale': term.scale for term in contract.terms}
    for name, scale in {**scales, 'action.scale': contract.action.scale}.items():
        least = min(map(abs, scale), default=1.0)
        if least == 0.0:
            found = '0: the number would not count; exporters write 0.0004 as 0.000'
            yield Row(name, 'not 0', found, Verdict.REFUSE)
        elif least < ROUNDED and document.origins.get(name) == mjlab.FILE:
            found = f'{least:g}, with three decimals: up to {0.0005 / least:.0%} off'
            yield Row(name, f'{ROUNDED:g} or more', found, Verdict.WARN)


def _commands(contract: PolicyContract) -> Iterator[Row]:
    """Yield the command ranges of the training, for the reader to compare."""
    commands = contract.commands
    if commands is not None:
        found = ', '.join(
            f'{axis} {low:g} to {high:g}'
            for axis, (low, high) in zip(('x', 'y', 'yaw'), commands, strict=True)
        )
        yield Row('commands', 'any', f'clamped to {found}', Verdict.OK)


def _joints(names: tuple[str, ...], robot: Quadruped, *, hold_missing: bool) -> Iterator[Row]:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        yield _row('joints', 'each once', f'twice: {", ".join(twice)}', fits=False)
    missing = [name for name in names if name not in robot.names]
    legs = [robot.names[index] for indices in robot.leg_indices for index in indices]
    unmoved = [name for name in legs if name not in names]
    found = f'{len(names)} joints'
    if missing:
        found = f'not in the robot: {", ".join(missing)}'
    if unmoved:
        found += f'; legs without: {", ".join(unmoved)}'
    held = bool(missing) and not unmoved and hold_missing
    if held:
        found += ' (held at default)'
    fits = not unmoved and (not missing or held)
    verdict = Verdict.REFUSE if not fits else Verdict.WARN if held else Verdict.OK
    yield Row('joints', f"all of the legs', of {len(robot.names)}", found, verdict)
    ours = [name for name in robot.names if name in names]
    order = [name for name in names if name in robot.names]
    moved = 'as in the URDF' if ours == order else 'permuted, by name'
    yield Row('order of joints', 'any', moved, Verdict.OK)


def _defaults(contract: PolicyContract, robot: Quadruped, stand: Targets) -> Iterator[Row]:
    named = dict(zip(contract.joint_names, contract.default_positions, strict=True))
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
    pairs = zip(robot.names, stand, strict=True)
    feet = robot.feet([named.get(name, place) for name, place in pairs])
    height = robot.hip_centre[2] - sum(z for _, _, z in feet) / len(feet)
    ahead = sum(x - at for (x, _, _), (at, _, _) in zip(feet, robot.feet(stand), strict=True)) / 4
    found = f'{ahead:+.3f} m ahead, {height:.3f} m below the hips'
    expected = f'up to {MAX_LEAN:.0%} of their depth off our stand; else its zero is another one'
    yield _row('feet in the default pose', expected, found, abs(ahead) <= MAX_LEAN * height)


def _row(subject: str, expected: str, found: str, fits: bool) -> Row:
    return Row(subject, expected, found, Verdict.OK if fits else Verdict.REFUSE)
