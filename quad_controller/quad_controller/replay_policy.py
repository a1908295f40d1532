# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_controller replay_policy``: feeds a policy by a recording, without a robot."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import signal
import sys

from quad_description import DescriptionError, PRESETS, quadruped, robot_urdf

from .exceptions import PolicyError, QuadControllerError
from .gait.generator import GaitGenerator
from .gait.parameters import GaitParameters
from .policy.load import load_policy, LoadedPolicy
from .policy.options import PolicyOptions
from .policy.shipped import find_policy
from .policy.statistics import ObservationStatistics, STATISTICS_KEY
from .recording.replay import MAX_DIFFERENCE, read_recording, Replay, replay, statistics_of
from .recording.run import PolicyRun


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
