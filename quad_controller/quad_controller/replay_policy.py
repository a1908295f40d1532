# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_controller replay_policy``: feeds a policy by a recording, without a robot."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
import signal
import sys

import numpy as np

from quad_description import DescriptionError, PRESETS, quadruped, robot_urdf, Targets

from .exceptions import PolicyError, QuadControllerError
from .gait.generator import GaitGenerator
from .gait.parameters import GaitParameters
from .policy.contract.model import PolicyContract
from .policy.load import find_policy, load_policy, LoadedPolicy
from .policy.network import Floats
from .policy.observation import observed_places
from .policy.options import PolicyOptions
from .policy.runner import PolicyRunner
from .policy.statistics import ObservationStatistics, STATISTICS_KEY
from .recording import inputs_of, PolicyRun, read_recording, Step
from .states.controller import MAX_STEP

MAX_DIFFERENCE = 1e-3  # of actions and observations: single precision, and a little of a phase
MARGIN = 0.02  # of the range in training, that a number may lie beyond it
MAX_OUTSIDE = 0.05  # share of the samples


@dataclass(frozen=True, slots=True)
class TermRange:
    """Where the numbers of a term lie."""

    name: str  # of the term
    least: float  # the smallest number in the recording
    most: float  # the largest one
    # smallest and largest in the reference; None without one
    reference: tuple[float, float] | None
    outside: float  # largest share of samples of one number that lie outside of its range there
    shift: float  # how far a mean is off, as a multiple of the deviation there; the largest

    @property
    def leaves(self) -> bool:
        """Whether it leaves the distribution."""
        return self.outside > MAX_OUTSIDE


@dataclass(frozen=True, slots=True)
class Replay:
    """What came of a recording."""

    steps: int  # steps of the recording
    asked: int  # in how many the policy was asked here
    compared: int  # how many of them have an answer of the same file in the recording
    action_difference: float  # largest difference of actions from the recorded ones
    observation_difference: float  # the same of observations
    # files that were asked in the recording and are not this one: name and SHA-256
    others: tuple[str, ...]
    terms: tuple[TermRange, ...]  # where each term lies

    @property
    def agrees(self) -> bool:
        """Whether the answers are the recorded ones, as far as they can be compared."""
        return max(self.action_difference, self.observation_difference) <= MAX_DIFFERENCE


@dataclass(frozen=True, slots=True)
class Answered:
    """What a policy saw and answered in a step of a recording."""

    step: Step  # as it was recorded
    observation: Floats  # what it saw
    action: Floats  # what it answered
    synchronous: bool  # whether it has seen all that it had seen there


def feed(runner: PolicyRunner, steps: Iterable[Step]) -> Iterator[Answered]:
    """Let a policy see what was recorded; yield its answers.

    It begins anew where it did in the recording. One that was not asked there sees all steps.

    Args:
        runner: The policy; it has to fit the robot.
        steps: In their order.
    """
    steps = list(steps)
    recorded = any(step['policy_digest'] == runner.digest for step in steps)
    last, begun, synchronous = 0, False, False
    for step in steps:
        inputs = inputs_of(step)
        mine = step['policy_digest'] == runner.digest
        if inputs is None or (recorded and not mine):
            continue
        count = step['policy_step'] if mine else 0
        if not begun or count == 1:
            runner.reset(_others(step))
        # what it saw before a gap is not in the recording
        synchronous = count == 1 or (synchronous and count == last + 1)
        last, begun = count, True
        answer = runner.step(inputs, min(step['dt'], MAX_STEP))
        if answer.observation is not None and answer.action is not None:
            yield Answered(step, answer.observation[0], answer.action, synchronous)


def replay(
    runner: PolicyRunner,
    contract: PolicyContract,
    steps: list[Step],
    reference: ObservationStatistics | None,
) -> Replay:
    """Feed a policy by a recording and compare.

    Args:
        reference: What it observed in training, or in another recording; None for nothing.

    Raises:
        PolicyError: The recording has nothing that the policy could see.
    """
    answers = list(feed(runner, steps))
    if not answers:
        raise PolicyError('the recording has no step with all that the policy observes')
    rows = np.array([answer.observation for answer in answers])
    same = [answer for answer in answers if answer.synchronous and len(answer.step['action'])]
    asked = {
        f'{step["policy"]} {step["policy_digest"]}'
        for step in steps
        if step['policy_digest'] not in {'', runner.digest}
    }
    return Replay(
        len(steps),
        len(answers),
        len(same),
        max((_off(each.action, each.step['action']) for each in same), default=0.0),
        max((_off(each.observation, each.step['observation']) for each in same), default=0.0),
        tuple(sorted(asked)),
        tuple(_ranges(contract, rows, reference)),
    )


def statistics_of(runner: PolicyRunner, steps: list[Step]) -> ObservationStatistics:
    """Return what a policy would observe in a recording.

    Raises:
        PolicyError: It has nothing that the policy could see.
    """
    rows = [answer.observation for answer in feed(runner, steps)]
    if not rows:
        raise PolicyError('the reference has no step with all that the policy observes')
    return ObservationStatistics.of(np.array(rows))


def _others(step: Step) -> Targets:
    values = step['target'] if len(step['target']) else step['position']
    return tuple(values.tolist())


def _off(a: Floats, b: Floats) -> float:
    return float(np.abs(a - b).max()) if a.shape == b.shape else float('inf')


def _ranges(
    contract: PolicyContract, rows: Floats, reference: ObservationStatistics | None
) -> Iterator[TermRange]:
    columns = observed_places(contract) % sum(term.width for term in contract.terms)
    start = 0
    for term in contract.terms:
        mine = (columns >= start) & (columns < start + term.width)
        start += term.width
        seen = rows[:, mine]
        least, most = float(seen.min()), float(seen.max())
        if reference is None:
            yield TermRange(term.name, least, most, None, 0.0, 0.0)
            continue
        low, high = reference.least[mine], reference.most[mine]
        room = MARGIN * (high - low) + 1e-6
        outside = ((seen < low - room) | (seen > high + room)).mean(0)
        shift = np.abs(seen.mean(0) - reference.mean[mine]) / np.maximum(reference.std[mine], 1e-3)
        yield TermRange(
            term.name,
            least,
            most,
            (float(low.min()), float(high.max())),
            float(outside.max()),
            float(shift.max()),
        )


def run(arguments: Sequence[str]) -> int:
    """Replay; return 0 when the answers are the recorded ones, in the distribution of training."""
    options = _parser().parse_args(arguments)
    try:
        steps, recorded = read_recording(options.recording), PolicyRun.of(options.recording)
        robot = quadruped(robot_urdf(options.preset, arm=options.arm))
        loaded = load_policy(
            find_policy(options.model or _model_of(recorded, options.recording)),
            robot,
            GaitGenerator(robot, GaitParameters()).stand_targets,
            _options_for(options.model, options.contract, recorded),
            recorded.period,
        )
        reference, origin = _reference(loaded, options.reference)
        found = replay(loaded.runner, loaded.contract, steps, reference)
    except (QuadControllerError, DescriptionError) as error:
        sys.stdout.write(f'{error}\n')
        return 1
    for line in report(found, loaded, origin):
        sys.stdout.write(f'{line}\n')
    return 0 if found.agrees and not any(term.leaves for term in found.terms) else 1


def report(found: Replay, loaded: LoadedPolicy, origin: str) -> list[str]:
    """Return what was found, for people."""
    lines = [
        f'policy {loaded.runner.name}, sha256 {loaded.digest}',
        f'{found.steps} steps, asked in {found.asked}',
    ]
    if found.compared:
        differs = f'NOT the same, more than {MAX_DIFFERENCE:g}'
        verdict = 'the same' if found.agrees else differs
        lines.append(
            f'{found.compared} answers compared with the recorded ones: actions differ by '
            f'{found.action_difference:.2g}, observations by {found.observation_difference:.2g}; '
            f'{verdict}'
        )
    else:
        lines.append('no answer of this file is in the recording: nothing to compare with')
    lines += [f'asked in the recording: {other}' for other in found.others]
    lines += ['', f'reference: {origin}']
    rows = [('term', 'recorded', 'reference', 'outside', 'mean off by', '')]
    for term in found.terms:
        span = f'{term.least:.3g} to {term.most:.3g}'
        if term.reference is None:
            rows.append((term.name, span, '', '', '', ''))
            continue
        low, high = term.reference
        verdict = 'LEAVES' if term.leaves else 'ok'
        share, shift = f'{term.outside:.1%}', f'{term.shift:.1f} sigma'
        rows.append((term.name, span, f'{low:.3g} to {high:.3g}', share, shift, verdict))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        lines.append('  '.join(cells).rstrip())
    return lines


def main() -> None:
    """Entry point."""
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(run(sys.argv[1:]))


def _reference(
    loaded: LoadedPolicy, recording: Path | None
) -> tuple[ObservationStatistics | None, str]:
    """Return what observations are compared with, and where it comes from."""
    if recording is not None:
        steps = read_recording(recording)
        return statistics_of(loaded.runner, steps), f'recording {recording}'
    found = ObservationStatistics.from_metadata(loaded.metadata, loaded.contract.width)
    if found is not None:
        return found, f'training (metadata {STATISTICS_KEY})'
    return None, (
        f'none: the file has no {STATISTICS_KEY}; give a recording of a run in simulation by '
        '--reference'
    )


def _options_for(model: str | None, contract: Path | None, recorded: PolicyRun) -> PolicyOptions:
    """Return how a policy is run: as it was recorded, unless it is another one."""
    options = recorded.options if model in {None, recorded.policy} else PolicyOptions()
    return options if contract is None else replace(options, contract=contract)


def _model_of(recorded: PolicyRun, recording: Path) -> str:
    """Return the policy that a recording was begun with."""
    if recorded.policy is None:
        raise PolicyError(
            f'recording {recording} does not say which policy ran (it goes on, its recorder was '
            'killed, or another program wrote it); name the model'
        )
    if not recorded.policy:
        raise PolicyError(f'recording {recording} was begun without a policy; name the model')
    return recorded.policy


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description='Feed a policy by a recording: are its answers the recorded ones, and do its '
        'observations leave what it was trained for?',
        allow_abbrev=False,
    )
    parser.add_argument('recording', type=Path, help='folder of a recording, or its MCAP file')
    parser.add_argument(
        'model', nargs='?', help='ONNX file, or name of one that is shipped; default: the recorded'
    )
    parser.add_argument(
        '--reference', type=Path, metavar='RECORDING', help='instead of what the model says'
    )
    parser.add_argument('--contract', type=Path, metavar='FILE', help='not the recorded one')
    parser.add_argument('--preset', choices=list(PRESETS), default='lite', help='the robot')
    parser.add_argument('--arm', action='store_true', help='the robot has its arm')
    return parser


if __name__ == '__main__':
    main()
