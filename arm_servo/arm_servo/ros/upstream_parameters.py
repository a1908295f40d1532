# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of MoveIt and ros2_control that configurations contain and that change nothing here.

They are accepted, so that a configuration works as it is, and named once in the log. ``*`` stands
for the names of joints, groups, planners and whatever else belongs to one of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase

from rclpy.node import Node

from node_runner import refuse_misspelt

SERVO = (
    'active_subgroup',
    'butterworth_filter_coeff',
    'check_octomap_collisions',
    'collision_check_rate',
    'command_out_topic',
    'command_out_type',
    'ee_frame_name',
    'halt_all_joints_in_cartesian_mode',
    'halt_all_joints_in_joint_mode',
    'hard_stop_singularity_threshold',
    'is_primary_planning_scene_monitor',
    'joint_topic',
    'leaving_singularity_threshold_multiplier',
    'low_latency_mode',
    'lower_singularity_threshold',
    'max_expected_latency',
    'monitored_planning_scene_topic',
    'num_outgoing_halt_msgs_to_publish',
    'planning_frame',
    'pose_tracking.angular_tolerance',
    'pose_tracking.linear_tolerance',
    'publish_joint_accelerations',
    'publish_joint_positions',
    'publish_joint_velocities',
    'publish_period',
    'scene_collision_proximity_threshold',
    'singularity_step_scale',
    'smoothing_filter_plugin_name',
    'thread_priority',
    'use_gazebo',
    'use_smoothing',
)
"""Of moveit_servo, in Jazzy and Humble; those of the loop count where the arm is elsewhere."""

TRAJECTORY_CONTROLLER = (
    'allow_integration_in_goal_trajectories',
    'allow_trajectory_replacement',
    'cmd_timeout',
    'command_joints',
    'constraints.*.max_deceleration_on_cancel',
    'constraints.decelerate_on_cancel',
    'gains.*',
    'interpolate_from_desired_state',
    'open_loop_control',
    'positions_upsampling.*',
    'set_last_command_interface_value_as_state_on_activation',
    'speed_scaling.command_interface',
    'speed_scaling.state_interface',
)
"""Of joint_trajectory_controller."""

BROADCASTER = (
    'extra_joints',
    'interfaces',
    'joints',
    'map_interface_to_joint_state.*',
    'use_local_topics',
    'use_urdf_to_filter',
)
"""Of joint_state_broadcaster."""

MOVE_GROUP = (
    'allow_trajectory_execution',
    'capabilities',
    'default_planning_pipeline',
    'disable_capabilities',
    'jiggle_fraction',
    'max_range',
    'moveit_controller_manager',
    'moveit_manage_controllers',
    'moveit_simple_controller_manager.*',
    'octomap_*',
    'ompl.*',
    'pilz_industrial_motion_planner.*',
    'planning_group_name',
    'planning_pipelines',
    'planning_pipelines.*',
    'planning_scene_monitor_options.*',
    'publish_geometry_updates',
    'publish_planning_scene',
    'publish_planning_scene_hz',
    'publish_robot_description',
    'publish_robot_description_semantic',
    'publish_state_updates',
    'publish_transforms_updates',
    'robot_description_kinematics.*',
    'robot_description_name',
    'robot_description_planning.*',
    'sensors',
    'sensors.*',
    'trajectory_execution.*',
    'update_period',
)
"""Of move_group, its planners and its kinematics, which launch files give to every node."""

CONTROLLER_MANAGER = ('*.params_file', '*.type', 'lock_memory', 'thread_priority', 'update_rate')
"""Of controller_manager."""

WITHOUT_EFFECT = (
    *(f'moveit_servo.{name}' for name in SERVO),
    *TRAJECTORY_CONTROLLER,
    *BROADCASTER,
    *MOVE_GROUP,
    *CONTROLLER_MANAGER,
)


def is_upstream(name: str) -> bool:
    """Whether a parameter is one of MoveIt's or ros2_control's."""
    return any(fnmatchcase(name, pattern) for pattern in WITHOUT_EFFECT)


def check_names(node: Node) -> None:
    """Refuse misspelt parameters of a node, and log those that change nothing here.

    Raises:
        ParameterError: A name looks like one that there is.
    """
    unknown = refuse_misspelt(node, is_upstream)
    if unknown:
        node.get_logger().info(f'accepted, without effect here: {_listed(unknown)}')


def _listed(names: Iterable[str]) -> str:
    return ', '.join(sorted(names))
