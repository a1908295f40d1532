# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of ``controller_node``: what they mean, their ranges, and what they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rclpy.node import Node

from node_runner import declare_thread_priority, ParameterReader, refuse_misspelt
from quad_description import DescriptionError, PRESETS, Quadruped, quadruped, robot_urdf

from ..gait.body import BodyLimits
from ..gait.parameters import GaitParameters, RANGES
from ..gait.schedule import Gait
from ..gait.servo_compensation import ServoModel
from ..policy.options import GravitySource, ImuFrame, OPTION_RANGES, PolicyOptions
from ..states.parameters import STATE_RANGES, StateParameters

GAIT_MEANINGS: Mapping[str, str] = {
    'max_linear_velocity_x': 'forward and backward [m/s]',
    'max_linear_velocity_y': 'to a side [m/s]',
    'max_angular_velocity_z': 'turning [rad/s]',
    'linear_acceleration': 'change of the linear velocity [m/s2]',
    'angular_acceleration': 'change of the turning [rad/s2]',
    'nominal_height': "hip axes above the feet's centres [m]",
    'stance_widening': 'feet outwards from below the hips [m]',
    'com_x_translation': "feet ahead of the URDF's centre of mass [m]",
    'swing_height': 'lift of a foot [m]',
    'stance_depth': 'how far a standing foot is pushed down [m]',
    'stance_duration': 'how long a foot stands [s]; 0: that of the gait',
    'duty': 'share of a cycle that a foot stands; 0: that of the gait',
    'sway': 'body away from the lifted legs [m]; negative: that of the gait',
    'level_gain': 'turns the body against its measured tilt; 0: off',
    'heading_gain': 'corrects the turning by the measured heading [1/s]; 0: off',
}
STATE_MEANINGS: Mapping[str, str] = {
    'command_timeout': 'an older velocity counts as zero [s]',
    'warn_age': 'older joint states and attitudes are reported [s]',
    'hold_age': 'with older ones nothing moves on [s]',
    'fault_age': 'older ones are a fault [s]',
    'max_tilt': 'more is a fall [rad]',
    'max_turn_rate': 'a faster body is falling [rad/s]',
    'fall_time': 'how long it must be so [s]',
    'low_battery': 'charge 0 to 1 below which the robot lies down; 0: never',
    'battery_time': 'how long it must be so [s]',
    'lie_height': "hip axes above the feet's centres when it lies [m]",
    'blend_speed': 'fastest joint between two poses [rad/s]',
    'blend_time': 'shortest time between two poses [s]',
    'hold_band': 'a held joint that is further off is not pulled back [rad]',
    'setpoint_speed_ratio': 'speed of set-points per speed of joints; soft servos need 2',
}
SERVO_RANGES: Mapping[str, tuple[tuple[float, float], str]] = {
    'kp': ((0.01, 1000.0), 'stiffness of a servo [N m/rad]'),
    'damping': ((0.0, 10.0), 'velocity gain and friction of a servo [N m s/rad]'),
    'inertia': ((0.0, 1.0), 'what a joint turns [kg m2]'),
    'mass': ((0.0, 100.0), 'what the legs carry [kg]; 0: as in the URDF'),
}
POLICY_MEANINGS: Mapping[str, str] = {
    'phase_period': '[s]; 0: that of the contract',
    'soft_limits': "share of a joint's range that its targets may use",
    'low_pass': 'cut-off of a filter of its targets [Hz]; 0: none',
}

THREAD_PRIORITY = 45  # SCHED_FIFO: below that of the driver, which it waits for


@dataclass(frozen=True, slots=True)
class NodeSettings:
    """All parameters."""

    robot: Quadruped  # the robot
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
    changes: dict[str, Any] = {name: values[name] for name in GAIT_MEANINGS if name in values}
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


def _gait(node: Node, read: ParameterReader) -> GaitParameters:
    default, live = GaitParameters(), ParameterReader(node, fixed=False)
    values = {
        name: live.number(name, getattr(default, name), RANGES[name], meaning)
        for name, meaning in GAIT_MEANINGS.items()
    }
    return GaitParameters(**values, servo=_servo(read), body=BodyLimits())


def _servo(read: ParameterReader) -> ServoModel | None:
    default = ServoModel()
    enabled = read.flag(
        'servo_compensation.enabled', default=False, meaning='set-points ahead of soft servos'
    )
    values = {
        name: read.number(f'servo_compensation.{name}', getattr(default, name), span, meaning)
        for name, (span, meaning) in SERVO_RANGES.items()
    }
    return ServoModel(**values) if enabled else None


def _policy_options(read: ParameterReader) -> PolicyOptions:
    default = PolicyOptions()
    values: dict[str, Any] = {
        name: read.number(f'policy_{name}', getattr(default, name), OPTION_RANGES[name], meaning)
        for name, meaning in POLICY_MEANINGS.items()
    }
    contract = read.text(
        'policy_contract', '', 'YAML file with the contract of the policy, or what its file lacks'
    )
    return PolicyOptions(
        **values,
        contract=Path(contract).expanduser() if contract else None,
        imu_frame=read.choice(
            'policy_imu_frame',
            default.imu_frame.value,
            {frame.value: frame for frame in ImuFrame},
            'frame of the angular velocity; yawed: turned by 180 degrees; auto: that of the file',
        ),
        gravity_source=read.choice(
            'policy_gravity_source',
            default.gravity_source.value,
            {source.value: source for source in GravitySource},
            'of the direction of gravity',
        ),
        hold_missing=read.flag(
            'policy_hold_missing',
            default=False,
            meaning='joints of the policy that the robot lacks count as being at their default',
        ),
    )


def _states(read: ParameterReader) -> StateParameters:
    default = StateParameters()
    values = {
        name: read.number(name, getattr(default, name), STATE_RANGES[name], meaning)
        for name, meaning in STATE_MEANINGS.items()
    }
    rate = read.number('loop_rate', 1.0 / default.period, (10.0, 200.0), 'steps a second [Hz]')
    return StateParameters(
        **values,
        period=1.0 / rate,
        require_imu=read.flag(
            'require_imu', default=True, meaning='no leg moves without a known attitude'
        ),
        policy_fallback_walks=read.flag(
            'policy_fallback_walks',
            default=False,
            meaning='the gait walks on when a policy fails, instead of standing',
        ),
        get_up_swings=read.flag(
            'get_up_swings',
            default=False,
            meaning='the mode get_up may throw the robot off its back, at full speed',
        ),
    )
