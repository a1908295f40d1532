# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment in which a robot that was dropped is to come to its feet."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
from gymnasium.utils.env_checker import check_env
import numpy as np
import pytest

from quad_sim import SetupError
from quad_sim.env import (
    Drop,
    GET_UP_ID,
    GetUpEnv,
    GetUpWeights,
    ProcessVectorEnv,
    Randomization,
)

STAND = np.zeros(12, np.float32)
ON_ITS_FEET = Drop(tilt=(0.0, 0.0), joints=0.0, height=(0.0, 0.0), limp=0.0)
ON_ITS_BACK = Drop(tilt=(math.pi, math.pi), joints=0.0, height=(0.0, 0.0), limp=0.0)


def episode(env: GetUpEnv, action: np.ndarray, seed: int = 1) -> tuple[float, dict[str, float]]:
    """Return what an episode with one action was worth, and its terms."""
    env.reset(seed=seed)
    total, over = 0.0, False
    info: dict[str, Any] = {}
    while not over:
        _, reward, terminated, over, info = env.step(action)
        assert not terminated
        total += reward
    return total, info['reward_terms']


def test_gymnasium_finds_nothing_wrong() -> None:
    """Spaces, seeds and types are as all programs of Gymnasium expect them."""
    check_env(GetUpEnv(randomization=Randomization()), skip_render_check=True)


def test_who_stands_gets_more_than_who_lies() -> None:
    """By all that standing is worth; the terms add up to the reward."""
    weights = GetUpWeights()
    stood, terms = episode(GetUpEnv(drop=ON_ITS_FEET, duration=2.0), STAND)
    lain, few = episode(GetUpEnv(drop=ON_ITS_BACK, duration=2.0), STAND)
    assert sum(terms.values()) == pytest.approx(stood)
    assert set(terms) == set(weights.names)
    most = 2.0 * (weights.upright + weights.height + weights.pose + weights.still)
    assert stood > 0.95 * most
    assert lain < 0.05 * most
    assert few['upright'] == pytest.approx(0.0, abs=0.01)
    assert few['height'] == few['pose'] == 0.0


def test_who_stands_still_gets_more_than_who_fidgets_or_crouches() -> None:
    """Each for the term that says so."""
    env = GetUpEnv(drop=ON_ITS_FEET, duration=2.0)
    stood, terms = episode(env, STAND)
    env.reset(seed=1)
    fidgeted, over, step = 0.0, False, 0
    info: dict[str, Any] = {}
    while not over:
        _, reward, _, over, info = env.step(STAND + np.float32(0.1 * (-1) ** step))
        fidgeted, step = fidgeted + reward, step + 1
    assert fidgeted < stood
    for name in ('still', 'action_rate', 'power'):
        assert info['reward_terms'][name] < terms[name]
    crouched, low = episode(env, np.tile(np.array([0.0, 0.4, -0.7], np.float32), 4))
    assert crouched < stood
    assert low['height'] < terms['height']
    assert low['pose'] < terms['pose']


def test_equal_seeds_give_equal_episodes() -> None:
    """Of robot, drop, sensors and kicks; another seed gives others, in the same environment."""
    env = GetUpEnv(randomization=Randomization(kick_interval=0.2), shortest=0.5, duration=1.0)

    def tried(seed: int) -> list[bytes]:
        first, _ = env.reset(seed=seed)
        seen, over = [first.tobytes()], False
        while not over:
            observation, _, _, over, _ = env.step(STAND)
            seen.append(observation.tobytes())
        return seen

    first = tried(5)
    assert tried(6) != first
    assert tried(5) == first


def test_it_lies_as_it_was_dropped() -> None:
    """Any way up, with any joints, and at rest; servos hold what the fall has made of them."""
    env = GetUpEnv()
    tilts, joints = [], []
    for seed in range(24):
        env.reset(seed=seed)
        robot = env.robot
        tilts.append(robot.base_pose.tilt)
        joints.append(robot.joint_positions)
        assert math.hypot(*robot.base_velocity.linear) < 0.2
        assert all(map(robot.torque_on, robot.joint_names))
        assert robot.time == pytest.approx(Drop().time)
    assert min(tilts) < 0.5
    assert max(tilts) > math.pi - 0.5
    spread = np.array(joints).max(axis=0) - np.array(joints).min(axis=0)
    assert (spread > 0.5).all()


def test_attitudes_are_drawn_like_points_on_a_sphere() -> None:
    """Evenly by the cosine of the tilt, to all sides, within the range."""
    random = np.random.default_rng(0)
    drop = Drop(tilt=(math.radians(60.0), math.radians(120.0)))
    x, y, z, w = np.array([drop.orientation(random) for _ in range(2000)]).T
    up = 1.0 - 2.0 * (x * x + y * y)
    assert np.abs(up).max() <= 0.5 + 1e-9
    assert np.quantile(up, (0.25, 0.5, 0.75)) == pytest.approx((-0.25, 0.0, 0.25), abs=0.04)
    side = np.arctan2(y * z + w * x, w * y - x * z)
    assert np.histogram(side, 4, (-math.pi, math.pi))[0].min() > 400


def test_time_alone_ends_it_and_differs_where_it_shall() -> None:
    """From the shortest to the longest."""

    def steps(env: GetUpEnv, seed: int) -> int:
        env.reset(seed=seed)
        return next(n for n in range(1, 1000) if env.step(STAND)[3])

    drop = Drop(time=0.1)
    assert steps(GetUpEnv(drop=drop, duration=1.0), 1) == 50
    varied = GetUpEnv(drop=drop, shortest=0.2, duration=1.0)
    found = [steps(varied, seed) for seed in range(20)]
    assert min(found) < 25
    assert max(found) > 35
    assert 10 <= min(found) <= max(found) <= 50


def test_an_option_is_refused() -> None:
    """There is none."""
    with pytest.raises(SetupError, match='command'):
        GetUpEnv().reset(options={'command': (0.1, 0.0, 0.0)})


def test_gymnasium_makes_many_in_processes() -> None:
    """By the name of the environment, with its arguments; ranges are changed on the way."""
    envs = gymnasium.make_vec(
        GET_UP_ID, num_envs=3, vectorization_mode='vector_entry_point', drop=ON_ITS_FEET
    )
    try:
        assert envs.unwrapped.__class__ is ProcessVectorEnv
        first, _ = envs.reset(seed=1)
        assert first.shape == (3, 42)
        assert (first[:, 5] < -0.99).all()
        envs.unwrapped.call('vary', Randomization(level_bias=(0.2, 0.2)))
        second, _ = envs.reset(seed=1)
        assert np.abs(second[:, 3:5]).min() > 0.15
    finally:
        envs.close()
