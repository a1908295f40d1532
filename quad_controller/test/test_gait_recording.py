# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of steps, and policies that are fed by them."""

from __future__ import annotations

import math
from pathlib import Path
import shutil
import threading

import numpy as np
import pytest

from quad_controller import (
    Controller,
    find_policy,
    GaitGenerator,
    GaitParameters,
    load_policy,
    Output,
    ParameterError,
    PolicyOptions,
    StateParameters,
    Velocity,
)
from quad_controller.nodes.messages import Recorder
from quad_controller.policy.options import GravitySource
from quad_controller.policy.runner import PolicyRunner
from quad_controller.recording import feed, inputs_of, PolicyRun, read_recording, TOPIC, unpack
from quad_controller.recording import run as replay_policy
from quad_description import JointSample, RobotState
from quad_gait_rig import FIRM, firm, MODEL, PERIOD, ROBOT, STANDING, UPRIGHT
from quad_msgs.msg import ControllerStep
from quad_sim.physics import PhysicsBackend
from rosbag_files import BagReader, BagWriter, METADATA_FILE

FORWARD = Velocity(0.15)
TIMES = 1_700_000_000_123_456_789, 0.0201, 0.0007, None
AS_SHIPPED = PolicyOptions()


def shipped(options: PolicyOptions = AS_SHIPPED) -> PolicyRunner:
    """Return the policy that is shipped, anew."""
    stand = GaitGenerator(MODEL, FIRM).stand_targets
    return load_policy(find_policy('trot_ppo'), MODEL, stand, options, PERIOD).runner


def walk(folder: Path, seconds: float, *, options: PolicyOptions = AS_SHIPPED) -> Path:
    """Record a walk in physics: standing up by the gait, then by the policy that is shipped."""
    policy = shipped(options)
    backend = PhysicsBackend(firm(), PERIOD)
    controller = Controller(MODEL, FIRM, StateParameters(), policy=policy)
    run = PolicyRun('trot_ppo', options, PERIOD)
    recorder = Recorder(folder, run.about, backlog=10_000)
    assert not run.keep_contract(folder)
    state = backend.observe()
    for step in range(round(seconds / PERIOD)):
        controller.set_velocity(FORWARD)
        output = controller.step(state, PERIOD)
        stamp = round((1 + step * PERIOD) * 1e9)
        recorder.offer(output, stamp, PERIOD, 0.001, 0.002)
        state = backend.step(output.targets)
        if step == 0:
            assert controller.set_mode('policy').accepted
    recorder.close()
    assert not recorder.lost
    assert not recorder.failure
    return folder


def test_a_step_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Without ROS, by the definition in the recording; one of before lacks what came later."""
    controller = Controller(ROBOT, GaitParameters(), StateParameters())
    joints = JointSample(STANDING, (0.5,) * 12)
    feet = (True, False, True, True)
    output = controller.step(RobotState(joints, UPRIGHT, foot_contacts=feet), PERIOD)
    recorder = Recorder(tmp_path / 'one', {})
    recorder.offer(output, *TIMES)
    recorder.close()
    reader = BagReader(tmp_path / 'one')
    (message,) = reader.messages()
    assert message.log_time == TIMES[0]
    definition = reader.metadata.topics[0].topic.definition
    step = unpack(definition, message.data)
    fields = ControllerStep.get_fields_and_field_types()
    assert ['stamp', *step] == list(fields)
    assert (step['state'], step['dt']) == ('relax', TIMES[1])
    assert math.isnan(step['latency'])
    inputs = inputs_of(step)
    assert inputs is not None
    assert inputs.joints is not None
    assert inputs.joints.positions == pytest.approx(STANDING)
    assert inputs.joints.velocities == (0.5,) * 12
    assert inputs.imu is not None
    assert inputs.imu.orientation == (0.0, 0.0, 0.0, 1.0)
    assert (inputs.linear_velocity, inputs.foot_contacts) == (None, feet)
    before = inputs_of(unpack(definition.replace('float32[] foot_contacts', '#'), message.data))
    assert before is not None
    assert before.foot_contacts is None
    for size in (0, 3, 40):
        with pytest.raises(ValueError, match=r'CDR|ControllerStep'):
            unpack(definition, message.data[:size])


def test_steps_that_find_no_place_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a slow disk the backlog is bounded, and the control loop never waits."""
    slow, write = threading.Event(), BagWriter.write
    monkeypatch.setattr(BagWriter, 'write', lambda *step: slow.wait() and write(*step))
    recorder = Recorder(tmp_path / 'full', {}, backlog=3)
    output = Output(None, None, 'relax', False, ())
    for _ in range(5):
        recorder.offer(output, *TIMES)
    assert recorder.lost == 2
    slow.set()
    recorder.close()
    assert len(read_recording(tmp_path / 'full')) == 3


def test_a_folder_that_cannot_be_made_is_refused_at_the_start(tmp_path: Path) -> None:
    """The message has the folder."""
    (tmp_path / 'file').write_text('', encoding='utf-8')
    with pytest.raises(ParameterError, match=r'record: .*file'):
        Recorder(tmp_path / 'file', {})


@pytest.mark.slow
def test_a_recorded_walk_is_answered_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Observations and actions are recomputed from what was measured; other answers are seen."""
    folder = walk(tmp_path / 'walk', 5.0)
    reader = BagReader(folder)
    assert [(each.topic.name, each.count) for each in reader.metadata.topics] == [(TOPIC, 250)]
    assert replay_policy([str(folder)]) == 0
    printed = capsys.readouterr().out
    assert 'trot_ppo.onnx' in printed
    assert 'the same' in printed
    steps = read_recording(folder)
    asked = [step for step in steps if len(step['action'])]
    assert len(asked) > 100
    wrong = [*steps[:-1], {**steps[-1], 'action': steps[-1]['action'] + np.float32(0.01)}]
    answers = list(feed(shipped(), wrong))
    off = np.abs(answers[-1].action - answers[-1].step['action']).max()
    assert off == pytest.approx(0.01, abs=1e-3)
    (file,) = folder.glob('*.mcap')
    assert replay_policy([str(file)]) == 0  # the file of a folder that says which policy ran
    (folder / METADATA_FILE).unlink()
    for recording in (folder, file):
        capsys.readouterr()
        assert replay_policy([str(recording)]) == 1
        assert 'does not say which policy ran' in capsys.readouterr().out


@pytest.mark.slow
def test_a_policy_is_replayed_as_it_was_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its parameters and its contract's file are in the recording."""
    contract = tmp_path / 'own.yaml'
    contract.write_text('period: 0.02\ncommands: {x: [-0.05, 0.05]}\n', encoding='utf-8')
    options = PolicyOptions(contract, phase_period=0.4, gravity_source=GravitySource.EULER)
    folder = walk(tmp_path / 'walk', 3.0, options=options)
    contract.unlink()
    assert 'own.yaml' in PolicyRun('', options, PERIOD).keep_contract(folder)
    assert replay_policy([str(folder)]) == 0
    assert 'the same' in capsys.readouterr().out
    other = tmp_path / 'other.yaml'
    other.write_text('period: 0.02\n', encoding='utf-8')
    assert replay_policy([str(folder), '--contract', str(other)]) == 1
    assert 'NOT the same' in capsys.readouterr().out
    # a model that is named is another one: what was set for the recorded one is not its
    named = shutil.copy(find_policy('trot_ppo'), tmp_path / 'named.onnx')
    assert replay_policy([str(folder), str(named)]) == 1
    assert 'NOT the same' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('no', 'options of a policy'),
        ('[]', 'options of a policy'),
        ('{"low_pass": -1}', 'policy_low_pass -1 is not within'),
        ('{"imu_frame": "none"}', 'options of a policy'),
        ('{"unknown": 1}', 'options of a policy'),
    ],
)
def test_options_that_are_none_are_refused(text: str, reason: str) -> None:
    """A recording may come from elsewhere; what it does not say has its default."""
    with pytest.raises(ParameterError, match=reason):
        PolicyOptions.from_json(text)
    assert PolicyOptions.from_json('{"low_pass": 5.0}') == PolicyOptions(low_pass=5.0)


def test_what_is_no_recording_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one line."""
    assert replay_policy([str(tmp_path / 'nothing')]) == 1
    assert 'nothing' in capsys.readouterr().out
