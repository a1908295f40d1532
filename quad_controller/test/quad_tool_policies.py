# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Policies as five training tools export them, and how each tool makes its own observation.

The observations are written from what the tools do, one after the other and without anything of
this package, so that they are an independent reference.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
from onnx import helper, numpy_helper, TensorProto
import yaml

from quad_gait_rig import joined, ROBOT, STAND

Floats = npt.NDArray[np.float32]
# an order that is neither ours nor alphabetical, as simulators have them: joint by joint
JOINTS = [f'{leg}_{joint}_joint' for joint in ('hip', 'thigh', 'calf')
          for leg in ('fl', 'fr', 'bl', 'br')]  # fmt: skip
DEFAULTS = np.array([round(STAND[ROBOT.names.index(name)], 3) for name in JOINTS], np.float32)


@dataclass
class Step:
    """What a tool's simulation knows in one step, in the tool's order of joints."""

    linear: Floats
    angular: Floats
    gravity: Floats
    command: Floats
    positions: Floats
    velocities: Floats


@dataclass
class Tool:
    """A tool: what it writes beside a policy, and how it observes.

    Attributes:
        width: Of the whole observation.
        observe: Its observation, from this step, the last action and what it keeps in a list.
        files: Names and texts of its files.
        metadata: What it writes into the ONNX file.
        settings: What its files leave open.
        last: What it remembers of an answer.
        target: What it sends for an answer.
        hidden: Width of a recurrent state; 0 for none.
        decimation: Steps of 20 ms for one of the policy.
    """

    width: int
    observe: Callable[[Step, Floats, list[Floats]], Floats]
    files: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, object] = field(default_factory=dict)
    last: Callable[[Floats], Floats] = lambda action: action
    target: Callable[[Floats], Floats] = lambda action: DEFAULTS + np.float32(0.25) * action
    hidden: int = 0
    decimation: int = 1


def mjlab() -> Tool:
    """mjlab: scales and clips of terms, a history of two of them, in the metadata."""

    def observe(step: Step, last: Floats, memory: list[Floats]) -> Floats:
        memory.append(np.clip(step.positions - DEFAULTS, -0.5, 0.5) * np.float32(2.0))
        past = memory[-3:]
        past = [past[0]] * (3 - len(past)) + past  # the buffer begins with its first entry
        terms = [step.angular * np.float32(0.2), step.gravity, step.command, *past,
                 step.velocities * np.float32(0.05), last]  # fmt: skip
        return np.concatenate(terms)

    return Tool(
        metadata={
            'joint_names': joined([f'robot/{name}' for name in JOINTS]),
            'default_joint_pos': joined(DEFAULTS.tolist()),
            'joint_stiffness': joined([10.0] * 12),
            'joint_damping': joined([0.25] * 12),
            'action_scale': joined([0.25] * 12),
            'command_names': 'twist',
            'observation_names': (
                'base_ang_vel,projected_gravity,command,joint_pos,joint_vel,actions'
            ),
            'observation_terms_scale': joined([0.2, 1.0, 1.0, 2.0])
            + f',{";".join(["0.050"] * 12)},1.000',
            'observation_terms_clip': '-inf;inf,-inf;inf,-inf;inf,-0.500;0.500,-inf;inf,-inf;inf',
            'observation_terms_history_length': joined([0, 0, 0, 3, 0, 0]),
            'observation_terms_flatten_history_dim': joined([1] * 6),
        },
        settings={'period': 0.02, 'observation.terms.base_ang_vel.frame': 'base'},
        width=3 + 3 + 3 + 3 * 12 + 12 + 12,
        observe=observe,
    )


def isaac_deploy() -> Tool:
    """unitree_rl_lab's deploy.yaml: every term has five steps, targets are clipped."""
    names = ('base_ang_vel', 'projected_gravity', 'velocity_commands', 'joint_pos_rel',
             'joint_vel_rel', 'last_action')  # fmt: skip
    scales: dict[str, Any] = {'base_ang_vel': [0.2] * 3, 'joint_vel_rel': [0.05] * 12}
    low, high = (DEFAULTS - np.float32(0.2)), (DEFAULTS + np.float32(0.2))

    slowest, fastest = np.array([[-0.5, -0.3, -1.0], [1.0, 0.3, 1.0]], np.float32)

    def observe(step: Step, last: Floats, memory: list[Floats]) -> Floats:
        command = np.clip(step.command, slowest, fastest)
        terms = [step.angular * np.float32(0.2), step.gravity, command,
                 step.positions - DEFAULTS,
                 np.clip(step.velocities, -3.0, 3.0) * np.float32(0.05), last]  # fmt: skip
        memory.append(np.concatenate(terms))
        past = memory[-5:]
        past = [past[0]] * (5 - len(past)) + past
        columns = np.cumsum([0, 3, 3, 3, 12, 12, 12])
        return np.concatenate([row[a:b] for a, b in pairwise(columns) for row in past])

    deploy = {
        'joint_ids_map': list(range(12)),
        'step_dt': 0.02,
        'stiffness': [25.0] * 12,
        'damping': [0.5] * 12,
        'default_joint_pos': DEFAULTS.tolist(),
        'commands': {'base_velocity': {'ranges': {
            'lin_vel_x': [-0.5, 1.0], 'lin_vel_y': [-0.3, 0.3], 'ang_vel_z': [-1.0, 1.0],
            'heading': None}}},
        'actions': {'JointPositionAction': {
            'clip': [[float(a), float(b)] for a, b in zip(low, high, strict=True)],
            'joint_names': ['.*'], 'scale': [0.25] * 12, 'offset': DEFAULTS.tolist(),
            'joint_ids': None}},
        'observations': {
            name: {
                'params': {},
                'clip': [-3.0, 3.0] if name == 'joint_vel_rel' else None,
                'scale': scales.get(name, [1.0] * (12 if 'joint' in name or 'act' in name else 3)),
                'history_length': 5,
            }
            for name in names
        },
    }  # fmt: skip
    return Tool(
        files={'deploy.yaml': yaml.safe_dump(deploy, sort_keys=False)},
        settings={'joints': JOINTS},
        width=5 * 45,
        observe=observe,
        target=lambda action: np.clip(DEFAULTS + np.float32(0.25) * action, low, high),
    )


def isaac_env() -> Tool:
    """Isaac Lab's params/env.yaml: patterns of joints, tags of Python, 25 Hz, a height scan."""

    def observe(step: Step, last: Floats, _memory: list[Floats]) -> Floats:
        terms = [step.linear * np.float32(2.0), step.angular, step.gravity, step.command,
                 step.positions - DEFAULTS, step.velocities * np.float32(0.05), last,
                 np.full(6, -0.4, np.float32)]  # fmt: skip
        return np.concatenate(terms)

    pairs = zip(JOINTS, DEFAULTS.tolist(), strict=True)
    defaults = ''.join(f'        {name}: {value!r}\n' for name, value in pairs)
    function = 'isaaclab.envs.mdp.observations:'

    def term(name: str, kind: str, scale: str = 'null', clip: str = 'null') -> str:
        return (
            f'    {name}:\n      func: {function}{kind}\n      params: {{}}\n'
            f'      modifiers: null\n      noise: null\n      clip: {clip}\n      scale: {scale}\n'
            '      history_length: 0\n      flatten_history_dim: true\n'
        )

    text = (
        'viewer:\n  eye: !!python/tuple\n  - 7.5\n  - 7.5\n  - 7.5\n'
        'sim:\n  dt: 0.005\n  render_interval: 8\ndecimation: 8\n'
        'scene:\n  robot:\n    class_type: isaaclab.assets.articulation:Articulation\n'
        '    init_state:\n      joint_pos:\n' + defaults + 'observations:\n  policy:\n'
        '    concatenate_terms: true\n    history_length: null\n    flatten_history_dim: true\n'
        + term('base_lin_vel', 'base_lin_vel', '2.0')
        + term('base_ang_vel', 'base_ang_vel')
        + term('projected_gravity', 'projected_gravity')
        + term('velocity_commands', 'generated_commands')
        + term('joint_pos', 'joint_pos_rel')
        + term('joint_vel', 'joint_vel_rel', '0.05')
        + term('actions', 'last_action')
        + term('height_scan', 'height_scan', clip='!!python/tuple\n      - -1.0\n      - 1.0')
        + 'actions:\n  joint_pos:\n'
        '    class_type: isaaclab.envs.mdp.actions.joint_actions:JointPositionAction\n'
        '    joint_names:\n    - .*\n    scale:\n      .*_hip_joint: 0.125\n'
        '      ^(?!.*_hip_joint).*: 0.25\n    offset: 0.0\n    preserve_order: false\n'
        '    use_default_offset: true\n    clip: null\n'
        'commands:\n  base_velocity:\n    ranges:\n      lin_vel_x: !!python/tuple\n'
        '      - -1.0\n      - 1.0\n      heading: null\n'
    )
    scale = np.array([0.125 if 'hip' in name else 0.25 for name in JOINTS], np.float32)
    return Tool(
        files={'env.yaml': text},
        settings={
            'joints': JOINTS,
            'observation.terms.height_scan.flat': True,
            'observation.terms.height_scan.values': [-0.4] * 6,
        },
        width=48 + 6,
        observe=observe,
        target=lambda action: DEFAULTS + scale * action,
        decimation=2,
    )


def rl_sar() -> Tool:
    """rl_sar (and legged_gym): stacked frames, newest first, clips of all; two files."""
    low, high = np.full(12, -0.6, np.float32), np.full(12, 0.6, np.float32)

    def observe(step: Step, last: Floats, memory: list[Floats]) -> Floats:
        scale = np.array([2.0, 2.0, 0.25], np.float32)
        terms = [step.command * scale, step.angular * np.float32(0.25), step.gravity,
                 step.positions - DEFAULTS, step.velocities * np.float32(0.05), last]  # fmt: skip
        memory.append(np.clip(np.concatenate(terms), -0.8, 0.8))
        return np.concatenate([*reversed(memory[-6:]), *[np.zeros_like(memory[0])] * 6][:6])

    order = [ROBOT.names.index(name) for name in JOINTS]
    config = {
        'xgo/walk': {
            'model_name': 'policy.onnx', 'num_observations': 45,
            'observations': [
                'commands', 'ang_vel', 'gravity_vec', 'dof_pos', 'dof_vel', 'actions'],
            'observations_history': [0, 1, 2, 3, 4, 5], 'observations_history_priority': 'time',
            'clip_obs': 0.8,
            'clip_actions_lower': low.tolist(), 'clip_actions_upper': high.tolist(),
            'rl_kp': [20.0] * 12, 'rl_kd': [0.5] * 12, 'action_scale': [0.25] * 12,
            'lin_vel_scale': 2.0, 'ang_vel_scale': 0.25,
            'dof_pos_scale': 1.0, 'dof_vel_scale': 0.05, 'commands_scale': [2.0, 2.0, 0.25],
            'default_dof_pos': DEFAULTS.tolist(), 'joint_mapping': order,
        }
    }  # fmt: skip
    base = {'xgo': {'dt': 0.005, 'decimation': 4, 'joint_names': list(ROBOT.names),
                    'joint_mapping': list(range(12))}}  # fmt: skip
    return Tool(
        files={'config.yaml': yaml.safe_dump(config), 'base.yaml': yaml.safe_dump(base)},
        width=6 * 45,
        observe=observe,
        last=lambda action: np.clip(action, low, high),
        target=lambda action: DEFAULTS + np.float32(0.25) * np.clip(action, low, high),
    )


def playground() -> Tool:
    """MuJoCo Playground's Go1 joystick, with a recurrent network."""

    def observe(step: Step, last: Floats, _memory: list[Floats]) -> Floats:
        yawed = np.array([-1.0, -1.0, 1.0], np.float32)
        terms = [step.linear * yawed, step.angular * yawed, step.gravity,
                 step.positions - DEFAULTS, step.velocities, last, step.command]  # fmt: skip
        return np.concatenate(terms)

    config = {'ctrl_dt': 0.02, 'sim_dt': 0.004, 'Kp': 10.0, 'Kd': 0.25, 'action_scale': 0.25,
              'history_len': 1, 'command_config': {}, 'pert_config': {},
              'noise_config': {'level': 1.0, 'scales': {'joint_vel': 1.5}}}  # fmt: skip
    return Tool(
        files={'config.json': json.dumps(config)},
        settings={
            'joints': JOINTS,
            'default_positions': DEFAULTS.tolist(),
            'observation.terms.linvel.frame': 'yawed',
            'observation.terms.gyro.frame': 'yawed',
            'recurrence': {'h_in': 'h_out'},
        },
        width=48,
        observe=observe,
        hidden=8,
    )


TOOLS = {make.__name__: make for make in (mjlab, isaac_deploy, isaac_env, rl_sar, playground)}


def write_network(tool: Tool, path: Path, *, external: bool = False) -> tuple[Floats, Floats]:
    """Write an ONNX file: ``action = tanh(obs W + h U)``, where h is tanh of itself and obs.

    Returns:
        W and U; they lie in a side file if the file is external.
    """
    random = np.random.default_rng(7)
    inner = tool.hidden or 1
    weight = (random.standard_normal((tool.width, 12)) * 0.1).astype(np.float32)
    state = (random.standard_normal((inner, 12)) * 0.3).astype(np.float32)
    tensors = {'weight': weight}
    value = helper.make_tensor_value_info
    inputs = [value('obs', TensorProto.FLOAT, ['batch', tool.width])]
    outputs = [value('actions', TensorProto.FLOAT, ['batch', 12])]
    nodes = [helper.make_node('MatMul', ['obs', 'weight'], ['sum'])]
    if tool.hidden:
        tensors |= {'state': state, 'mix': weight[:, :inner].copy()}
        inputs.append(value('h_in', TensorProto.FLOAT, [1, inner]))
        outputs.append(value('h_out', TensorProto.FLOAT, [1, inner]))
        nodes += [
            helper.make_node('MatMul', ['h_in', 'state'], ['remembered']),
            helper.make_node('Add', ['sum', 'remembered'], ['both']),
            helper.make_node('MatMul', ['obs', 'mix'], ['mixed']),
            helper.make_node('Add', ['mixed', 'h_in'], ['next']),
            helper.make_node('Tanh', ['next'], ['h_out']),
        ]
    nodes.append(helper.make_node('Tanh', ['both' if tool.hidden else 'sum'], ['actions']))
    graph = helper.make_graph(
        nodes, 'policy', inputs, outputs,
        [numpy_helper.from_array(array, name) for name, array in tensors.items()],
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid('', 17)], ir_version=8)
    helper.set_model_props(model, dict(tool.metadata))
    onnx.save_model(
        model, str(path), save_as_external_data=external, location=f'{path.name}.data',
        size_threshold=0,
    )  # fmt: skip
    return weight, state


class ReferencePolicy:
    """A tool's policy as the tool runs it: its observation, its network in numpy, its targets."""

    def __init__(self, tool: Tool, weight: Floats, state: Floats) -> None:
        """Begin anew."""
        self._tool, self._weight, self._state = tool, weight, state
        self._last = np.zeros(12, np.float32)
        self._hidden = np.zeros(max(tool.hidden, 1), np.float32)
        self._memory: list[Floats] = []

    def step(self, step: Step) -> Floats:
        """Return the targets."""
        row = self._tool.observe(step, self._last, self._memory)
        action = np.tanh(row @ self._weight + self._hidden @ self._state)
        if self._tool.hidden:
            self._hidden = np.tanh(row @ self._weight[:, : self._tool.hidden] + self._hidden)
        self._last = self._tool.last(action)
        return self._tool.target(action)
