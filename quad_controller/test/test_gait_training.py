# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The training in small: its teacher is the gait, and what it writes can be loaded."""

from __future__ import annotations

import math
from pathlib import Path

from gait_teacher import GaitTeacher
import pytest
from train_imitation import Trainer

from quad_controller.gait.generator import GaitGenerator
from quad_controller.gait.parameters import GaitParameters
from quad_controller.gait.velocity import Velocity
from quad_controller.policy.check import check_contract
from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.contract.declared import read_declared
from quad_controller.policy.contract.mjlab import read_metadata
from quad_controller.policy.interface import PolicyInputs, PolicyStep
from quad_controller.policy.network import OnnxNetwork
from quad_description import Targets
from quad_gait_physics import MODEL, PhysicsRig

pytestmark = pytest.mark.slow


class Lesson:
    """The teacher as a policy: what is imitated has to walk."""

    name = 'teacher'
    needs_linear_velocity = False

    def missing(self, inputs: PolicyInputs) -> str:
        """Need nothing more."""
        return ''

    def __init__(self, teacher: GaitTeacher) -> None:
        self._teacher = teacher
        self._phase = 0.0

    def reset(self, others: Targets) -> None:
        """Begin at the start of a cycle."""
        self._phase = 0.0

    def step(self, inputs: PolicyInputs, dt: float) -> PolicyStep:
        """Answer for what was measured, and go on in the cycle while there is a velocity."""
        velocity, imu = inputs.velocity, inputs.imu
        self._phase = (self._phase + dt / self._teacher.schedule.period) % 1.0
        phase = 0.0 if velocity.at_rest else self._phase
        return PolicyStep(self._teacher.targets(velocity, phase, imu.roll_pitch_yaw[:2]), '')


@pytest.mark.parametrize('velocity', [Velocity(0.2), Velocity(0.1, 0.05), Velocity(yaw=0.6)])
def test_the_teacher_walks(velocity: Velocity) -> None:
    """In physics, as fast as commanded, and upright: or its imitation would not."""
    rig = PhysicsRig(policy=Lesson(GaitTeacher(MODEL, GaitParameters())))
    rig.mode('policy')
    rig.run(1.0, velocity)
    went = rig.travel(2.8, velocity)
    assert (went.x, went.y) == pytest.approx((velocity.x, velocity.y), abs=0.03)
    assert went.yaw == pytest.approx(velocity.yaw, abs=0.12)
    assert went.tilt < math.radians(6.0)
    assert not rig.faulted


def test_a_short_training_gives_a_policy_of_the_right_form(tmp_path: Path) -> None:
    """One round learns something, and what is written fits the robot in all that it says."""
    trainer = Trainer(seed=0)
    assert trainer.collect(1, share=1.0) == pytest.approx(6.0)
    first = trainer.fit(1)
    assert trainer.fit(20) < 0.7 * first
    trainer.collect(1, share=0.0)
    trainer.export(tmp_path / 'short.onnx')
    network = OnnxNetwork(tmp_path / 'short.onnx')
    document = read_metadata(network.metadata)
    contract = build_contract(document)
    stand = GaitGenerator(MODEL, GaitParameters()).stand_targets
    declared = read_declared(network.metadata)
    for row in check_contract(
        network, contract, MODEL, stand,
        document=document, declared=declared, hold_missing=False, period=0.02,
    ):  # fmt: skip
        assert row.verdict.value == 'ok', row
    phase = next(term for term in contract.terms if term.name == 'phase')
    assert math.isclose(phase.phase_period, 0.28)
