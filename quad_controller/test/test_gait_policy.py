# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Policies: what is refused and why, what they are asked, and what becomes of their answers."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
from policy_export import export, Layers
import pytest

from quad_controller import find_policy, load_policy, PolicyError, PolicyOptions, Velocity
from quad_controller.policy.contract.mjlab import VENDOR
from quad_controller.policy.load import LoadedPolicy
from quad_controller.policy.network import OnnxNetwork
from quad_controller.policy.observation import gravity, Situation
from quad_controller.policy.options import GravitySource, ImuFrame
from quad_description import ImuSample, JointSample
from quad_gait_rig import (
    ARM_ROBOT,
    FakeNetwork,
    joined,
    metadata,
    ROBOT,
    STAND,
    TERMS,
    tilted,
    UPRIGHT,
    write_policy,
)

pytestmark = pytest.mark.slow

SHIPPED = find_policy('trot_ppo')
PERIOD = 0.02  # [s]
STILL = JointSample(STAND, (0.0,) * 12)
JOINTS = list(ROBOT.names)
MJLAB_TERMS = 'base_ang_vel,projected_gravity,command,phase,joint_pos,joint_vel,actions'


def check(network: FakeNetwork, options: PolicyOptions | None = None) -> LoadedPolicy:
    """Check a network as a policy of the test's robot."""
    return load_policy(network, ROBOT, STAND, options or PolicyOptions(), PERIOD)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'joint_names': joined(['knee', *JOINTS[1:]])}, 'not in the robot: knee'),
        ({'joint_names': joined([JOINTS[1], *JOINTS[1:]])}, 'twice: fl_thigh_joint'),
        ({'joint_names': None}, 'open: joints: names of the joints'),
        ({'default_joint_pos': joined([3.0] * 12)}, 'default pose: fl_hip_joint 3'),
        ({'default_joint_pos': joined([0.0] * 12)}, 'rad from our stand'),
        ({'default_joint_pos': '0.0,1.0'}, 'must be a number or 12 of them, not 2'),
        ({'default_joint_pos': 'a,b'}, 'not a list of numbers'),
        ({'action_scale': '0.0'}, 'action.scale: 0'),
        ({'action_scale': 'nan'}, 'not finite'),
        ({'observation_names': 'gravity,ang_vel,cmd,phase,joint_pos,joint_vel,prev_action'},
         'open: period: time between two steps'),
        ({'observation_names': TERMS.replace('phase', 'tempo')}, 'terms.tempo.source: one of'),
        ({'observation_names': TERMS.replace('phase', 'cmd')}, 'has cmd twice'),
        ({'observation_terms_history_length': '1.000,3.000,1.000'}, 'has 3 entries for 7 terms'),
        ({'observation_terms_history_length': '1,1,1,1,2,1,1'}, 'input'),
        ({'observation_terms_history_length': '1,1,1,1,2,1,1',
          'observation_terms_flatten_history_dim': 'False'}, 'must be flat'),
        ({'observation_terms_history_length': '1,1,1,1,2.000,1,1',
          'observation_terms_flatten_history_dim': '1,1,1,1,0.000,1,1'}, 'must be flat'),
        ({'observation_terms_scale': '0.25,1.0'}, 'has 2 entries for 7 terms'),
        ({'observation_terms_scale': 'a,1,1,1,1,1,1'}, 'is not a list'),
        ({'observation_terms_scale': '1,1,1,1,1,0.000,1'}, 'joint_vel.scale: 0: the number'),
        ({'imu_frame': 'sideways'}, 'must be one of base, yawed'),
        ({'phase_period': '-1.0'}, 'phase_period -1.0 must be within 0.1 to 5'),
        ({'phase_period': '0.000001'}, 'phase_period'),
        ({'phase_command_threshold': '-1'}, 'phase_threshold -1.0 must be'),
        ({'step_dt': '0.005'}, 'loop_rate: 50 Hz instead of 200 Hz (step_dt)'),
        ({'control_dt': 'soon'}, 'period nan must be a number'),
        ({'obs_dim': '99'}, 'obs_dim (observation): 99 instead of 47'),
        ({'num_actions': '16'}, 'num_actions (action): 16 instead of 12'),
        ({'dims': "{'obs': 47, 'actions': 13}"}, 'dims (action): 13 instead of 12'),
        ({'observation_scale': '0.25,1,1,1,1,0.05,1'}, 'observation_scale = 0.25'),
        ({'clip_actions': '1.0'}, 'clip_actions = 1.0'),
        ({'obs_history': 'five'}, 'obs_history = five'),
    ],
)  # fmt: skip
def test_what_disagrees_is_refused_and_named(changes: dict[str, str | None], reason: str) -> None:
    """A file that says something else than the robot needs is refused with the difference."""
    with pytest.raises(PolicyError) as refusal:
        check(FakeNetwork(metadata(**changes)))
    assert reason in refusal.value.reason


@pytest.mark.parametrize('rate', [10.0, 60.0])
def test_a_policy_runs_at_the_rate_of_its_training_only(rate: float) -> None:
    """50 Hz when the file does not say, else what it says."""
    stated = FakeNetwork(metadata(step_dt=f'{1.0 / rate}'))
    load_policy(stated, ROBOT, STAND, PolicyOptions(), 1.0 / rate)
    with pytest.raises(PolicyError) as refusal:
        load_policy(FakeNetwork(metadata()), ROBOT, STAND, PolicyOptions(), 1.0 / rate)
    assert f'loop_rate: {rate:g} Hz instead of 50 Hz ({VENDOR})' in refusal.value.reason


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'observation_terms_scale': '1,1,1,1,1,0.005,1'}, '0.005, with three decimals'),
        ({'action_scale': '0.004'}, '0.004, with three decimals'),
        ({'decimation': '4', 'latent_dim': '8'}, 'understood: decimation = 4, latent_dim = 8'),
        ({'phase_period': None}, f'0.4, of {VENDOR}'),
    ],
)
def test_what_a_person_should_look_at_is_in_the_table(
    changes: dict[str, str | None], words: str
) -> None:
    """What the exporter rounds, keys that look like a rate or size, the vendor's own values."""
    report = check(FakeNetwork(metadata(**changes))).report
    (row,) = (row for row in report.rows if words in row.found)
    assert row.verdict.value == 'warn'


def test_shapes_and_answers_are_looked_at() -> None:
    """Another width, numbers that are none, and wild answers are refused."""
    wide = FakeNetwork(metadata())
    wide.inputs = (('obs', 'tensor(float)', (1, 56)),)
    two = FakeNetwork(metadata())
    two.inputs = (*two.inputs, ('time_step', 'tensor(float)', (1, 1)))
    wild, bad = FakeNetwork(metadata()), FakeNetwork(metadata())
    wild.action, bad.action = wild.action + 9.0, bad.action * np.float32(np.nan)
    blind = FakeNetwork(metadata())
    blind.blind = True  # as weights that training has driven to zero
    for network, reason in (
        *((wide, 'input'), (two, 'export the actor alone'), (wild, 'standing'), (bad, 'NaN')),
        (blind, 'another observation'),
    ):
        with pytest.raises(PolicyError) as refusal:
            check(network)
        assert reason in refusal.value.reason


def test_the_frame_of_the_imu_is_not_guessed() -> None:
    """A file that does not say it is refused, with the parameter."""
    with pytest.raises(PolicyError) as refusal:
        check(FakeNetwork(metadata(imu_frame=None)))
    assert 'terms.ang_vel.frame: frame of the velocity' in refusal.value.reason


@pytest.mark.parametrize(
    'changes',
    [
        {'joint_names': joined([f'robot/{name}' for name in JOINTS])},
        {'action_scale': joined([0.25] * 12)},
        {'observation_names': MJLAB_TERMS},
        {'observation_terms_scale': '1.000,1.000,1,1.000;1.000,1,1,1',
         'observation_terms_history_length': '0.000,1.000,1,0,1,1,1'},
        {'observation_terms_clip': ','.join(['-inf;inf'] * 7),
         'clip_obs': '100.0', 'observation_terms_flatten_history_dim': ','.join(['1.000'] * 7)},
        {'step_dt': '0.020', 'dims': '47,512,256,12', 'num_obs': '47', 'action_dim': '12'},
    ],
)  # fmt: skip
def test_other_spellings_are_understood(changes: dict[str, str]) -> None:
    """Prefixes, lists for numbers, mjlab's names and neutral extras are no difference."""
    assert not check(FakeNetwork(metadata(**changes))).report.refused


@pytest.mark.parametrize(
    ('frame', 'forward', 'turned', 'phase'),
    [
        (ImuFrame.BASE, 0.2, (0.1, 0.2, 0.3), (0.0, -1.0)),
        (ImuFrame.YAWED, 0.2, (-0.1, -0.2, 0.3), (0.0, -1.0)),  # the vendor's: rates, not gravity
        (ImuFrame.BASE, 0.05, (0.1, 0.2, 0.3), (0.0, 0.0)),  # below the threshold of the phase
    ],
)
def test_the_observation_is_as_agreed(
    frame: ImuFrame, forward: float, turned: tuple[float, ...], phase: tuple[float, ...]
) -> None:
    """ang_vel, gravity, cmd, phase, joint_pos, joint_vel, prev_action, in this order."""
    network = FakeNetwork(metadata(imu_frame=None))
    runner = check(network, PolicyOptions(imu_frame=frame)).runner
    network.action[0] = np.arange(12) * 0.01
    imu = ImuSample(tilted(0.1).orientation, (0.1, 0.2, 0.3), (0.0, 0.0, 20.0))
    command = Velocity(forward, 0.0, 0.3 if forward > 0.1 else 0.0)
    for _ in range(2):  # each a quarter of the period
        runner.step(Situation(STILL, imu, velocity=command), 0.07)
    observed = network.asked[-1][0]
    assert observed[:3] == pytest.approx(turned)
    # the body is rolled to the right: gravity points to its right side
    assert observed[3:6] == pytest.approx([0.0, -math.sin(0.1), -math.cos(0.1)], abs=1e-6)
    assert observed[6:9] == pytest.approx(command)
    assert observed[9:11] == pytest.approx(phase, abs=1e-6)
    assert observed[35:] == pytest.approx(np.arange(12) * 0.01, abs=1e-6)
    runner.step(Situation(STILL, imu, velocity=Velocity(0.2)), 0.07)
    went_on = network.asked[-1][0][9:11]
    assert went_on == pytest.approx([-1.0, 0.0], abs=1e-6), 'as if it never was below'


def test_a_policy_gives_no_targets_for_what_is_not_measured() -> None:
    """Nor for a NaN answer, or a network that raises: a bad step with its reason, and no zero."""
    network = FakeNetwork(metadata())
    runner = check(network).runner
    for joints, imu, reason in (
        (replace(STILL, velocities=None), UPRIGHT, 'velocities of the joints'),
        (STILL, replace(UPRIGHT, angular_velocity=None), 'angular velocity'),
    ):
        step = runner.step(Situation(joints, imu), PERIOD)
        assert step.targets is None
        assert reason in step.reason
    network.action[0, 3] = np.nan
    step = runner.step(Situation(STILL, UPRIGHT), PERIOD)
    assert (step.targets, step.reason) == (None, 'the action is not finite')

    def broken(_observation: object) -> None:
        raise RuntimeError('out of order')

    network.run = broken  # type: ignore[method-assign, assignment]
    assert 'out of order' in runner.step(Situation(STILL, UPRIGHT), PERIOD).reason


@pytest.mark.parametrize('source', GravitySource)
def test_gravity_at_rest_is_the_same_from_all_sources(source: GravitySource) -> None:
    """At rest accelerometer and orientation agree; a jolt does not turn the blend or vanish."""
    leaning = tilted(0.3)
    x, y, z = leaning.down
    at_rest = replace(leaning, acceleration=(-9.81 * x, -9.81 * y, -9.81 * z))
    assert gravity(at_rest, source) == pytest.approx(leaning.down)
    jolted = replace(leaning, acceleration=(15.0, 0.0, 0.0))
    assert gravity(jolted, source) == pytest.approx(leaning.down)
    assert gravity(replace(leaning, acceleration=(0.0, 0.0, 0.0)), source) == leaning.down


def test_targets_stay_within_soft_limits() -> None:
    """The wildest action ends at nine tenths of the range, and is remembered as it was."""
    network = FakeNetwork(metadata())
    runner = check(network).runner
    network.action[0] = 50.0
    targets = runner.step(Situation(STILL, UPRIGHT), PERIOD).targets
    assert targets is not None
    for target, limits in zip(targets, ROBOT.limits, strict=True):
        middle = (limits.lower + limits.upper) / 2
        assert abs(target - middle) <= 0.9 * (limits.upper - limits.lower) / 2 + 1e-6
    runner.step(Situation(STILL, UPRIGHT), PERIOD)
    assert network.asked[-1][0][35:].tolist() == [50.0] * 12
    runner.reset(STAND)
    runner.step(Situation(STILL, UPRIGHT), PERIOD)
    assert not network.asked[-1][0][35:].any()


def test_joints_that_the_robot_lacks_may_be_held() -> None:
    """A policy with an arm runs without one only when that was asked for."""
    values = metadata(
        joint_names=joined([*JOINTS, 'arm_yaw_joint']),
        default_joint_pos=joined([*(round(angle, 3) for angle in STAND), 0.5]),
    )
    with pytest.raises(PolicyError, match='arm_yaw_joint'):
        check(FakeNetwork(values, 13))
    network = FakeNetwork(values, 13)
    runner = check(network, PolicyOptions(hold_missing=True)).runner
    targets = runner.step(Situation(STILL, UPRIGHT), PERIOD).targets
    assert targets == pytest.approx(STAND, abs=1e-3)
    assert network.asked[-1][0][11 + 12] == 0.0


def test_joints_that_the_policy_lacks_stay() -> None:
    """An arm that the policy does not know keeps the targets that it had."""
    start = (*STAND, 0.7)
    runner = load_policy(FakeNetwork(metadata()), ARM_ROBOT, start, PolicyOptions(), PERIOD).runner
    runner.reset(start)
    joints = JointSample((*STAND, 0.1), (0.0,) * 13)
    targets = runner.step(Situation(joints, UPRIGHT), PERIOD).targets
    assert targets is not None
    assert targets[12] == 0.7


def test_a_low_pass_smooths_the_targets() -> None:
    """A step of the action comes through in part first."""
    network = FakeNetwork(metadata())
    runner = check(network, PolicyOptions(low_pass=5.0)).runner
    runner.step(Situation(STILL, UPRIGHT), PERIOD)
    network.action[0] = 1.0
    first = runner.step(Situation(STILL, UPRIGHT), PERIOD).targets
    assert first is not None
    assert 0.05 < first[0] - STAND[0] < 0.2


@pytest.mark.parametrize('mirrored', [False, True])
def test_an_exported_network_answers_as_in_numpy(tmp_path: Path, mirrored: bool) -> None:
    """ONNX Runtime and numpy agree on the same network, normalisation and mirror included."""
    random = np.random.default_rng(3)
    first, second = (
        random.standard_normal(size).astype(np.float32) for size in ((47, 16), (16, 12))
    )
    network = Layers(
        random.standard_normal(47).astype(np.float32),
        random.uniform(0.1, 2.0, 47).astype(np.float32),
        [first, second],
        [random.standard_normal(size).astype(np.float32) for size in (16, 12)],
        (-np.eye(47, dtype=np.float32), -np.eye(12, dtype=np.float32)) if mirrored else None,
    )
    export(network, tmp_path / 'net.onnx', metadata())
    loaded = OnnxNetwork(tmp_path / 'net.onnx')

    def answer(seen: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
        inner = seen @ first + network.biases[0]
        inner = np.where(inner > 0.0, inner, np.expm1(np.minimum(inner, 0.0)))
        result: npt.NDArray[np.floating] = inner @ second + network.biases[1]
        return result

    rows = random.standard_normal((5, 1, 47)).astype(np.float32)
    for row in rows:
        seen = (row - network.mean) / network.deviation
        wanted = 0.5 * (answer(seen) - answer(-seen)) if mirrored else answer(seen)
        assert loaded.run(row) == pytest.approx(wanted, abs=1e-4)
    assert loaded.metadata['joint_names'] == joined(JOINTS)


def test_files_that_are_none_are_refused(tmp_path: Path) -> None:
    """A missing file and one that is no ONNX are distinguished."""
    options = PolicyOptions()
    with pytest.raises(PolicyError, match='No such file'):
        load_policy(tmp_path / 'missing.onnx', ROBOT, STAND, options, PERIOD)
    (tmp_path / 'text.onnx').write_text('not a network')
    with pytest.raises(PolicyError, match='not an ONNX model'):
        load_policy(tmp_path / 'text.onnx', ROBOT, STAND, options, PERIOD)
    narrow = write_policy(tmp_path / 'narrow.onnx', metadata(), width=45)
    with pytest.raises(PolicyError, match='input'):
        load_policy(narrow, ROBOT, STAND, options, PERIOD)
