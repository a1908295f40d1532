# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameter files of MoveIt and ros2_control load as they are: every name, and its default."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import core_commands
from isolation import Isolation
from model_robots import FOLDER, ready, robot, texts
import pytest
import rclpy
from rclpy.node import Node
import yaml

from arm_model import ModelError
from arm_model.ros import GroupModels
from arm_servo import check_parameters, CoreSettings, MotionCore
from arm_servo.ros.group_motion import Offers
from arm_servo.ros.parameter_check import check_names, ParameterSheet
from arm_servo.ros.servo.parameters import declare_servo, ServoParameters
from arm_servo.ros.topics_backend import build_motion

pytestmark = pytest.mark.slow

JOINTS = list(robot('panda').joints)
GROUP = 'panda_arm'
CONTROLLER = f'{GROUP}_controller'

SERVO: dict[str, Any] = {
    'moveit_servo': {
        'thread_priority': 40,
        'publish_period': 0.01,
        'max_expected_latency': 0.1,
        'move_group_name': GROUP,
        'active_subgroup': '',
        'pose_command_in_topic': '~/pose_target_cmds',
        'cartesian_command_in_topic': '~/delta_twist_cmds',
        'joint_command_in_topic': '~/delta_joint_cmds',
        'command_in_type': 'unitless',
        'scale': {'linear': 0.4, 'rotational': 0.8, 'joint': 0.5},
        'incoming_command_timeout': 0.1,
        'apply_twist_commands_about_ee_frame': True,
        'pose_tracking': {'linear_tolerance': 0.001, 'angular_tolerance': 0.01},
        'status_topic': '~/status',
        'command_out_topic': '/panda_arm_controller/joint_trajectory',
        'command_out_type': 'trajectory_msgs/JointTrajectory',
        'publish_joint_positions': True,
        'publish_joint_velocities': True,
        'publish_joint_accelerations': False,
        'monitored_planning_scene_topic': '/planning_scene',
        'joint_topic': '/joint_states',
        'check_octomap_collisions': False,
        'is_primary_planning_scene_monitor': True,
        'use_smoothing': True,
        'smoothing_filter_plugin_name': 'online_signal_smoothing::ButterworthFilterPlugin',
        'check_collisions': True,
        'self_collision_proximity_threshold': 0.01,
        'scene_collision_proximity_threshold': 0.02,
        'collision_check_rate': 10.0,
        'lower_singularity_threshold': 17.0,
        'hard_stop_singularity_threshold': 30.0,
        'leaving_singularity_threshold_multiplier': 2.0,
        'singularity_step_scale': 0.01,
        'halt_all_joints_in_joint_mode': True,
        'halt_all_joints_in_cartesian_mode': True,
        'joint_limit_margins': [0.1],
        'override_velocity_scaling_factor': 0.0,
    },
    'update_period': 0.01,
    'planning_group_name': GROUP,
    'butterworth_filter_coeff': 1.5,
}
"""moveit_servo of Jazzy with its defaults."""

SERVO_HUMBLE: dict[str, Any] = {
    'moveit_servo': {
        'use_gazebo': False,
        'planning_frame': 'panda_link0',
        'ee_frame_name': 'panda_link8',
        'robot_link_command_frame': 'panda_link0',
        'publish_period': 0.034,
        'low_latency_mode': False,
        'num_outgoing_halt_msgs_to_publish': 4,
        'joint_limit_margin': 0.1,
    }
}

CONTROL: dict[str, Any] = {
    'joints': JOINTS,
    'command_joints': JOINTS,
    'command_interfaces': ['position'],
    'state_interfaces': ['position', 'velocity'],
    'speed_scaling': {
        'initial_scaling_factor': 1.0,
        'state_interface': '',
        'command_interface': '',
    },
    'allow_partial_joints_goal': False,
    'open_loop_control': False,
    'interpolate_from_desired_state': False,
    'allow_integration_in_goal_trajectories': False,
    'set_last_command_interface_value_as_state_on_activation': True,
    'action_monitor_rate': 20.0,
    'interpolation_method': 'splines',
    'allow_nonzero_velocity_at_trajectory_end': False,
    'cmd_timeout': 0.0,
    'gains': {
        joint: {
            'p': 0.0,
            'i': 0.0,
            'd': 0.0,
            'i_clamp': 0.0,
            'i_clamp_max': float('inf'),
            'i_clamp_min': float('-inf'),
            'ff_velocity_scale': 0.0,
            'u_clamp_max': float('inf'),
            'u_clamp_min': float('-inf'),
            'antiwindup_strategy': 'legacy',
            'tracking_time_constant': 0.0,
            'error_deadband': 0.0,
        }
        for joint in JOINTS
    },
    'constraints': {
        'stopped_velocity_tolerance': 0.01,
        'goal_time': 0.0,
        'decelerate_on_cancel': False,
        **{
            joint: {'trajectory': 0.0, 'goal': 0.0, 'max_deceleration_on_cancel': 0.0}
            for joint in JOINTS
        },
    },
}
"""joint_trajectory_controller of Jazzy with its defaults."""

BROADCASTER: dict[str, Any] = {
    'use_local_topics': False,
    'use_urdf_to_filter': True,
    'frame_id': 'base_link',
    'map_interface_to_joint_state': {
        'position': 'position',
        'velocity': 'velocity',
        'effort': 'effort',
    },
    'publish_dynamic_joint_states': True,
}

MANAGER: dict[str, Any] = {
    'update_rate': 100,
    CONTROLLER: {'type': 'joint_trajectory_controller/JointTrajectoryController'},
    'joint_state_broadcaster': {'type': 'joint_state_broadcaster/JointStateBroadcaster'},
}

MOVE_GROUP: dict[str, Any] = {
    'robot_description_name': 'robot_description',
    'robot_description_kinematics': {
        GROUP: {
            'kinematics_solver': 'kdl_kinematics_plugin/KDLKinematicsPlugin',
            'kinematics_solver_search_resolution': 0.005,
            'kinematics_solver_timeout': 0.005,
            'kinematics_solver_attempts': 3,
            'kinematics_solver_ik_links': ['panda_link8'],
            'position_only_ik': False,
        }
    },
    'robot_description_planning': {
        'default_velocity_scaling_factor': 0.1,
        'default_acceleration_scaling_factor': 0.1,
        'joint_limits': {
            joint: {
                'has_velocity_limits': True,
                'max_velocity': 2.0,
                'has_acceleration_limits': True,
                'max_acceleration': 3.0,
                'has_jerk_limits': False,
            }
            for joint in JOINTS
        },
        'cartesian_limits': {
            'max_trans_vel': 1.0,
            'max_trans_acc': 2.25,
            'max_trans_dec': -5.0,
            'max_rot_vel': 1.57,
        },
    },
    'planning_pipelines': ['ompl', 'pilz_industrial_motion_planner'],
    'default_planning_pipeline': 'ompl',
    'ompl': {
        'planning_plugins': ['ompl_interface/OMPLPlanner'],
        'request_adapters': ['default_planning_request_adapters/ResolveConstraintFrames'],
        'response_adapters': ['default_planning_response_adapters/ValidateSolution'],
        'start_state_max_bounds_error': 0.1,
        'planner_configs': {
            'RRTConnectkConfigDefault': {'type': 'geometric::RRTConnect', 'range': 0.0},
            'PRMkConfigDefault': {'type': 'geometric::PRM', 'max_nearest_neighbors': 10},
        },
        GROUP: {
            'planner_configs': ['RRTConnectkConfigDefault', 'PRMkConfigDefault'],
            'projection_evaluator': 'joints(panda_joint1,panda_joint2)',
            'longest_valid_segment_fraction': 0.005,
        },
    },
    'pilz_industrial_motion_planner': {
        'planning_plugins': ['pilz_industrial_motion_planner/CommandPlanner'],
        'default_planner_config': 'PTP',
        'capabilities': 'pilz_industrial_motion_planner/MoveGroupSequenceAction',
    },
    'moveit_controller_manager': 'moveit_simple_controller_manager/MoveItSimpleControllerManager',
    'moveit_simple_controller_manager': {
        'controller_names': [CONTROLLER],
        CONTROLLER: {
            'action_ns': 'follow_joint_trajectory',
            'type': 'FollowJointTrajectory',
            'default': True,
            'joints': JOINTS,
        },
    },
    'trajectory_execution': {
        'allowed_execution_duration_scaling': 1.2,
        'allowed_goal_duration_margin': 0.5,
        'allowed_start_tolerance': 0.01,
    },
    'publish_planning_scene': True,
    'publish_geometry_updates': True,
    'publish_state_updates': True,
    'publish_transforms_updates': True,
}
"""Of move_group and its planners; launch files hand them to the servo, too."""


class NoAliases(yaml.SafeDumper):
    """Writes what rcl reads."""

    def ignore_aliases(self, data: object) -> bool:
        """Write everything as often as it occurs."""
        return True


def document(**nodes: dict[str, Any]) -> dict[str, Any]:
    """Return a parameter file."""
    return {name: {'ros__parameters': table} for name, table in nodes.items()}


@pytest.mark.parametrize(
    'nodes',
    [
        {'servo_node': SERVO},
        {'servo_node': SERVO | MOVE_GROUP},
        {'servo_node': SERVO_HUMBLE | MOVE_GROUP},
        {
            CONTROLLER: CONTROL,
            'joint_state_broadcaster': BROADCASTER,
            'controller_manager': MANAGER,
        },
        {'/**': MOVE_GROUP},
    ],
    ids=['servo', 'servo with planners', 'servo of Humble', 'ros2_control', 'planners'],
)
def test_upstream_parameters_are_accepted(nodes: dict[str, dict[str, Any]]) -> None:
    """No node refuses one of them, in one process or in several."""
    assert check_parameters(GroupModels([robot('panda')]), document(**nodes)) == []


@pytest.mark.parametrize('offers', [Offers(trajectories=False), Offers()])
def test_nodes_begin_with_upstream_parameters(
    offers: Offers, tmp_path: Path, isolation: Isolation
) -> None:
    """The nodes themselves, with everything at once from a file, and name what has no effect."""
    urdf, srdf = texts('panda')
    arm = {
        'robot_description': urdf,
        'robot_description_semantic': srdf,
        'joint_limits': str(FOLDER / 'panda' / 'limits.yaml'),
    }
    file = tmp_path / 'parameters.yaml'
    nodes = {
        '/**': arm | MOVE_GROUP,
        'servo_node': SERVO,
        CONTROLLER: CONTROL,
        'controller_manager': MANAGER,
    }
    file.write_text(yaml.dump(document(**nodes), Dumper=NoAliases), encoding='utf-8')
    rclpy.init(args=['--ros-args', '--params-file', str(file)], domain_id=isolation.domain_id)
    made: list[Any] = []
    reported: list[str] = []

    def make_node(name: str) -> Node:
        node = Node(name)
        made.append(node)
        return node

    try:
        build_motion(make_node, offers)
        sheets: list[Any] = [
            SimpleNamespace(
                get_logger=lambda: SimpleNamespace(info=reported.append),
                get_parameters_by_prefix=node.get_parameters_by_prefix,
                has_parameter=node.has_parameter,
                _parameter_overrides=node._parameter_overrides,
            )
            for node in made
        ]
        check_names(sheets)
    finally:
        for node in made:
            node.destroy_node()
        rclpy.shutdown()
    (line,) = reported
    assert 'moveit_servo.use_smoothing' in line
    assert 'moveit_servo.check_collisions' not in line
    assert 'robot_description,' not in line


def servo_parameters(**values: object) -> ServoParameters:
    """Return what the servo reads of a configuration."""
    sheet = ParameterSheet('servo_node', {'moveit_servo': values})
    return declare_servo(cast('Node', sheet), robot('panda'))


@pytest.mark.parametrize(
    ('values', 'margin'),
    [
        ({}, 0.0),
        ({'joint_limit_margins': [0.1]}, 0.1),
        ({'joint_limit_margins': [0.3, *[0.1] * 6]}, 0.3),
        ({'joint_limit_margin': 0.2}, 0.2),
    ],
)
def test_jogs_come_to_rest_at_the_margins_of_the_joint_limits(
    values: dict[str, object], margin: float
) -> None:
    """Where moveit_servo of Jazzy and of Humble does; an arm beyond one may go back."""
    settings = CoreSettings(servo=servo_parameters(**values).settings)
    core, upper = MotionCore(robot('panda'), settings), robot('panda').limits.upper[0]
    core.reset([upper - 0.5, *ready('panda')[1:].tolist()])
    for cycle in range(300):
        core_commands.jog(core, {'panda_joint1': 1.0}, 0.01 * cycle)
        core.step(0.01 * cycle, 0.01)
    assert upper - core.state.position[0] == pytest.approx(margin, abs=2e-3)
    core.reset([upper - 0.05, *ready('panda')[1:].tolist()])
    for cycle in range(100):
        core_commands.jog(core, {'panda_joint1': -1.0}, 0.01 * cycle)
        core.step(0.01 * cycle, 0.01)
    assert core.state.position[0] < upper - 0.5


@pytest.mark.parametrize('threshold', [0.01, 0.03])
def test_jogs_come_to_rest_at_the_proximity_threshold(threshold: float) -> None:
    """In front of the other links of the arm."""
    parameters = servo_parameters(self_collision_proximity_threshold=threshold)
    core = MotionCore(
        robot('panda'), CoreSettings(servo=parameters.settings, clearance=parameters.clearance)
    )
    core.reset(ready('panda'))
    for cycle in range(400):
        core_commands.jog(core, {'panda_joint6': -1.0}, 0.01 * cycle)
        core.step(0.01 * cycle, 0.01)
    assert core.model.clearance(core.state.position) == pytest.approx(threshold, abs=2e-3)


@pytest.mark.parametrize('margins', [[0.1, 0.1], [-0.1], [3.0]])
def test_margins_that_do_not_fit_the_joints_are_refused(margins: list[float]) -> None:
    """With the joint, or the count."""
    with pytest.raises(ModelError, match='joint_limit_margins'):
        servo_parameters(joint_limit_margins=margins)
