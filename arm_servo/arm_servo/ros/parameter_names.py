# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of parameters that no node has: misspelt ones, and those of other programs."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.node import Node

from node_runner import refuse_misspelt

OF_OTHERS = (
    *('publish_robot_description', 'publish_robot_description_semantic'),
    *('robot_description_name', 'publish_dynamic_joint_states'),
    *(
        f'moveit_servo.{name}'
        for name in (
            *('check_octomap_collisions', 'command_out_topic', 'command_out_type', 'joint_topic'),
            *('publish_joint_accelerations', 'scene_collision_proximity_threshold'),
        )
    ),
)
"""Parameters that have no effect on some nodes, and look like those that have."""

OF_PROGRAM = {'backend', 'jogging', 'trajectories'}  # read by motion_node before its nodes


def check_names(nodes: Sequence[Node]) -> None:
    """Refuse misspelt parameters of the nodes of a program, and log once those of none of them.

    Configurations of MoveIt and ros2_control have many of the latter, and work as they are.

    Raises:
        ParameterError: A name looks like one that there is.
    """
    unknown = {name for node in nodes for name in refuse_misspelt(node, OF_OTHERS)} - OF_PROGRAM
    unused = [name for name in unknown if not any(node.has_parameter(name) for node in nodes)]
    if unused:
        names = ', '.join(sorted(unused))
        nodes[0].get_logger().info(f'parameters without effect here: {names}')
