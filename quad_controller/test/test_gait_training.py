# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The training in small: what is trained is what runs, and what it writes can be loaded."""

from __future__ import annotations

from importlib.util import find_spec
import math
import os
from pathlib import Path
import subprocess
import sys

from contract_env import contract_of, PERIOD, PLANT, UNSEEN, walking_env
import numpy as np
import pytest

from quad_controller import (
    Controller,
    find_policy,
    GaitGenerator,
    GaitParameters,
    load_policy,
    PolicyOptions,
    StateParameters,
    Velocity,
)
from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.network import OnnxNetwork
from quad_controller.policy.runner import PolicyRunner
from quad_gait_rig import FakeNetwork, MODEL
from quad_sim.env import NO_RANDOMIZATION, WalkingEnv

pytestmark = pytest.mark.slow
TRAINING = Path(__file__).parents[1] / 'training'
CONTRACT = build_contract(contract_of(find_policy('trot_ppo'), 'a test'))


def test_servos_and_sensors_differ_in_each_episode() -> None:
    """From 1 to 12 N m/rad and up to 60 ms late; half of them in the bytes of protocol v1."""
    env = walking_env(CONTRACT, PLANT)
    robots, rounded, errors = [], 0, []
    for seed in range(30):
        env.reset(seed=seed)
        robots.append(env.simulation.variation)
        seen = np.degrees(env.inputs.joints.positions[0]) if env.inputs.joints else math.nan
        byte = (seen + 30.0) * 255.0 / 60.0  # of the span of a hip
        rounded += abs(byte - round(byte)) < 1e-6
        env.step(np.zeros(12, np.float32))
        errors += [env.inputs.joints.velocity_error if env.inputs.joints else math.nan]
    stiffness = [3.5 * each.stiffness for each in robots]
    assert 1.0 <= min(stiffness) < 1.7
    assert 8.0 < max(stiffness) <= 12.0
    assert 0.05 < max(each.delay for each in robots) <= 0.06
    assert max(each.backlash for each in robots) > math.radians(1.2)
    assert max(each.refresh for each in robots) > 0.035
    assert 7 < rounded < 23
    # the contract states how inexact the joint velocities were, so that v1 runs what it trained
    assert CONTRACT.velocity_noise == pytest.approx(max(errors), rel=0.02)


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
    # also where the commanded velocity is far away
    assert worth((0.3, 0.0, 0.0), Velocity(0.1)) > worth((0.3, 0.0, 0.0), Velocity()) + 0.2
    assert right > worth((0.2, 0.0, 0.0), Velocity()) + 2.0
    assert right > worth((0.2, 0.0, 0.0), Velocity(-0.2)) + 2.0
    assert worth((0.0, 0.0, 0.0), Velocity()) > worth((0.0, 0.0, 0.0), Velocity(0.2)) + 2.0


def test_what_is_trained_is_what_runs() -> None:
    """Observations and targets of the environment are those of the controller."""
    env = walking_env(CONTRACT, NO_RANDOMIZATION)
    seen, _ = env.reset(seed=1, options={'command': (0.2, 0.0, 0.3)})
    runner = PolicyRunner(
        FakeNetwork({}), env.contract, MODEL, options=PolicyOptions(), period=PERIOD
    )
    width = env.contract.width
    phase = math.atan2(seen[9], seen[10]) % math.tau / math.tau
    runner.reset(tuple(env.simulation.stand.tolist()))
    runner.advance(phase * 0.28)
    random = np.random.default_rng(2)
    for _ in range(20):
        action = random.normal(0.0, 0.3, 12).astype(np.float32)
        assert seen[:width] == pytest.approx(runner.observe(env.inputs)[0], abs=1e-5)
        targets = runner.act(action, PERIOD)
        before = env.simulation.robot.joint_targets
        asked, error = env.inputs.velocity.x, env.simulation.error[0]
        seen, *_ = env.step(action)
        # it is judged by the velocity that it saw, which changes as the controller lets it
        off = env.simulation.robot.base_velocity.linear[0] - asked
        assert env.simulation.error[0] == pytest.approx(error + PERIOD / 0.4 * (off - error))
        slow = np.abs(np.array(targets) - before) < 0.19  # others the limiter of speeds cuts
        sent = env.simulation.robot.joint_targets
        assert slow.any()
        # to half a step of the widest byte of protocol v1
        assert sent[slow] == pytest.approx(np.array(targets)[slow], abs=math.radians(0.32))
        runner.advance(PERIOD)
    # the judge sees more: how the plant is, and how far the velocity is from the commanded one
    assert len(seen) == width + UNSEEN
    assert seen[-3:] == pytest.approx(np.array(env.simulation.error) / (0.1, 0.1, 0.4), abs=1e-5)


def test_the_shipped_policy_drifts_to_no_side_by_itself() -> None:
    """It answers a mirror image with the mirror image of its answer."""
    network, random = OnnxNetwork(find_policy('trot_ppo')), np.random.default_rng(1)
    turn, shift, command = (-1, 1, -1), (1, -1, 1), (1, -1, -1)
    signs = np.array([*turn, *shift, *command, -1, -1, *(1,) * 36], np.float32)
    other_side = np.array([3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8])
    places = np.concatenate((np.arange(11), *(11 + 12 * n + other_side for n in range(3))))
    for _ in range(20):
        seen = random.standard_normal((1, 47)).astype(np.float32)
        here, mirrored = network.run(seen), network.run((seen * signs)[:, places])
        assert mirrored[..., other_side] == pytest.approx(here, abs=1e-4)


@pytest.mark.skipif(
    find_spec('skrl') is None, reason='`make train` installs what a training needs'
)
def test_a_short_training_ends_with_a_policy_that_is_checked(tmp_path: Path) -> None:
    """The command goes on with the example; policy, curves and figures are written, and judged."""
    command = [
        *(sys.executable, str(TRAINING / 'train.py'), '--minutes', '0.3', '--environments', '16'),
        *('--way', '2', '--output', str(tmp_path)),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode in {0, 1}, done.stdout + done.stderr
    assert 'randomized' in done.stdout
    assert f'check_policy: {"refused" if done.returncode else "accepted"}' in done.stdout
    stand = GaitGenerator(MODEL, GaitParameters()).stand_targets
    trained, example = (
        load_policy(path, MODEL, stand, PolicyOptions(), PERIOD)
        for path in (tmp_path / 'walk.onnx', find_policy('trot_ppo'))
    )
    assert trained.contract.terms == example.contract.terms
    assert trained.digest != example.digest
    assert list((tmp_path / 'curves').glob('events.out.tfevents.*'))
    assert ',policy,forward,' in (tmp_path / 'figures.csv').read_text()


def test_without_the_library_it_is_said_what_installs_it(tmp_path: Path) -> None:
    """Not a traceback."""
    (tmp_path / 'skrl.py').write_text("raise ImportError('no skrl')\n")
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


def test_a_time_that_check_policy_refuses_is_refused_before_the_training() -> None:
    """By the same range."""
    command = [sys.executable, str(TRAINING / 'train.py'), '--way', 'nan']
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert 'must be 0.5 to 600' in done.stderr
