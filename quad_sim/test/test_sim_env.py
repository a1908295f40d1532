# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The Gymnasium environment: the same robot as everywhere else, and what differs is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
import math
import multiprocessing

import gymnasium
from gymnasium.utils.env_checker import check_env
import numpy as np
import pytest
from sim_envs import Broken, varied

from quad_description import robot_urdf
from quad_sim import ServoParameters, SetupError, SimulationError, TargetError, Terrain
from quad_sim.env import (
    CommandRanges,
    ID,
    NO_RANDOMIZATION,
    Observation,
    ProcessVectorEnv,
    Randomization,
    RewardWeights,
    WalkingEnv,
)
from quad_sim.physics import PhysicsBackend, Robot, Variation

REST = CommandRanges(rest=1.0)
STAND = np.zeros(12, np.float32)
URDF = robot_urdf('mini')
COMMAND = (0.2, 0.0, 0.5)


def part(observation: np.ndarray, wanted: Observation) -> np.ndarray:
    """Return a part of an observation."""
    start = 0
    for each in Observation:
        width = each.width(12)
        if each is wanted:
            found: np.ndarray = observation[start : start + width]
            return found
        start += width
    raise KeyError(wanted)


def wave(env: WalkingEnv, step: int) -> np.ndarray:
    """Return an action that moves all joints."""
    action: np.ndarray = 0.1 * np.sin(0.3 * step + np.arange(len(env.stand)))
    return action.astype(np.float32)


def test_gymnasium_finds_nothing_wrong() -> None:
    """Spaces, seeds and types are as all programs of Gymnasium expect them."""
    check_env(WalkingEnv(randomization=Randomization()), skip_render_check=True)


def test_it_is_the_robot_of_the_back_end() -> None:
    """The same targets give the same states, bit for bit, where nothing is drawn."""
    env = WalkingEnv()
    env.reset(seed=1)
    with PhysicsBackend(Robot(robot_urdf())) as backend:
        backend.reset()
        for step in range(100):
            action = wave(env, step)
            env.step(action)
            state = backend.step((env.stand + action).astype(np.float64).tolist())
            assert state.joints is not None
            assert env.state.joints is not None
            assert env.state.joints.positions == state.joints.positions
            assert env.state.joints.velocities == state.joints.velocities
            assert env.robot.base_pose.position == state.position


def test_an_observation_is_what_the_sensors_measure() -> None:
    """In SI units, in the order of the table."""
    env = WalkingEnv()
    env.reset(seed=3, options={'command': COMMAND})
    action = wave(env, 1)
    seen, *_ = env.step(action)
    assert env.state.joints is not None
    assert env.state.imu is not None
    off_stand = np.array(env.state.joints.positions) - env.stand
    assert part(seen, Observation.POSITIONS) == pytest.approx(off_stand, abs=1e-6)
    assert part(seen, Observation.VELOCITIES) == pytest.approx(
        env.state.joints.velocities, abs=1e-6
    )
    assert part(seen, Observation.ACTION) == pytest.approx(action)
    assert part(seen, Observation.COMMAND) == pytest.approx(COMMAND)
    assert part(seen, Observation.DOWN) == pytest.approx(env.state.imu.down)
    assert part(seen, Observation.DOWN)[2] < -0.9


def test_equal_seeds_give_equal_episodes() -> None:
    """Of robot, ground, sensors, kicks and commands, whatever was before; others give others."""
    made = [WalkingEnv(randomization=Randomization(kick_interval=0.2)) for _ in range(2)]

    def walk(env: WalkingEnv, seed: int) -> list[object]:
        first, _ = env.reset(seed=seed)
        steps = (env.step(wave(env, step)) for step in range(150))
        return [first.tobytes(), *((seen.tobytes(), reward) for seen, reward, *_ in steps)]

    first, other = (walk(made[0], seed) for seed in (5, 6))
    assert first != other
    assert walk(made[0], 5) == walk(made[1], 5) == first


def test_what_is_drawn_comes_from_the_ranges() -> None:
    """And is drawn anew for each episode."""
    ranges = Randomization()
    drawn = [ranges.variation(np.random.default_rng(seed)) for seed in range(200)]
    for name in ('friction', 'trunk_mass', 'stiffness', 'damping'):
        least, most = getattr(ranges, name)
        values = [getattr(each, name) for each in drawn]
        assert least <= min(values) < least + 0.1 * (most - least)
        assert most >= max(values) > most - 0.1 * (most - least)
    env = WalkingEnv(randomization=ranges)
    masses = {env.reset(seed=seed)[0].tobytes() and env.robot.mass for seed in range(5)}
    assert len(masses) == 5


@pytest.mark.parametrize(
    ('what', 'biased', 'off'),
    [
        (Observation.ANGULAR_VELOCITY, replace(NO_RANDOMIZATION, gyro_bias=(0.3, 0.3)), [0.3] * 3),
        (Observation.DOWN, replace(NO_RANDOMIZATION, level_bias=(0.1, 0.1)), [0.1, -0.1, 0.01]),
    ],
)
def test_a_bias_is_in_what_is_measured(
    what: Observation, biased: Randomization, off: Sequence[float]
) -> None:
    """All along the episode."""
    seen = []
    for randomization in (NO_RANDOMIZATION, biased):
        env = WalkingEnv(randomization=randomization, commands=REST)
        env.reset(seed=2)
        for _ in range(10):
            observation, *_ = env.step(STAND)
        seen.append(part(observation, what))
    assert seen[1] - seen[0] == pytest.approx(off, abs=2e-3)


def test_kicks_come_as_often_as_asked() -> None:
    """About one for each interval, and each moves the robot."""
    often = replace(NO_RANDOMIZATION, kick=(0.3, 0.3), kick_interval=0.5)
    env = WalkingEnv(randomization=often, commands=REST)
    env.reset(seed=4)
    kicks = 0
    for _ in range(500):
        before = env.robot.base_velocity.linear[0]
        env.step(STAND)
        kicks += env.robot.base_velocity.linear[0] > before + 0.1
    assert 8 <= kicks <= 32


def test_a_fall_terminates_and_time_truncates() -> None:
    """At the end stands what each term was worth."""
    env = WalkingEnv(commands=REST, duration=0.5)
    env.reset(seed=1)
    ends = [env.step(STAND)[2:] for _ in range(25)]
    assert [end[:2] for end in ends] == [(False, False)] * 24 + [(False, True)]
    assert set(ends[-1][2]['reward_terms']) == set(RewardWeights().names)
    env = WalkingEnv(commands=REST)
    env.reset(seed=1)
    env.robot.kick((0.0, 2.5, 2.0))
    ends = [env.step(STAND)[2:] for _ in range(100)]
    fell = next(number for number, (terminated, *_) in enumerate(ends) if terminated)
    assert ends[fell][2]['reward_terms']['fall'] == pytest.approx(RewardWeights().fall)
    assert not any(truncated for _, truncated, _ in ends)


def test_commands_are_within_their_ranges() -> None:
    """Some are zero, some along one axis; all axes occur, both ways."""
    random = np.random.default_rng(0)
    ranges = CommandRanges()
    drawn = np.array([ranges.draw(random) for _ in range(2000)])
    lowest, highest = np.array([ranges.x, ranges.y, ranges.yaw]).T
    assert (drawn >= lowest).all()
    assert (drawn <= highest).all()
    assert (drawn.min(axis=0) < 0.95 * lowest).all()
    assert (drawn.max(axis=0) > 0.95 * highest).all()
    parts = (drawn != 0.0).sum(axis=1)
    assert np.mean(parts == 0) == pytest.approx(ranges.rest, abs=0.03)
    assert np.mean(parts == 1) == pytest.approx((1 - ranges.rest) * ranges.straight, abs=0.04)


def test_what_leads_beyond_a_limit_is_taken_to_the_limit() -> None:
    """And is seen, and judged, as that."""
    far, near = (WalkingEnv(commands=REST) for _ in range(2))
    results = []
    for env, action in ((far, np.full(12, 100.0, np.float32)), (near, near.action_space.high)):  # type: ignore[attr-defined]
        env.reset(seed=1)
        results.append(env.step(action))
    assert (results[0][0] == results[1][0]).all()
    assert results[0][1] == results[1][1]


def test_a_new_command_is_seen_before_it_is_judged() -> None:
    """The observation that a step returns has the command of the next reward."""
    commands = CommandRanges(x=(0.3, 0.3), y=(0.0, 0.0), yaw=(0.0, 0.0), time=0.1, straight=0.0)
    env = WalkingEnv(commands=replace(commands, rest=0.5))
    seen, _ = env.reset(seed=3)
    changes = 0
    for _ in range(100):
        before = part(seen, Observation.COMMAND)
        error = env.error[0]
        seen, *_ = env.step(STAND)
        off = env.robot.base_velocity.linear[0] - before[0]
        assert env.error[0] == pytest.approx(error + env.period / 0.4 * (off - error))
        changes += bool((part(seen, Observation.COMMAND) != before).any())
    assert changes > 3


def test_other_programs_record_its_episodes() -> None:
    """A wrapper of Gymnasium that most trainers use."""
    env = gymnasium.wrappers.RecordEpisodeStatistics(WalkingEnv(commands=REST, duration=0.1))
    env.reset(seed=1)
    ends = [env.step(STAND)[4] for _ in range(5)]
    assert ends[-1]['episode']['l'] == 5
    assert 'reward_terms' in ends[-1]


@pytest.mark.parametrize('action', [np.zeros(11), np.full(12, np.nan)])
def test_an_action_that_is_not_finite_or_complete_is_refused(action: np.ndarray) -> None:
    """And nothing moves."""
    env = WalkingEnv()
    before = env.robot.time
    with pytest.raises(TargetError):
        env.step(action.astype(np.float32))
    assert env.robot.time == before


@pytest.mark.parametrize(
    ('make', 'reason'),
    [
        (lambda: Randomization(friction=(1.0, 0.5)), 'friction'),
        (lambda: Randomization(friction=(0.0, 0.5)), 'friction'),
        (lambda: Randomization(trunk_mass=(-1.0, 1.0)), 'trunk_mass'),
        (lambda: Randomization(delay=(-0.01, 0.0)), 'delay'),
        (lambda: Randomization(kick=(math.nan, 1.0)), 'kick'),
        (lambda: Randomization(kick_interval=-1.0), 'kick_interval'),
        (lambda: Randomization().scaled(1.1), 'share'),
        (lambda: Randomization().scaled(math.nan), 'share'),
        (lambda: CommandRanges(time=0.0), 'time'),
        (lambda: CommandRanges(x=(0.3, -0.3)), 'x'),
        (lambda: CommandRanges(rest=2.0), 'rest'),
        (lambda: RewardWeights(tracking=math.nan), 'tracking'),
        (lambda: RewardWeights(turning_width=0.0), 'turning_width'),
        (lambda: WalkingEnv(duration=0.01), 'duration'),
        (lambda: Randomization(bumps=(0.0, 1.5)), 'bumps'),
        (lambda: WalkingEnv().reset(options={'command': (0.1, 0.2)}), 'x and y'),
        (lambda: WalkingEnv().reset(options={'command': (0.1, math.nan, 0.0)}), 'x and y'),
        (lambda: WalkingEnv().reset(options={'comand': (0.1, 0.0, 0.0)}), 'comand'),
        (lambda: ServoParameters(stiffness=-1), 'stiffness -1'),
        (lambda: ServoParameters(stiffness=0), 'never moves'),
        (lambda: ServoParameters(stiffness=1, damping=math.nan), 'damping nan'),
        (lambda: ServoParameters(stiffness=1, delay=1.5), 'give 0 to 1'),
        (lambda: Terrain.slope(1.0), 'slope of 1.0'),
        (lambda: Terrain.slope(math.nan), 'slope of nan'),
        (lambda: Terrain(friction=0), 'friction 0'),
        (lambda: Robot(URDF, timestep=0.5), 'timestep 0.5'),
        (lambda: Robot(URDF, pose={'tail_joint': 0}), 'tail_joint'),
        (lambda: Robot(URDF).set_torque(False, ['tail']), 'tail'),
        (lambda: Robot(URDF).kick((math.nan, 0, 0)), 'kick'),
        (lambda: Robot(URDF).kick((0, 0, 11)), 'up to 10 m/s'),
        (lambda: Robot(URDF).push((0, 0, 0), -1), 'push'),
        (lambda: Robot(URDF).push((1e3, 0, 0), 1), 'up to 200 N'),
        (lambda: Robot(URDF).push((0, math.inf, 0), 1), 'push'),
        (lambda: Robot(URDF).push((1, 0, 0), math.nan), 'push'),
        (lambda: Variation(friction=0.0), 'friction'),
        (lambda: Variation(stiffness=math.nan), 'stiffness'),
        (lambda: Variation(damping=-0.1), 'damping'),
        (lambda: Terrain(roughness=0.2), 'roughness'),
        (lambda: Terrain(roughness=math.nan), 'roughness'),
    ],
)
def test_what_makes_no_sense_is_refused(make: Callable[[], object], reason: str) -> None:
    """Before anything moves, with the option and its value or what it should be."""
    with pytest.raises(SetupError, match=reason):
        make()


def test_many_in_processes_are_the_same_ones() -> None:
    """Each row is what that environment alone would give, over the ends of episodes, too."""
    count = 5
    with closing(ProcessVectorEnv(partial(varied, 1.0), count, processes=2)) as envs:
        alone = [varied(1.0) for _ in range(count)]
        seen, _ = envs.reset(seed=7)
        for index, env in enumerate(alone):
            assert (seen[index] == env.reset(seed=7 + index)[0]).all()
        for step in range(25):
            actions = np.array([(1 + index) * wave(alone[0], step) for index in range(count)])
            seen, rewards, fallen, over, infos = envs.step(actions)
            for index, env in enumerate(alone):
                one, reward, one_fallen, one_over, info = env.step(actions[index])
                assert (bool(fallen[index]), bool(over[index])) == (one_fallen, one_over)
                assert rewards[index] == pytest.approx(reward, abs=1e-6)
                if one_fallen or one_over:
                    assert (infos['final_obs'][index] == one).all()
                    found = infos['final_info']['reward_terms']['tracking'][index]
                    assert found == pytest.approx(info['reward_terms']['tracking'])
                    one, _ = env.reset()
                assert (seen[index] == one).all()


def test_gymnasium_makes_many_in_processes() -> None:
    """By the name of the environment, with its arguments."""
    envs = gymnasium.make_vec(
        ID, num_envs=3, vectorization_mode='vector_entry_point', commands=REST
    )
    try:
        assert envs.unwrapped.__class__ is ProcessVectorEnv
        seen, _ = envs.reset(seed=1)
        assert seen.shape == (3, 45)
        assert not seen[:, 6:9].any()
        assert envs.action_space.shape == (3, 12)
    finally:
        envs.close()


def test_ranges_of_many_are_changed_on_the_way() -> None:
    """From the next episodes on."""
    with closing(ProcessVectorEnv(partial(varied, 0.0), 4, processes=2)) as envs:
        first, _ = envs.reset(seed=3)
        envs.call('vary', Randomization(level_bias=(0.2, 0.2)))
        second, _ = envs.reset(seed=3)
        assert np.abs(first[:, 3:5]).max() < 0.03
        assert np.abs(second[:, 3:5]).min() > 0.15
        with pytest.raises(SimulationError, match='nothing'):
            envs.call('nothing')


@pytest.mark.parametrize(('deadly', 'said'), [(False, 'the third step'), (True, 'exit code 7')])
def test_what_goes_wrong_in_a_process_is_said(deadly: bool, said: str) -> None:
    """And the others end."""
    with closing(ProcessVectorEnv(partial(Broken, deadly), 2, processes=2)) as envs:
        envs.reset(seed=1)
        actions = np.zeros((2, 12), np.float32)
        envs.step(actions)
        envs.step(actions)
        with pytest.raises(SimulationError, match=said):
            envs.step(actions)
    assert not multiprocessing.active_children()
