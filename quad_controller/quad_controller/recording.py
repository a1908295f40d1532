# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads recorded steps (quad_msgs/msg/ControllerStep) and replays them to a policy; no ROS.

``ros2 run quad_controller replay_policy`` feeds a recording to a policy, without a robot.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
import shutil
import struct
import sys
from typing import Any

import numpy as np

from quad_description import (
    DescriptionError,
    ImuSample,
    JointSample,
    PRESETS,
    quadruped,
    robot_urdf,
    run_command,
    Targets,
)
from rosbag_files import BagError, BagReader, load_metadata, METADATA_FILE

from .exceptions import ParameterError, PolicyError, QuadControllerError
from .gait.generator import GaitGenerator
from .gait.parameters import GaitParameters
from .gait.velocity import Velocity
from .policy.load import find_policy, load_policy, LoadedPolicy
from .policy.network import Floats
from .policy.observation import Situation
from .policy.options import PolicyOptions
from .policy.runner import PolicyRunner
from .states.controller import MAX_STEP
from .states.modes import StateParameters

TOPIC = '/controller_node/step'
CONTRACT_FILE = 'contract.yaml'  # in the folder of a recording
ENCAPSULATION = b'\0\1\0\0'  # CDR, little endian
STAMP_SIZE = 8  # [byte] of builtin_interfaces/Time, with which each message begins
NUMBERS: Mapping[str, str] = {'uint32': '<I', 'float64': '<d'}

Step = Mapping[str, Any]
"""Values of a ControllerStep by the names of its fields; lists are arrays."""


def read_recording(path: Path) -> list[Step]:
    """Return the steps of a recording.

    Raises:
        PolicyError: The recording is empty or cannot be read.
    """
    try:
        reader = BagReader(path)
        definitions = {each.topic.name: each.topic.definition for each in reader.metadata.topics}
        steps = [
            unpack(definitions.get(TOPIC, ''), each.data) for each in reader.messages({TOPIC})
        ]
    except (BagError, ValueError) as error:
        raise PolicyError(f'recording {path}: {error}') from error
    if not steps:
        raise PolicyError(
            f'recording {path} has no {TOPIC}; make one with the parameter record of '
            'controller_node (bringup --record FOLDER)'
        )
    return steps


def unpack(definition: str, data: bytes) -> Step:
    """Decode a recorded message.

    Args:
        definition: Message definition in the recording; older ones lack newer fields.

    Raises:
        ValueError: The bytes are not such a message.
    """
    if data[:4] != ENCAPSULATION:
        raise ValueError('the message is not little-endian CDR')
    view, place, values = memoryview(data)[4:], STAMP_SIZE, {}
    own, _, _ = definition.partition('\n===')  # behind it stand the definitions of nested types
    fields = [line.partition('#')[0].split() for line in own.splitlines()]
    try:
        for kind, name in filter(None, fields):
            if name != 'stamp':
                values[name], place = _read(kind, view, place)
    except (struct.error, KeyError, UnicodeDecodeError) as error:
        raise ValueError(f'no quad_msgs/msg/ControllerStep: {error}') from error
    if not values:
        raise ValueError(f'{TOPIC} has no definition of its messages')
    return values


def inputs_of(step: Step) -> Situation | None:
    """Return the policy inputs of a step; None if joints or attitude were unknown."""

    def vector(name: str) -> Any:  # noqa: ANN401  # as long as the field is
        return tuple(step[name].tolist()) if name in step and len(step[name]) else None

    positions, orientation = vector('position'), vector('orientation')
    if positions is None or orientation is None:
        return None
    contacts = vector('foot_contacts')
    return Situation(
        JointSample(positions, vector('velocity')),
        ImuSample(orientation, vector('angular_velocity'), vector('acceleration')),
        linear_velocity=vector('linear_velocity'),
        foot_contacts=contacts and tuple(map(bool, contacts)),
        velocity=Velocity(*step['command'].tolist()),
    )


def _read(kind: str, view: memoryview, place: int) -> tuple[str | float | Floats, int]:
    """Decode one value of a message; return it and the offset of the next."""
    if form := NUMBERS.get(kind):
        size = struct.calcsize(form)
        place += -place % size
        return struct.unpack_from(form, view, place)[0], place + size
    (count,) = struct.unpack_from('<I', view, start := place + -place % 4)
    start += 4
    if kind == 'string':
        return bytes(view[start : start + count - 1]).decode(), start + count
    if kind != 'float32[]':
        raise KeyError(kind)
    return np.frombuffer(view, '<f4', count, start), start + 4 * count


@dataclass(frozen=True, slots=True)
class PolicyRun:
    """Settings that the answers depend on and the steps do not contain."""

    # as it was named; empty for the gait, None where a recording does not say, as one that goes on
    policy: str | None
    options: PolicyOptions  # how it was run
    period: float  # of the control loop in [s]

    @property
    def about(self) -> Mapping[str, str]:
        """The metadata to store with the recording."""
        return {
            'policy': self.policy or '',
            'policy_options': self.options.to_json(),
            'period': repr(self.period),
        }

    def keep_contract(self, folder: Path) -> str:
        """Copy the contract file of the options into the recording's folder; return why not."""
        if self.options.contract is not None:
            try:
                shutil.copyfile(self.options.contract, folder / CONTRACT_FILE)
            except OSError as error:
                return f'the contract is not kept: {error}'
        return ''

    @classmethod
    def of(cls, recording: Path) -> PolicyRun:
        """Read the settings of a recording; fields that older ones lack have defaults.

        Raises:
            PolicyError: The settings cannot be read.
        """
        folder = recording if recording.is_dir() else recording.parent
        about: Mapping[str, str] = {}
        contract = folder / CONTRACT_FILE
        kept = contract if contract.is_file() else None
        try:
            if (folder / METADATA_FILE).is_file():
                metadata = load_metadata(folder / METADATA_FILE)
                if recording in {folder, *(folder / file.path for file in metadata.files)}:
                    about = metadata.custom or {}
            options = PolicyOptions.from_json(about.get('policy_options', '{}'), kept)
            period = float(about.get('period', StateParameters().period))
        except (BagError, ParameterError, ValueError) as error:
            raise PolicyError(f'recording {recording}: {error}') from error
        return cls(about.get('policy'), options, period)


MAX_DIFFERENCE = 1e-3  # of actions and observations: single precision, and a little of a phase


@dataclass(frozen=True, slots=True)
class Answered:
    """Input and answer of a policy in one recorded step."""

    step: Step  # as it was recorded
    observation: Floats  # what it saw
    action: Floats  # what it answered
    synchronous: bool  # whether it has seen all that it had seen there


def feed(runner: PolicyRunner, steps: Iterable[Step]) -> Iterator[Answered]:
    """Feed recorded steps to a policy; yield its answers.

    It is reset where the recording has a reset. A policy that did not run there gets all steps.
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


def report(loaded: LoadedPolicy, steps: list[Step]) -> tuple[str, bool]:
    """Replay a recording to a policy; return the findings, and whether all answers agree.

    Raises:
        PolicyError: The recording contains no input for the policy.
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


def _model_of(recorded: PolicyRun, recording: Path) -> str:
    """Return the policy that was active at the start of a recording."""
    if recorded.policy is None:
        raise PolicyError(
            f'recording {recording} does not say which policy ran (it goes on, its recorder was '
            'killed, or another program wrote it); name the model'
        )
    if not recorded.policy:
        raise PolicyError(f'recording {recording} was begun without a policy; name the model')
    return recorded.policy


def run(arguments: Sequence[str]) -> int:
    """Replay a recording; return 0 if the answers equal the recorded ones."""
    options = _parser().parse_args(arguments)
    try:
        steps, recorded = read_recording(options.recording), PolicyRun.of(options.recording)
        robot = quadruped(robot_urdf(options.preset, arm=options.arm))
        # as it was recorded, unless it is another one
        is_recorded = options.model in {None, recorded.policy}
        chosen = recorded.options if is_recorded else PolicyOptions()
        loaded = load_policy(
            find_policy(options.model or _model_of(recorded, options.recording)),
            robot,
            GaitGenerator(robot, GaitParameters()).stand_targets,
            replace(chosen, contract=options.contract or chosen.contract),
            recorded.period,
        )
        text, fine = report(loaded, steps)
    except (QuadControllerError, DescriptionError) as error:
        sys.stdout.write(f'{error}\n')
        return 1
    sys.stdout.write(f'{text}\n')
    return 0 if fine else 1


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


def main() -> None:
    """Entry point."""
    run_command(run)


if __name__ == '__main__':
    main()
