# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The training in small: its teacher is the gait, and what it writes can be loaded."""

from __future__ import annotations

import math
from pathlib import Path

from gait_teacher import GaitTeacher
import pytest
from train_imitation import Trainer

from quad_controller.gait.body import UPRIGHT
from quad_controller.gait.generator import GaitGenerator
from quad_controller.gait.parameters import GaitParameters
from quad_controller.gait.velocity import Velocity
from quad_controller.policy.check import check_contract
from quad_controller.policy.metadata import read_metadata
from quad_controller.policy.network import OnnxNetwork
from quad_controller.policy.options import PolicyOptions
from quad_gait_physics import MODEL


@pytest.mark.parametrize('velocity', [Velocity(0.2), Velocity(0.1, 0.05), Velocity()])
def test_the_teacher_is_the_gait(velocity: Velocity) -> None:
    """After some cycles the gait is where the teacher has it for the same phase."""
    parameters = GaitParameters(level_gain=0.0)
    gait, teacher = GaitGenerator(MODEL, parameters), GaitTeacher(MODEL, parameters)
    for _ in range(100):
        step = gait.step(velocity, UPRIGHT, None, 0.02)
    expected = teacher.targets(velocity, gait.phase, (0.0, 0.0))
    assert step.targets == pytest.approx(expected, abs=1e-6)


def test_a_short_training_gives_a_policy_of_the_right_form(tmp_path: Path) -> None:
    """One round learns something, and what is written fits the robot in all that it says."""
    trainer = Trainer(seed=0)
    assert trainer.collect(1, share=1.0) == pytest.approx(6.0)
    first = trainer.fit(1)
    assert trainer.fit(20) < 0.7 * first
    trainer.collect(1, share=0.0)
    trainer.export(tmp_path / 'short.onnx')
    network = OnnxNetwork(tmp_path / 'short.onnx')
    metadata = read_metadata(network.metadata)
    stand = GaitGenerator(MODEL, GaitParameters()).stand_targets
    options, period = PolicyOptions(), 0.02
    for row in check_contract(network, metadata, MODEL, stand, options=options, period=period):
        assert row.verdict.value == 'ok', row
    assert math.isclose(metadata.phase_period or 0.0, 0.28)
