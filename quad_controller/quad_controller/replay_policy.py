# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_controller replay_policy``: feeds a policy by a recording, without a robot."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
import sys

import numpy as np

from quad_description import (
    DescriptionError,
    PRESETS,
    quadruped,
    robot_urdf,
    run_command,
    Targets,
)

from .exceptions import PolicyError, QuadControllerError
from .gait.generator import GaitGenerator
from .gait.parameters import GaitParameters
from .policy.load import find_policy, load_policy, LoadedPolicy
from .policy.network import Floats
from .policy.options import PolicyOptions
from .policy.runner import PolicyRunner
from .recording import inputs_of, PolicyRun, read_recording, Step
from .states.controller import MAX_STEP

MAX_DIFFERENCE = 1e-3  # of actions and observations: single precision, and a little of a phase


@dataclass(frozen=True, slots=True)
class Answered:
    """What a policy saw and answered in a step of a recording."""

    step: Step  # as it was recorded
    observation: Floats  # what it saw
    action: Floats  # what it answered
    synchronous: bool  # whether it has seen all that it had seen there


def feed(runner: PolicyRunner, steps: Iterable[Step]) -> Iterator[Answered]:
    """Feed a policy what was recorded; yield its answers.

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


def _others(step: Step) -> Targets:
    values = step['target'] if len(step['target']) else step['position']
    return tuple(values.tolist())


def _off(a: Floats, b: Floats) -> float:
    return float(np.abs(a - b).max()) if a.shape == b.shape else float('inf')


def run(arguments: Sequence[str]) -> int:
    """Replay; return 0 when the answers are the recorded ones."""
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
        text, fine = report(loaded, steps)
    except (QuadControllerError, DescriptionError) as error:
        sys.stdout.write(f'{error}\n')
        return 1
    sys.stdout.write(f'{text}\n')
    return 0 if fine else 1


def report(loaded: LoadedPolicy, steps: list[Step]) -> tuple[str, bool]:
    """Feed a policy by a recording; return what was found, and whether no answer differs.

    Raises:
        PolicyError: The recording has nothing that the policy could see.
    """
    runner = loaded.runner
    answers = list(feed(runner, steps))
    if not answers:
        raise PolicyError('the recording has no step with all that the policy observes')
    lines = [
        f'policy {runner.name}, sha256 {loaded.digest}',
        f'{len(steps)} steps, asked in {len(answers)}',
    ]
    same = [each for each in answers if each.synchronous and len(each.step['action'])]
    actions = max((_off(each.action, each.step['action']) for each in same), default=0.0)
    seen = max((_off(each.observation, each.step['observation']) for each in same), default=0.0)
    agrees = max(actions, seen) <= MAX_DIFFERENCE
    if same:
        verdict = 'the same' if agrees else f'NOT the same, more than {MAX_DIFFERENCE:g}'
        lines.append(
            f'{len(same)} answers compared with the recorded ones: actions differ by '
            f'{actions:.2g}, observations by {seen:.2g}; {verdict}'
        )
    else:
        lines.append('no answer of this file is in the recording: nothing to compare with')
    others = {
        f'{step["policy"]} {step["policy_digest"]}'
        for step in steps
        if step['policy_digest'] not in {'', runner.digest}
    }
    lines += [f'asked in the recording: {other}' for other in sorted(others)]
    return '\n'.join(lines), agrees


def main() -> None:
    """Entry point."""
    run_command(run)


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
        description='Feed a policy by a recording: are its answers the recorded ones?',
        allow_abbrev=False,
    )
    parser.add_argument('recording', type=Path, help='folder of a recording, or its MCAP file')
    parser.add_argument(
        'model', nargs='?', help='ONNX file, or name of one that is shipped; default: the recorded'
    )
    parser.add_argument('--contract', type=Path, metavar='FILE', help='not the recorded one')
    parser.add_argument('--preset', choices=list(PRESETS), default='lite', help='the robot')
    parser.add_argument('--arm', action='store_true', help='the robot has its arm')
    return parser


if __name__ == '__main__':
    main()
