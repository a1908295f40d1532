# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of ``controller_node``: meaning, ranges, and the settings made from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rclpy.node import Node

from node_runner import declare_thread_priority, ParameterReader, refuse_misspelt
from quad_description import DescriptionError, PRESETS, Quadruped, quadruped, robot_urdf
from robot_primitives import setting, settings_of, switch

from ..gait.parameters import Gait, GaitParameters, ServoModel
from ..policy.options import PolicyOptions
from ..states.modes import StateParameters

THREAD_PRIORITY = 45  # SCHED_FIFO: below that of the driver, which it waits for


@dataclass(frozen=True, slots=True)
class NodeSettings:
    """All parameters."""

    robot: Quadruped
    tuning: GaitParameters  # of the gait
    states: StateParameters  # limits of states, watchdogs and protections
    policy_options: PolicyOptions  # how the policy is run
    # positions of the joints that are no legs' in [rad]; empty leaves them
    arm_pose: tuple[float, ...]
    thread_priority: int  # SCHED_FIFO priority of the thread of its loop; 0 requests none
    gait: Gait = switch(Gait.TROT, 'gait to begin with')  # noqa: RUF009  # a field
    policy: str = switch('', 'ONNX file that the mode policy follows, or name of a shipped one')
    policy_dry_run: bool = switch(
        False, 'the policy runs, but its targets go to joint_command_shadow only'
    )
    record: str = switch('', 'folder for recordings of all steps (MCAP); empty: none')
    diagnostics_period: float = setting(1.0, 0.1, 60.0, 'period [s]')


def declare_parameters(node: Node) -> NodeSettings:
    """Declare all parameters of the node and read them.

    Raises:
        node_runner.ParameterError: A parameter is misspelt, of the wrong type or out of range.
        ParameterError: Parameters contradict each other; the message names the remedy.
        DescriptionError: The robot description is not that of a quadruped.
    """
    read = ParameterReader(node)
    settings = read.settings(
        NodeSettings,
        robot=_robot(read),
        tuning=ParameterReader(node, fixed=False).settings(GaitParameters, servo=_servo(read)),
        states=_states(read),
        policy_options=_policy_options(read),
        arm_pose=read.numbers(
            'arm_pose', 'positions of the joints of the arm when it stands [rad]'
        ),
        thread_priority=declare_thread_priority(read, THREAD_PRIORITY),
    )
    refuse_misspelt(node)
    return settings


def changed_gait(gait: GaitParameters, values: Mapping[str, object]) -> GaitParameters | None:
    """Apply the gait parameters among some values; None if there are none.

    Args:
        values: Values of some parameters by their names.

    Raises:
        ParameterError: A value is invalid.
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


def _servo(read: ParameterReader) -> ServoModel | None:
    enabled = read.flag(
        'servo_compensation.enabled', default=True, meaning='set-points ahead of soft servos'
    )
    model = read.settings(ServoModel, 'servo_compensation.')
    return model if enabled else None


def _policy_options(read: ParameterReader) -> PolicyOptions:
    contract = read.text(
        'policy_contract', '', 'YAML file with the contract of the policy, or what its file lacks'
    )
    path = Path(contract).expanduser() if contract else None
    return read.settings(PolicyOptions, 'policy_', contract=path)


def _states(read: ParameterReader) -> StateParameters:
    default = StateParameters()
    rate = read.number('loop_rate', 1.0 / default.period, (25.0, 200.0), 'steps a second [Hz]')
    return read.settings(StateParameters, period=1.0 / rate)
