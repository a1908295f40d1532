# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of steps (quad_msgs/msg/ControllerStep) and how their policy was run; no ROS."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
import shutil
import struct
from typing import Any

import numpy as np

from quad_description import ImuSample, JointSample
from rosbag_files import BagError, BagReader, load_metadata, METADATA_FILE

from .exceptions import ParameterError, PolicyError
from .gait.velocity import Velocity
from .policy.network import Floats
from .policy.observation import Situation
from .policy.options import PolicyOptions
from .states.parameters import StateParameters

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
        PolicyError: It has none, or cannot be read.
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
    """Return the values of a message.

    Args:
        definition: That of the recording: one of before lacks the fields that came later.

    Raises:
        ValueError: The bytes are of something else.
    """
    if data[:4] != ENCAPSULATION:
        raise ValueError('no message in little endian CDR')
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
    """Return what a policy may see of a step; None when joints or attitude were not known."""

    def vector(name: str) -> Any:  # noqa: ANN401  # as long as the field is
        return tuple(step[name].tolist()) if name in step and len(step[name]) else None

    positions, orientation = vector('position'), vector('orientation')
    if positions is None or orientation is None:
        return None
    contacts = vector('foot_contacts')
    return Situation(
        JointSample(positions, vector('velocity')),
        ImuSample(orientation, vector('angular_velocity'), vector('acceleration')),
        Velocity(*step['command'].tolist()),
        vector('linear_velocity'),
        contacts and tuple(map(bool, contacts)),
    )


def _read(kind: str, view: memoryview, place: int) -> tuple[str | float | Floats, int]:
    """Return a value of a message and where the next one begins."""
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
    """What the steps do not say, and the answers depend on."""

    # as it was named; empty for the gait, None where a recording does not say, as one that goes on
    policy: str | None
    options: PolicyOptions  # how it was run
    period: float  # of the control loop in [s]

    @property
    def about(self) -> Mapping[str, str]:
        """What is written down with the recording."""
        return {
            'policy': self.policy or '',
            'policy_options': self.options.to_json(),
            'period': repr(self.period),
        }

    def keep_contract(self, folder: Path) -> str:
        """Copy the contract of the options, when there is one, into the folder of the recording.

        Returns:
            Why not; empty when all is well.
        """
        if self.options.contract is not None:
            try:
                shutil.copyfile(self.options.contract, folder / CONTRACT_FILE)
            except OSError as error:
                return f'the contract is not kept: {error}'
        return ''

    @classmethod
    def of(cls, recording: Path) -> PolicyRun:
        """Return that of a recording; what an older one does not say has its default.

        Raises:
            PolicyError: It cannot be read.
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
