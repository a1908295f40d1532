# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of ``controller_node``: what they mean, their ranges, and what they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

from rclpy.node import Node

from node_runner import declare_thread_priority, ParameterReader, refuse_misspelt
from quad_description import DescriptionError, PRESETS, Quadruped, quadruped, robot_urdf

from ..exceptions import settings_of
from ..gait.parameters import Gait, GaitParameters, ServoModel
from ..gait.velocity import BodyLimits
from ..policy.options import PolicyOptions
from ..states.modes import StateParameters

THREAD_PRIORITY = 45  # SCHED_FIFO: below that of the driver, which it waits for


@dataclass(frozen=True, slots=True)
class NodeSettings:
    """All parameters."""

    robot: Quadruped
    gait: GaitParameters  # tuning of the gait
    first_gait: Gait  # gait to begin with
    states: StateParameters  # limits of states, watchdogs and protections
    # positions of the joints that are no legs' in [rad]; empty leaves them
    arm_pose: tuple[float, ...]
    policy: str  # path of an ONNX file, or name of one of :func:`shipped_policies`; empty for none
    policy_options: PolicyOptions  # how it is run
    policy_dry_run: bool  # whether the policy is only watched
    record: str  # folder in which each run is recorded; empty for none
    diagnostics_period: float  # in [s]
    thread_priority: int  # SCHED_FIFO priority of the thread of its loop; 0 requests none


def declare_parameters(node: Node) -> NodeSettings:
    """Declare all parameters of the node and read them.

    Raises:
        node_runner.ParameterError: One is misspelt, of another kind or out of its range.
        ParameterError: They do not make sense together; the message names the remedy.
        DescriptionError: The robot description is no quadruped's.
    """
    read = ParameterReader(node)
    settings = NodeSettings(
        robot=_robot(read),
        gait=_gait(node, read),
        first_gait=read.choice(
            'gait', Gait.TROT.value, {gait.value: gait for gait in Gait}, 'gait to begin with'
        ),
        states=_states(read),
        arm_pose=read.numbers(
            'arm_pose', 'positions of the joints of the arm when it stands [rad]'
        ),
        policy=read.text(
            'policy', '', 'ONNX file that the mode policy follows, or name of one that is shipped'
        ),
        policy_options=_policy_options(read),
        policy_dry_run=read.flag(
            'policy_dry_run',
            default=False,
            meaning='the policy runs, but its targets go to joint_command_shadow only',
        ),
        record=read.text('record', '', 'folder for recordings of all steps (MCAP); empty: none'),
        diagnostics_period=read.number('diagnostics_period', 1.0, (0.1, 60.0), 'period [s]'),
        thread_priority=declare_thread_priority(read, THREAD_PRIORITY),
    )
    refuse_misspelt(node)
    return settings


def changed_gait(gait: GaitParameters, values: Mapping[str, object]) -> GaitParameters | None:
    """Return a tuning with the parameters that concern it; None when there are none.

    Args:
        values: Values of some parameters by their names.

    Raises:
        ParameterError: A value does not make sense.
    """
    changes: dict[str, Any] = {
        name: values[name] for name, *_ in settings_of(gait) if name in values
    }
    return replace(gait, **changes) if changes else None


def _robot(read: ParameterReader) -> Quadruped:
    text = read.text('robot_description', '', 'URDF as XML text; empty: of quad_description')
    presets = {name: name for name in PRESETS}
    preset = read.choice('preset', 'lite', presets, 'robot of quad_description')
    arm = read.flag('arm', default=False, meaning='the robot of quad_description has its arm')
    try:
        return quadruped(text or robot_urdf(preset, arm=arm))
    except DescriptionError as error:
        raise DescriptionError(f'robot_description: {error}') from error


def _read(read: ParameterReader, kind: type, prefix: str = '') -> dict[str, Any]:
    """Declare and read all settings of a dataclass; the period is set as a rate."""
    values: dict[str, Any] = {}
    for name, default, span, meaning in settings_of(kind):
        path = prefix + name
        if isinstance(default, bool):
            values[name] = read.flag(path, meaning, default=default)
        elif isinstance(default, Enum):
            choices = {choice.value: choice for choice in type(default)}
            values[name] = read.choice(path, default.value, choices, meaning)
        elif name != 'period':
            values[name] = read.number(path, default, span, meaning)
    return values


def _gait(node: Node, read: ParameterReader) -> GaitParameters:
    values = _read(ParameterReader(node, fixed=False), GaitParameters)
    return GaitParameters(**values, servo=_servo(read), body=BodyLimits())


def _servo(read: ParameterReader) -> ServoModel | None:
    enabled = read.flag(
        'servo_compensation.enabled', default=True, meaning='set-points ahead of soft servos'
    )
    values = _read(read, ServoModel, 'servo_compensation.')
    return ServoModel(**values) if enabled else None


def _policy_options(read: ParameterReader) -> PolicyOptions:
    contract = read.text(
        'policy_contract', '', 'YAML file with the contract of the policy, or what its file lacks'
    )
    values = _read(read, PolicyOptions, 'policy_')
    return PolicyOptions(Path(contract).expanduser() if contract else None, **values)


def _states(read: ParameterReader) -> StateParameters:
    default = StateParameters()
    rate = read.number('loop_rate', 1.0 / default.period, (10.0, 200.0), 'steps a second [Hz]')
    return StateParameters(period=1.0 / rate, **_read(read, StateParameters))
