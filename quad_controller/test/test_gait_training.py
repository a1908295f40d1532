# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The training in small: its teacher is the gait, and what it writes can be loaded."""

from __future__ import annotations

from importlib.util import find_spec
import math
import os
from pathlib import Path
import subprocess
import sys

from contract_env import (
    contract_of,
    metadata_of,
    PERIOD,
    TaughtEnv,
    walking_contract,
    walking_env,
)
import numpy as np
from policy_export import export
import pytest

from quad_controller import (
    Controller,
    GaitGenerator,
    GaitParameters,
    PolicyOptions,
    StateParameters,
    Velocity,
)
from quad_controller.policy.check import check_contract
from quad_controller.policy.contract.mjlab import read_metadata
from quad_controller.policy.contract.model import build_contract
from quad_controller.policy.network import OnnxNetwork
from quad_controller.policy.runner import PolicyRunner
from quad_gait_physics import MODEL
from quad_gait_policies import FakeNetwork, random_layers
from quad_sim.env import NO_RANDOMIZATION, WalkingEnv

pytestmark = pytest.mark.slow
TRAINING = Path(__file__).parents[1] / 'training'


def test_walking_as_commanded_is_worth_more() -> None:
    """The gait walks; standing still, or walking otherwise, gets less."""

    def worth(commanded: tuple[float, float, float], walked: Velocity) -> float:
        env = WalkingEnv()
        env.reset(seed=1, options={'command': commanded})
        controller = Controller(MODEL, GaitParameters(), StateParameters())
        total = 0.0
        for _ in range(400):
            controller.set_mode('walk')
            controller.set_velocity(walked)
            targets = controller.step(env.state, env.period).targets
            off = np.zeros(12) if targets is None else np.array(targets) - env.stand
            total += float(env.step(off.astype(np.float32))[1])
        return total

    right = worth((0.2, 0.0, 0.0), Velocity(0.2))
    assert right > worth((0.2, 0.0, 0.0), Velocity()) + 2.0
    assert right > worth((0.2, 0.0, 0.0), Velocity(-0.2)) + 2.0
    assert worth((0.0, 0.0, 0.0), Velocity()) > worth((0.0, 0.0, 0.0), Velocity(0.2)) + 2.0


def test_what_is_trained_is_what_runs() -> None:
    """Observations and targets of the environment are those of the controller."""
    env = walking_env(NO_RANDOMIZATION)
    seen, _ = env.reset(seed=1, options={'command': (0.2, 0.0, 0.3)})
    runner = PolicyRunner(
        FakeNetwork({}), env.contract, MODEL, options=PolicyOptions(), period=PERIOD
    )
    phase = math.atan2(seen[9], seen[10]) % math.tau / math.tau
    runner.reset(tuple(env.simulation.stand.tolist()))
    runner.advance(phase * 0.28)
    random = np.random.default_rng(2)
    for _ in range(20):
        action = random.normal(0.0, 0.3, 12).astype(np.float32)
        assert seen == pytest.approx(runner.observe(env.inputs)[0], abs=1e-5)
        targets = runner.act(action, PERIOD)
        before = env.simulation.robot.joint_targets
        seen, *_ = env.step(action)
        slow = np.abs(np.array(targets) - before) < 0.19  # others the limiter of speeds cuts
        sent = env.simulation.robot.joint_targets
        assert slow.any()
        assert sent[slow] == pytest.approx(np.array(targets)[slow], abs=1e-6)
        runner.advance(PERIOD)


@pytest.mark.parametrize('velocity', [Velocity(0.2), Velocity(0.1, 0.05), Velocity(yaw=0.6)])
def test_the_teacher_beside_the_robot_walks_it(velocity: Velocity) -> None:
    """Its answers, as actions of the contract, go as commanded and do not fall."""
    practice = walking_env(NO_RANDOMIZATION)
    env = TaughtEnv(practice)
    robot = practice.simulation.robot
    seen, _ = env.reset(seed=1, options={'command': tuple(velocity)})
    for _ in range(200):
        seen, _, fallen, _, _ = env.step(seen[-12:])
        assert not fallen
    pose = robot.base_pose
    way = math.hypot(*pose.position[:2])
    assert way == pytest.approx(4.0 * math.hypot(velocity.x, velocity.y), abs=0.12)
    assert pose.roll_pitch_yaw[2] == pytest.approx(4.0 * velocity.yaw, abs=0.5)


def test_the_contract_is_in_the_file(tmp_path: Path) -> None:
    """What is written fits the robot in all that it says, and nothing is left open."""
    path, values = tmp_path / 'random.onnx', walking_contract(MODEL, 'a test')
    export(random_layers((47, 8, 12), np.random.default_rng(0)), path, metadata_of(values))
    network = OnnxNetwork(path)
    document = read_metadata(network.metadata)
    contract = build_contract(document)
    assert contract == contract_of(values)
    assert contract.kind == 'a test'
    stand = GaitGenerator(MODEL, GaitParameters()).stand_targets
    for row in check_contract(
        network, contract, MODEL, stand,
        document=document, hold_missing=False, period=PERIOD,
    ):  # fmt: skip
        assert row.verdict.value == 'ok', row


@pytest.mark.skipif(
    find_spec('skrl') is None, reason='`make train` installs what a training needs'
)
def test_a_short_training_ends_with_a_policy_that_is_checked(tmp_path: Path) -> None:
    """The command trains, writes both policies, curves and figures, and says what it found."""
    command = [
        *(sys.executable, str(TRAINING / 'train.py'), '--minutes', '0.6', '--environments', '16'),
        *('--way', '3', '--rounds', '4', '--output', str(tmp_path)),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'falls' in done.stdout
    assert 'accepted' in done.stdout
    for name in ('imitation', 'practice', 'walk'):
        contract = build_contract(read_metadata(OnnxNetwork(tmp_path / f'{name}.onnx').metadata))
        assert contract == contract_of(walking_contract(MODEL, contract.kind))
        assert 'imitation' in contract.kind
    assert list((tmp_path / 'curves').glob('events.out.tfevents.*'))
    assert ',policy,forward,' in (tmp_path / 'figures.csv').read_text()


def test_without_the_library_it_is_said_what_installs_it(tmp_path: Path) -> None:
    """Not a traceback."""
    (tmp_path / 'skrl.py').write_text("raise ImportError('no skrl')\n")
    (tmp_path / 'optax.py').write_text("raise ImportError('no optax')\n")
    (tmp_path / 'jax.py').write_text("raise ImportError('no jax')\n")
    environment = dict(os.environ)
    environment['PYTHONPATH'] = f'{tmp_path}:{environment.get("PYTHONPATH", "")}'
    command = [sys.executable, str(TRAINING / 'train.py'), '--output', str(tmp_path / 'out')]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=60, check=False, env=environment
    )
    assert done.returncode == 1
    assert 'make train' in done.stdout
    assert not done.stderr


@pytest.mark.parametrize('duration', ['0.3', '900', 'nan'])
def test_a_time_that_check_policy_refuses_is_refused_before_the_training(duration: str) -> None:
    """By the same range."""
    command = [sys.executable, str(TRAINING / 'train.py'), '--way', duration]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert 'must be 0.5 to 600' in done.stderr
