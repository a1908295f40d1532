# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Policies for tests: small networks whose answers are known, and faults of each kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from policy_export import export, Layers

from quad_controller import GaitGenerator, GaitParameters
from quad_controller.policy.contract.model import RecurrentState
from quad_controller.policy.network import FLOAT, Floats, OnnxNetwork, Port
from quad_gait_rig import ROBOT

STAND = GaitGenerator(ROBOT, GaitParameters()).stand_targets
TERMS = 'ang_vel,gravity,cmd,phase,joint_pos,joint_vel,prev_action'


def metadata(**changes: str | None) -> dict[str, str]:
    """Return what a fitting file says; a change to None leaves a key out."""
    fitting: dict[str, str | None] = {
        'joint_names': joined(ROBOT.names),
        'default_joint_pos': joined([round(angle, 3) for angle in STAND]),
        'action_scale': '0.25',
        'observation_names': TERMS,
        'command_names': 'twist',
        'phase_period': '0.28',
        'imu_frame': 'base',
    }
    return {key: value for key, value in (fitting | changes).items() if value is not None}


class FakeNetwork(OnnxNetwork):
    """Answers as it is set up to, and keeps the requests."""

    def __init__(self, values: Mapping[str, str], joints: int = 12) -> None:
        """Have some metadata."""
        self.metadata = values
        self.inputs: tuple[Port, ...] = (('obs', FLOAT, (1, 11 + 3 * joints)),)
        self.outputs: tuple[Port, ...] = (('actions', FLOAT, (1, joints)),)
        self.name, self.digest = 'test', 'abc'
        self.warnings: tuple[str, ...] = ()
        self.sides: tuple[str, ...] = ()
        self.action: Floats = np.zeros((1, joints), np.float32)
        self.blind = False
        self.asked: list[Floats] = []

    def recur(self, states: tuple[RecurrentState, ...], actions: str = '') -> None:
        """Have no states."""

    def reset(self) -> None:
        """Have nothing to forget."""

    def run(self, observation: Floats) -> Floats:
        """Answer, with a trace of the observation."""
        self.asked.append(observation.copy())
        trace = 0.0 if self.blind else 1e-12 * float(observation.sum())
        return np.add(self.action, trace, dtype=np.float32)


def write_policy(path: Path, values: Mapping[str, str], width: int = 47) -> Path:
    """Write an ONNX file whose network answers nearly nothing."""
    network = random_layers((width, 8, 12), np.random.default_rng(0))
    network.weights[-1] *= np.float32(1e-3)
    export(network, path, values)
    return path


def random_layers(sizes: Sequence[int], random: np.random.Generator) -> Layers:
    """Return layers with random weights, which take observations as they are."""
    return Layers(
        np.zeros(sizes[0], np.float32),
        np.ones(sizes[0], np.float32),
        [random.standard_normal(shape).astype(np.float32) for shape in pairwise(sizes)],
        [np.zeros(size, np.float32) for size in sizes[1:]],
    )


def joined(values: object) -> str:
    """Return a list as exporters write it: by commas, numbers with three decimals."""
    if isinstance(values, str):
        return values
    if isinstance(values, (int, float)):
        return f'{values:.3f}'
    return ','.join(joined(value) for value in values)  # type: ignore[attr-defined]
