# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A policy that is fed by a recording: does it answer the same, and is it where it was trained?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quad_description import Targets
from rosbag_files import BagError, BagReader

from ..exceptions import PolicyError
from ..policy.contract.model import PolicyContract
from ..policy.network import Floats
from ..policy.observation import observed_places
from ..policy.runner import PolicyRunner
from ..policy.statistics import ObservationStatistics
from ..states.controller import MAX_STEP
from .recorder import TOPIC
from .step import StepRecord, unpack

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

    step: StepRecord  # as it was recorded
    observation: Floats  # what it saw
    action: Floats  # what it answered
    synchronous: bool  # whether it has seen all that it had seen there


def read_recording(path: Path) -> list[StepRecord]:
    """Return the steps of a recording.

    Raises:
        PolicyError: It has none, or cannot be read.
    """
    try:
        steps = [unpack(message.data) for message in BagReader(path).messages({TOPIC})]
    except (BagError, ValueError) as error:
        raise PolicyError(f'recording {path}: {error}') from error
    if not steps:
        raise PolicyError(
            f'recording {path} has no {TOPIC}; make one with the parameter record of '
            'controller_node (bringup --record FOLDER)'
        )
    return steps


def feed(runner: PolicyRunner, steps: Iterable[StepRecord]) -> Iterator[Answered]:
    """Let a policy see what was recorded; yield its answers.

    It begins anew where it did in the recording. One that was not asked there sees all steps.

    Args:
        runner: The policy; it has to fit the robot.
        steps: In their order.
    """
    steps = list(steps)
    recorded = any(step.values['policy_digest'] == runner.digest for step in steps)
    last, begun, synchronous = 0, False, False
    for step in steps:
        inputs, values = step.inputs, step.values
        mine = values['policy_digest'] == runner.digest
        if inputs is None or (recorded and not mine):
            continue
        count = values['policy_step'] if mine else 0
        if not begun or count == 1:
            runner.reset(_others(step))
        # what it saw before a gap is not in the recording
        synchronous = count == 1 or (synchronous and count == last + 1)
        last, begun = count, True
        answer = runner.step(inputs, min(values['dt'], MAX_STEP))
        if answer.observation is not None and answer.action is not None:
            yield Answered(step, answer.observation[0], answer.action, synchronous)


def replay(
    runner: PolicyRunner,
    contract: PolicyContract,
    steps: list[StepRecord],
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
    same = [
        answer for answer in answers if answer.synchronous and len(answer.step.values['action'])
    ]
    asked = {
        f'{step.values["policy"]} {step.values["policy_digest"]}'
        for step in steps
        if step.values['policy_digest'] not in {'', runner.digest}
    }
    return Replay(
        len(steps),
        len(answers),
        len(same),
        max((_off(each.action, each.step.values['action']) for each in same), default=0.0),
        max(
            (_off(each.observation, each.step.values['observation']) for each in same), default=0.0
        ),
        tuple(sorted(asked)),
        tuple(_ranges(contract, rows, reference)),
    )


def statistics_of(runner: PolicyRunner, steps: list[StepRecord]) -> ObservationStatistics:
    """Return what a policy would observe in a recording.

    Raises:
        PolicyError: It has nothing that the policy could see.
    """
    rows = [answer.observation for answer in feed(runner, steps)]
    if not rows:
        raise PolicyError('the reference has no step with all that the policy observes')
    return ObservationStatistics.of(np.array(rows))


def _others(step: StepRecord) -> Targets:
    values = step.values['target'] if len(step.values['target']) else step.values['position']
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
