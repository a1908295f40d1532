# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contracts: policies of five tools answer as in their tool; what is open is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math
from pathlib import Path

import numpy as np
import onnx
import pytest
import yaml

from quad_controller import (
    Controller,
    GaitParameters,
    load_policy,
    PolicyError,
    PolicyOptions,
    StateParameters,
    Velocity,
)
from quad_controller.attach_contract import run
from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.contract.document import document_of, read_yaml
from quad_controller.policy.contract.mjlab import read_metadata
from quad_controller.policy.contract.model import RecurrentState
from quad_controller.policy.load import LoadedPolicy, read_contract_file
from quad_controller.policy.network import Floats, OnnxNetwork
from quad_controller.policy.observation import Situation
from quad_controller.policy.options import GravitySource
from quad_description import ImuSample, JointSample, RobotState
from quad_description.rotations import normalized
from quad_gait_rig import ROBOT, STAND, UPRIGHT
from quad_tool_policies import DEFAULTS, JOINTS, ReferencePolicy, Step, Tool, TOOLS, write_network

pytestmark = pytest.mark.slow

PERIOD = 0.02  # [s]
OPTIONS = PolicyOptions(gravity_source=GravitySource.EULER, soft_limits=1.0)
# a default pose of a robot whose calves have another zero
OTHER_ZERO = [
    place - 0.5 * ('calf' in name) for name, place in zip(JOINTS, DEFAULTS.tolist(), strict=True)
]
ORDER = [ROBOT.names.index(name) for name in JOINTS]


def attached(tool: Tool, folder: Path, *, left_out: str = '') -> list[str]:
    """Write a tool's files; return the arguments that attach its contract."""
    arguments = [str(folder / 'policy.onnx')]
    for name, text in tool.files.items():
        (folder / name).write_text(text)
        arguments.append(str(folder / name))
    for key, value in tool.settings.items():
        if key != left_out:
            arguments += ['--set', f'{key}={yaml.safe_dump(value, default_flow_style=True)}']
    return arguments


def load(path: Path) -> LoadedPolicy:
    """Load a policy for the test's robot."""
    return load_policy(path, ROBOT, STAND, OPTIONS, PERIOD)


def made(tool: Tool, folder: Path, *settings: str, external: bool = False) -> Path:
    """Write a tool's policy, whose contract is attached; return its path."""
    path = folder / 'policy.onnx'
    write_network(tool, path, external=external)
    assert run([*attached(tool, folder), *settings]) == 0
    return path


def controlled(tool: Tool, folder: Path, *settings: str) -> Controller:
    """Return a controller with such a policy."""
    policy = load(made(tool, folder, *settings)).runner
    return Controller(ROBOT, GaitParameters(), StateParameters(), policy=policy)


@pytest.mark.parametrize('name', TOOLS)
@pytest.mark.parametrize('external', [False, True], ids=['one_file', 'side_file'])
def test_policies_answer_as_in_their_tool(name: str, external: bool, tmp_path: Path) -> None:
    """A recorded run gives the targets of the tool's own observation code, to 1e-5 rad."""
    tool = TOOLS[name]()
    reference = ReferencePolicy(tool, *write_network(tool, tmp_path / 'policy.onnx',
                                                     external=external))  # fmt: skip
    assert run(attached(tool, tmp_path)) == 0
    runner = load(tmp_path / 'policy.onnx').runner
    runner.reset(STAND)
    random = np.random.default_rng(3)
    expected = DEFAULTS
    for count in range(40):
        inputs, step = recorded(random)
        targets = runner.step(inputs, PERIOD).targets
        if count % tool.decimation == 0:
            expected = reference.step(step)
        assert targets is not None
        assert [targets[place] for place in ORDER] == pytest.approx(expected, abs=1e-5)


def recorded(random: np.random.Generator) -> tuple[Situation, Step]:
    """Return a step of a run, as the robot and as a tool sees it."""
    positions = np.array(STAND) + random.uniform(-0.6, 0.6, 12)
    velocities = random.uniform(-6.0, 6.0, 12)
    linear, angular = random.uniform(-0.5, 0.5, 3), random.uniform(-2.0, 2.0, 3)
    command = random.uniform(-0.5, 0.5, 3)
    x, y, z, w = normalized((*random.uniform(-0.3, 0.3, 3).tolist(), 1.0))
    # third row of the rotation of body to world, negative: gravity in the body
    gravity = [-2 * (x * z - w * y), -2 * (y * z + w * x), -(1 - 2 * (x * x + y * y))]
    inputs = Situation(
        JointSample(tuple(positions.tolist()), tuple(velocities.tolist())),
        ImuSample((x, y, z, w), tuple(angular.tolist()), None),
        linear_velocity=tuple(linear.tolist()),
        velocity=Velocity(*command.tolist()),
    )
    measured = (linear, angular, gravity, command, positions[ORDER], velocities[ORDER])
    step = Step(*(np.array(values, np.float32) for values in measured))
    return inputs, step


@pytest.mark.parametrize(
    ('name', 'key'), [(name, key) for name in TOOLS for key in TOOLS[name]().settings]
)
def test_what_a_file_leaves_open_is_asked_for(
    name: str, key: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without the setting nothing is written, and its key is named."""
    tool = TOOLS[name]()
    write_network(tool, tmp_path / 'policy.onnx')
    before = (tmp_path / 'policy.onnx').read_bytes()
    status = run(attached(tool, tmp_path, left_out=key))
    if key == 'recurrence':  # no file knows whether an input is a state: its shape refuses it
        with pytest.raises(PolicyError, match='input'):
            load(tmp_path / 'policy.onnx')
        return
    assert status == 1
    assert f'{key}: ' in capsys.readouterr().out.partition('open: ')[2]
    assert (tmp_path / 'policy.onnx').read_bytes() == before


def test_a_changed_side_file_changes_the_digest(tmp_path: Path) -> None:
    """Weights beside the file count; a name that leads elsewhere is refused."""
    tool = TOOLS['rl_sar']()
    path, read = made(tool, tmp_path, external=True), attached(tool, tmp_path)
    first = load(path)
    assert 'sha256 is of both' in str(first)
    side = tmp_path / 'policy.onnx.data'
    before = side.read_bytes()
    data = bytearray(before)
    data[8] ^= 1
    side.write_bytes(data)
    with pytest.raises(PolicyError, match='are not those'):
        load(path)
    assert run(read) == 0
    assert load(path).digest != first.digest
    side.unlink()
    with pytest.raises(PolicyError, match='copy that file along'):
        load(path)
    path.write_bytes(path.read_bytes().replace(b'policy.onnx.data', b'../icy.onnx.data'))
    with pytest.raises(PolicyError, match='outside of its folder'):
        load(path)


def test_a_policy_may_be_a_link(tmp_path: Path) -> None:
    """Its weights lie beside the link, as in the cache of a download, or beside the file."""
    path = made(TOOLS['rl_sar'](), tmp_path, external=True)
    digest = load(path).digest
    linked, snapshot = (tmp_path / folder / 'policy.onnx' for folder in ('linked', 'snapshot'))
    for link in (linked, snapshot):
        link.parent.mkdir()
        link.symlink_to(path)
    assert load(linked).digest == digest
    blob = (tmp_path / 'policy.onnx.data').rename(tmp_path / '4f5e')
    snapshot.with_suffix('.onnx.data').symlink_to(blob)
    assert load(snapshot).digest == digest


def test_weights_that_are_overwritten_do_not_count(tmp_path: Path) -> None:
    """A new export is copied over the old one while the robot walks."""
    tool = TOOLS['playground']()
    path, side = made(tool, tmp_path, external=True), tmp_path / 'policy.onnx.data'
    network = OnnxNetwork(path)
    network.recur((RecurrentState('h_in', 'h_out'),))
    seen = np.ones((1, tool.width), np.float32)
    before = network.run(seen)
    with side.open('r+b') as stream:  # in place, as `cp` does
        stream.write(bytes(len(side.read_bytes())))
    network.reset()
    assert np.array_equal(network.run(seen), before)


@pytest.mark.parametrize('external', [False, True])
def test_weights_that_are_no_numbers_are_refused(external: bool, tmp_path: Path) -> None:
    """ONNX Runtime answers ordinary numbers for an LSTM whose weights are NaN."""
    tool = TOOLS['playground']()
    path = tmp_path / 'policy.onnx'
    weight, _ = write_network(tool, path, external=external)
    part = tmp_path / 'policy.onnx.data' if external else path
    first = weight.tobytes()[:4]
    part.write_bytes(part.read_bytes().replace(first, np.float32(np.nan).tobytes(), 1))
    with pytest.raises(PolicyError, match='weights of weight are not finite'):
        OnnxNetwork(path)


def test_the_output_of_the_actions_is_named(tmp_path: Path) -> None:
    """A whole actor-critic has a value, too; the refusal names the ports and the key."""
    tool = TOOLS['rl_sar']()
    path = tmp_path / 'policy.onnx'
    write_network(tool, path)
    model = onnx.load(path)
    value = onnx.helper.make_tensor_value_info('value', onnx.TensorProto.FLOAT, ['batch', 12])
    model.graph.node.append(onnx.helper.make_node('Abs', ['actions'], ['value']))
    model.graph.output.insert(0, value)
    onnx.save_model(model, path)
    assert run(attached(tool, tmp_path)) == 0
    with pytest.raises(PolicyError, match=r'value tensor.*actions tensor[^|]*\n.*action\.output'):
        load(path)
    assert run([*attached(tool, tmp_path), '--set', 'action.output=actions']) == 0
    assert load(path).contract.action.output == 'actions'


@pytest.mark.parametrize('half', [True, False], ids=['fp16', 'all sizes open'])
def test_an_input_that_cannot_be_fed_is_named(tmp_path: Path, half: bool) -> None:
    """Half precision, and sizes that are all open: refused with type and shape of the port."""
    tool = TOOLS['rl_sar']()
    path = tmp_path / 'policy.onnx'
    write_network(tool, path)
    model = onnx.load(path)
    port = model.graph.input[0]
    if half:
        for node in model.graph.node:
            node.input[:] = ['fed' if name == port.name else name for name in node.input]
        cast = onnx.helper.make_node('Cast', [port.name], ['fed'], to=onnx.TensorProto.FLOAT)
        model.graph.node.insert(0, cast)
        port.type.tensor_type.elem_type = onnx.TensorProto.FLOAT16
    else:
        port.type.tensor_type.shape.dim[1].dim_param = 'width'
    onnx.save_model(model, path)
    assert run(attached(tool, tmp_path)) == 0
    words = rf'{port.name} tensor\(float16\)' if half else rf"{port.name} .*'width'"
    with pytest.raises(PolicyError, match=words):
        load(path)


def write_lstm(
    path: Path, fed: Sequence[str], kept: Sequence[str], sizes: Sequence[int | str]
) -> dict[str, Floats]:
    """Write an LSTM of 8 cells with states of some names and sizes; return its weights."""
    random, helper, kind = np.random.default_rng(7), onnx.helper, onnx.TensorProto.FLOAT
    shapes = {'w': (1, 32, 48), 'r': (1, 32, 8), 'out': (8, 12)}
    weights = {
        name: (0.3 * random.standard_normal(shape)).astype(np.float32)
        for name, shape in shapes.items()
    }
    nodes = [
        helper.make_node('Unsqueeze', ['obs', 'axis'], ['x']),
        helper.make_node('LSTM', ['x', 'w', 'r', '', '', *fed], ['y', *kept], hidden_size=8),
        helper.make_node('Squeeze', ['y', 'axes'], ['row']),
        helper.make_node('MatMul', ['row', 'out'], ['actions']),
    ]
    axes = {'axis': np.zeros(1, np.int64), 'axes': np.arange(2)}
    inputs, outputs = (
        [helper.make_tensor_value_info(name, kind, ['batch', size])]
        + [helper.make_tensor_value_info(state, kind, sizes) for state in states]
        for name, size, states in (('obs', 48, fed), ('actions', 12, kept))
    )
    made = [
        onnx.numpy_helper.from_array(array, name)
        for arrays in (weights, axes)
        for name, array in arrays.items()
    ]
    opset = [helper.make_opsetid('', 17)]
    graph = helper.make_graph(nodes, 'lstm', inputs, outputs, made)
    onnx.save_model(helper.make_model(graph, opset_imports=opset, ir_version=8), path)
    return weights


@pytest.mark.parametrize(
    ('fed', 'kept', 'sizes'),
    [
        (('h0', 'c0'), ('hn', 'cn'), (1, 1, 8)),
        (('hidden_in', 'cell_in'), ('hidden_out', 'cell_out'), (1, 'batch', 8)),
        (('h_in', 'c_in'), ('h_out', 'c_out'), ('layers', 'batch', 8)),
        (('h_in', 'c_in'), ('h_out', 'c_out'), ('layers', 'batch', 'cells')),
    ],
)
def test_the_states_of_an_lstm_may_have_any_names(
    fed: tuple[str, str], kept: tuple[str, str], sizes: tuple[int | str, ...], tmp_path: Path
) -> None:
    """Without a recurrence they are named, and a number of cells that is open is, too."""
    tool, path = TOOLS['playground'](), tmp_path / 'policy.onnx'
    weights = write_lstm(path, fed, kept, sizes)
    recurrence = dict(zip(fed, kept, strict=True))
    tool = replace(tool, settings={**tool.settings, 'recurrence': recurrence})
    assert run(attached(tool, tmp_path, left_out='recurrence')) == 0
    with pytest.raises(PolicyError, match=rf'{fed[0]} tensor.*{fed[1]} tensor'):
        load(path)
    assert run(attached(tool, tmp_path)) == 0
    if sizes[-1] != 8:
        with pytest.raises(PolicyError, match=r'initial_h must have shape \{1,1,8\}'):
            load(path)
        return
    runner = load(path).runner
    runner.reset(STAND)
    random, last, memory = np.random.default_rng(3), np.zeros(12, np.float32), list[Floats]()
    h = c = np.zeros(8, np.float32)
    for _ in range(20):
        inputs, step = recorded(random)
        targets = runner.step(inputs, PERIOD).targets
        row = tool.observe(step, last, memory)
        gate_in, gate_out, forget, cell = np.split(weights['w'][0] @ row + weights['r'][0] @ h, 4)
        c = c / (1 + np.exp(-forget)) + np.tanh(cell) / (1 + np.exp(-gate_in))
        h = np.tanh(c) / (1 + np.exp(-gate_out))
        last = h @ weights['out']
        assert targets is not None
        assert [targets[place] for place in ORDER] == pytest.approx(tool.target(last), abs=1e-4)


@pytest.mark.parametrize('order', [1, -1], ids=['base.yaml last', 'base.yaml first'])
def test_the_mapping_of_a_policy_counts_before_that_of_its_robot(
    tmp_path: Path, order: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """rl_sar reads base.yaml, then config.yaml over it; left and right would be swapped.

    The table has each value with the file or setting that it is from.
    """
    tool = TOOLS['rl_sar']()
    write_network(tool, tmp_path / 'policy.onnx')
    model, *files = attached(tool, tmp_path)
    assert run([model, *files[::order], '--set', 'action.scale=0.2']) == 0
    assert list(load(tmp_path / 'policy.onnx').contract.joint_names) == JOINTS
    lines = capsys.readouterr().out.splitlines()
    for path, value, origin in (
        ('action.scale', '0.2', 'set as action.scale'),
        ('joints', '[fl_hip_joint,', 'base.yaml'),
        ('observation.terms.ang_vel.scale', '0.25', 'config.yaml'),
    ):
        row = next(line.split() for line in lines if line.startswith(f'{path} '))
        assert row[1] == value
        assert ' '.join(row).endswith(origin)


def test_clips_are_read_as_their_tools_mean_them(tmp_path: Path) -> None:
    """unitree_rl_lab's scale_first is undone by one scale for a term; Isaac's go by patterns."""
    terms = {'base_ang_vel': {'scale': [0.2] * 3, 'clip': [-1.0, 1.0], 'scale_first': True}}
    deploy = {'step_dt': 0.02, 'actions': {'JointPositionAction': {'scale': 0.25}}}
    path = tmp_path / 'deploy.yaml'
    path.write_text(yaml.safe_dump({**deploy, 'observations': terms}))
    term = read_contract_file(path).values['observation']['terms']['base_ang_vel']
    assert term['clip'] == pytest.approx([-5.0, 5.0])
    terms['base_ang_vel']['scale'] = [0.2, 0.2, 0.4]
    path.write_text(yaml.safe_dump({**deploy, 'observations': terms}))
    with pytest.raises(PolicyError, match='one scale above 0'):
        read_contract_file(path)
    text = TOOLS['isaac_env']().files['env.yaml'].replace(
        'use_default_offset: true\n    clip: null',
        'use_default_offset: true\n    clip:\n      .*_hip_joint: [-0.1, 0.1]',
    )  # fmt: skip
    (tmp_path / 'env.yaml').write_text(text)
    action = read_contract_file(tmp_path / 'env.yaml', JOINTS).values['action']
    found = [clip == [-0.1, 0.1] for clip in action['target_clip']]
    assert found == ['hip' in name for name in JOINTS], 'one that none matches is not clipped'


GOOD = {
    'joints': list(ROBOT.names),
    'default_positions': list(STAND),
    'period': 0.02,
    'observation': {
        'terms': {
            'gyro': {'source': 'angular_velocity', 'frame': 'base'},
            'q': {'source': 'joint_positions', 'relative': True, 'history': 2},
        },
        'history': {'layout': 'per_term', 'newest': 'last'},
    },
    'action': {'scale': 0.25},
}


@pytest.mark.parametrize(
    ('path', 'value', 'words'),
    [
        ('joints', None, 'open: joints: names'),
        ('default_positions', [0.0], 'default_positions [0.0] must be a number or 12'),
        ('period', 'soon', "period 'soon' must be a number"),
        ('period', 20, 'within 0.0001 to 10'),
        ('observation.terms', {}, 'open: observation.terms'),
        ('observation.terms.gyro.source', 'gyroscope', 'must be one of'),
        ('observation.terms.gyro.frame', None, 'observation.terms.gyro.frame: frame'),
        ('observation.terms.gyro.scale', [1.0, 2.0], 'must be a number or 3'),
        ('observation.terms.gyro.scale', float('nan'), 'must be a number'),
        ('observation.terms.gyro.clip', [1.0, -1.0], 'lowest and highest'),
        ('observation.terms.gyro.scal', 1.0, "gyro.scal; did you mean 'scale'"),
        ('observation.terms.q.history', 2.5, 'a whole number'),
        ('observation.terms.q.history', 0, 'within 1 to 200'),
        ('observation.history.layout', None, 'observation.history.layout: per_term'),
        ('observation.history.newest', 'middle', 'one of first, last'),
        ('observation.history.layout', 'frames', 'the same history of all terms'),
        ('observation.terms.feet', {'source': 'foot_contacts'}, 'feet.feet: links of the feet'),
        ('observation.terms.feet', {'source': 'foot_contacts', 'feet': ['fl_foot']},
         'each of fl_foot, fr_foot, bl_foot, br_foot once'),
        ('observation.terms.scan', {'source': 'height_scan', 'values': [0.0]}, 'scan.flat: true'),
        ('observation.terms.scan', {'source': 'height_scan', 'values': 0.0, 'flat': False},
         'flat False must be true'),
        ('observation.terms.bias', {'source': 'constant'}, 'bias.values: what'),
        ('action.scale', None, 'open: action.scale'),
        ('action.clip', 'wide', 'two numbers'),
        ('actions', {}, "unknown key actions; did you mean 'action'"),
        ('gains', 'stiff', 'gains must be a mapping'),
        ('commands', {'z': [0.0, 1.0]}, 'unknown key commands.z'),
    ],
)  # fmt: skip
def test_a_senseless_contract_is_refused(path: str, value: object, words: str) -> None:
    """With path, value, and what it should be."""
    good = document_of(GOOD, 'test')
    assert build_contract(read_yaml(good.to_yaml(), 'again')) == build_contract(good)
    values = value
    for key in reversed(path.split('.')):
        values = {key: values}
    changed = document_of(values, 'test').over(document_of(GOOD, 'test'))  # type: ignore[arg-type]
    if path == 'observation.terms':
        changed = document_of(GOOD | {'observation': {'terms': value}}, 'test')
    with pytest.raises(PolicyError) as refusal:
        build_contract(changed)
    assert words in refusal.value.reason


def test_a_contract_of_nothing_asks_for_everything() -> None:
    """At once."""
    with pytest.raises(PolicyError) as refusal:
        build_contract(read_metadata({}))
    assert 'mjlab' not in refusal.value.reason
    assert 'attach_contract MODEL [FILE ...] --set' in refusal.value.reason
    for key in ('joints', 'default_positions', 'period', 'observation.terms', 'action.scale'):
        assert f'{key}: ' in refusal.value.reason


BAD_HISTORY = """{sim: {}, decimation: 4,
observations: {policy: {a: {func: "b:c", history_length: x}}}}"""


@pytest.mark.parametrize(
    ('name', 'text', 'words'),
    [
        ('other.yaml', 'a: 1\nb: 2', 'its keys: a, b'),
        ('other.yaml', '- 1', 'not a mapping'),
        ('other.yaml', 'a: [', 'not valid YAML'),
        *(
            ('config.yaml', f'go2: {{dt: 1, joint_names: [a, b], joint_mapping: {each}}}', words)
            for each in ('[0, 7]', '[0, -1]', '[1, 1]', '[x, 0]')
            for words in (r'joint_mapping .* 0 to 1 are needed',)
        ),
        ('config.yaml', 'go2: {observations: 5}', 'config.yaml'),
        # of an older step alone: it would be taken for the newest one
        ('config.yaml', 'go2: {observations: [gravity_vec], observations_history: [1]}', 'gaps'),
        # Playground's Barkour, Go1 handstand, Spot
        *(
            ('config.json', f'{{ctrl_dt: 0.02, {more}}}', 'than the Go1 joystick')
            for more in (
                'obs_noise: 0.05',
                'Kp: 35.0, noise_config: {scales: {linvel: 0.1}}',
                'history_len: 3, noise_config: {}, pert_config: {}, command_config: {}',
            )
        ),
        ('env.yaml', BAD_HISTORY, 'env.yaml'),
    ],
)
def test_a_file_of_no_tool_or_form_is_refused(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    """With the file, or what is looked for; no other error leaves."""
    (tmp_path / name).write_text(text)
    with pytest.raises(PolicyError, match=words):
        build_contract(read_contract_file(tmp_path / name))


def test_a_contract_beside_the_policy_counts(tmp_path: Path) -> None:
    """The parameter names a file of any tool; it fills what the model does not have."""
    tool = TOOLS['mjlab']()
    write_network(tool, tmp_path / 'policy.onnx')
    side = tmp_path / 'contract.yaml'
    side.write_text('period: 0.02\nobservation: {terms: {base_ang_vel: {frame: yawed}}}\n')
    options = PolicyOptions(contract=side)
    loaded = load_policy(tmp_path / 'policy.onnx', ROBOT, STAND, options, PERIOD)
    assert loaded.contract.terms[0].frame.value == 'yawed'
    assert 'observation.terms.base_ang_vel.frame: yawed  (contract.yaml)' in str(loaded)
    assert np.allclose(loaded.contract.default_positions, DEFAULTS)


def test_commands_stay_within_the_training(tmp_path: Path) -> None:
    """What is faster than the policy was trained for is clamped, as its table says."""
    loaded = load(made(TOOLS['playground'](), tmp_path, '--set', 'commands={x: [-0.1, 0.2]}'))
    assert 'clamped to x -0.1 to 0.2' in str(loaded.report)
    situation, _ = recorded(np.random.default_rng(3))
    observed = loaded.runner.observe(replace(situation, velocity=Velocity(0.5, 0.4, -0.3)))[0]
    assert observed[-3:] == pytest.approx([0.2, 0.4, -0.3])


def test_a_policy_needs_a_velocity_that_somebody_estimates(tmp_path: Path) -> None:
    """The mode is refused while there is none, and while it is old."""
    controller = controlled(TOOLS['playground'](), tmp_path)
    state = RobotState(JointSample(STAND, (0.0,) * 12), UPRIGHT, 0.9)
    controller.step(state, PERIOD)
    assert 'linear velocity' in controller.set_mode('policy').message
    controller.step(replace(state, linear_velocity=(math.nan, 0.0, 0.0)), PERIOD)
    assert not controller.set_mode('policy').accepted
    controller.step(replace(state, linear_velocity=(0.1, 0.0, 0.0)), PERIOD)
    assert controller.set_mode('policy').accepted
    for _ in range(20):
        controller.step(state, PERIOD)
    assert not controller.set_mode('policy').accepted


@pytest.mark.parametrize(
    ('setting', 'error', 'accepted', 'warned'),
    [
        ('kind=test', 0.5, True, False),  # the file says 1.5 rad/s to either side, uniformly
        ('kind=test', 1.4, False, False),
        ('observation.terms.joint_vel.noise=1.4', 1.42, True, False),  # the period jitters
        ('observation.terms.joint_vel.noise=null', 1.4, True, True),
    ],
)
def test_joint_velocities_are_as_exact_as_in_the_training(
    tmp_path: Path, setting: str, error: float, accepted: bool, warned: bool
) -> None:
    """What is less exact is refused; of a training that says nothing, one warning shows."""
    controller = controlled(TOOLS['playground'](), tmp_path, '--set', setting)
    joints = JointSample(STAND, (0.0,) * 12, velocity_error=error)
    state = RobotState(joints, UPRIGHT, 0.9, linear_velocity=(0.0, 0.0, 0.0))
    controller.step(state, PERIOD)
    answer = controller.set_mode('policy')
    assert answer.accepted is accepted
    assert accepted or 'error of 1.40 rad/s rms, and with 0.866 rad/s the policy' in answer.message
    logged: list[str] = []
    for _ in range(300):
        logged += [event.text for event in controller.step(state, PERIOD).events]
    assert sum('nothing says with what noise' in text for text in logged) == warned


def test_contacts_of_feet_are_observed_in_the_order_of_the_training(tmp_path: Path) -> None:
    """The order is asked for; the mode is refused while nobody publishes them, or not lately."""
    tool = TOOLS['mjlab']()
    terms = 'observation_terms_'
    more = {
        'observation_names': 'foot_contact', f'{terms}scale': '1.000', f'{terms}clip': '-inf;inf',
        f'{terms}history_length': '0.000', f'{terms}flatten_history_dim': '1.000',
    }  # fmt: skip
    order = ['fr_foot', 'fl_foot', 'br_foot', 'bl_foot']
    tool = replace(
        tool,
        metadata={k: f'{v},{more[k]}' if k in more else v for k, v in tool.metadata.items()},
        settings={**tool.settings, 'observation.terms.foot_contact.feet': order},
        width=tool.width + 4,
    )
    controller = controlled(tool, tmp_path)
    state = RobotState(JointSample(STAND, (0.0,) * 12), UPRIGHT, 0.9)
    controller.step(state, PERIOD)
    assert '/foot_contacts' in controller.set_mode('policy').message
    for _ in range(150):
        output = controller.step(replace(state, foot_contacts=(True, False, False, True)), PERIOD)
        controller.set_mode('policy')
    assert output.asked is not None
    assert output.asked.answer.observation is not None
    assert output.asked.answer.observation[0, -4:].tolist() == [0.0, 1.0, 1.0, 0.0]
    for _ in range(20):
        controller.step(state, PERIOD)
    assert not controller.set_mode('policy').accepted


@pytest.mark.parametrize(
    ('old', 'new', 'words'),
    [
        ('JointPositionAction', 'JointVelocityAction', 'is a JointVelocityAction'),
        ('JointPositionAction', 'RelativeJointPositionAction', 'is a RelativeJointPosition'),
        ('joint_ids: null', 'joint_ids: [1, 0]', 'an order of joints of its own'),
    ],
)
def test_other_actions_than_positions_of_all_joints_are_refused(
    tmp_path: Path, old: str, new: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Velocities and differences have the same width; nothing else would show it."""
    tool = TOOLS['isaac_deploy']()
    write_network(tool, tmp_path / 'policy.onnx')
    changed = {name: text.replace(old, new) for name, text in tool.files.items()}
    assert run(attached(replace(tool, files=changed), tmp_path)) == 1
    assert words in capsys.readouterr().out


def test_a_model_is_written_whole_and_beside_its_weights(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Elsewhere its weights would be missing; nothing is written then."""
    tool, other = TOOLS['rl_sar'](), tmp_path / 'other' / 'policy.onnx'
    other.parent.mkdir()
    write_network(tool, tmp_path / 'policy.onnx', external=True)
    arguments = attached(tool, tmp_path)
    assert run([*arguments, '--output', str(other)]) == 1
    assert 'write --output beside them' in capsys.readouterr().out
    assert not any(other.parent.iterdir())
    assert run([*arguments, '--output', str(tmp_path / 'new.onnx')]) == 0
    assert load(tmp_path / 'new.onnx').contract.width == tool.width


def test_a_shipped_policy_keeps_its_contract(capsys: pytest.CaptureFixture[str]) -> None:
    """Its name prints the contract; writing one needs another file."""
    assert run(['trot_ppo', '--dry-run']) == 0
    assert run(['trot_ppo']) == 1
    assert 'is shipped' in capsys.readouterr().out


def test_a_contract_that_was_written_warns_of_three_decimals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As often as it is written, until the scale is set."""
    tool, key = TOOLS['mjlab'](), 'observation_terms_scale'
    scales = tool.metadata[key].replace('0.050', '0.004')
    write_network(replace(tool, metadata={**tool.metadata, key: scales}), tmp_path / 'policy.onnx')
    for last in ([], [], ['--set', 'observation.terms.joint_vel.scale=0.004']):
        assert run([*attached(tool, tmp_path), *last]) == 0
        for text in (capsys.readouterr().out, str(load(tmp_path / 'policy.onnx').report)):
            assert ('0.004, with three decimals' in text) == (not last)


@pytest.mark.parametrize(
    ('name', 'setting', 'reason'),
    [
        ('playground', 'action.offset=0.0', 'targets standing'),
        ('playground', 'action.offset=2.5', 'targets standing'),
        ('playground', 'recurrence={h_in: actions}', r'recurrence\.h_in'),
        ('rl_sar', 'action.target_clip=[3.0, 4.0]', 'outside of its soft limits'),
        ('rl_sar', f'default_positions={OTHER_ZERO}', 'feet in the default pose'),
    ],
)
def test_what_leads_the_legs_elsewhere_is_refused(
    name: str, setting: str, reason: str, tmp_path: Path
) -> None:
    """Complete as the contract is: offsets, recurrent states of other sizes, clips off limits."""
    path = made(TOOLS[name](), tmp_path, '--set', setting)
    with pytest.raises(PolicyError, match=reason):
        load(path)


def test_a_whole_list_of_terms_has_its_own_order() -> None:
    """Terms that all have their source replace those of the file; single keys do not."""
    terms = {'q': {'source': 'joint_positions', 'relative': True}, 'down': {'source': 'gravity'}}
    for given, names in ((terms, ['q', 'down']), ({'gyro': {'frame': 'yawed'}}, ['gyro', 'q'])):
        side = document_of({'observation': {'terms': given}}, 'side')
        contract = build_contract(side.over(document_of(GOOD, 'file')))
        assert [term.name for term in contract.terms] == names
