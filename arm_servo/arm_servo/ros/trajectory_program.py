# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo trajectory_controller``: trajectories for drives that take set-points."""

from __future__ import annotations

from collections.abc import Sequence
import sys

from rclpy.node import Node

from arm_model.ros import declare_robot

from ..core.gateway import CommandGateway
from ..core.settings import CoreSettings
from ..io.motion_thread import MotionThread
from ..io.topic_output import ARRAY, declare_output
from .controller_manager import ControllerManager, declare_manager, trajectory_entry
from .standalone import declare_loop, keep_drives, make_loop, MakeNode, run_standalone
from .trajectory.controller import TrajectoryController
from .trajectory.parameters import declare_trajectory, TrajectoryParameters

OUTPUT_TOPIC = 'forward_position_controller/commands'
"""Default of command_out_topic, the name that ros2_controllers' examples use."""


def _build(make_node: MakeNode) -> MotionThread:
    manager = make_node('controller_manager')
    model = declare_robot(manager)
    name, _ = declare_manager(manager, model)
    node = make_node(name)
    trajectory = declare_trajectory(node, model.joints)
    loop = declare_loop(node, '')
    output = declare_output(node, '', OUTPUT_TOPIC, ARRAY)
    settings = CoreSettings(execution=trajectory.execution, check_self_collision=trajectory.check)
    gateway, thread = make_loop(node, model, settings, loop, output)
    offer_trajectories(manager, node, gateway, trajectory, loop.period)
    return thread


def offer_trajectories(
    manager: Node,
    node: Node,
    gateway: CommandGateway,
    parameters: TrajectoryParameters,
    period: float,
) -> None:
    """Offer trajectories, and tell the controller manager's clients of it.

    Args:
        manager: The node ``controller_manager``.
        node: The node of the trajectory controller.
        gateway: Commands to the core.
        parameters: Of the controller.
        period: Period of the cycle in [s].
    """
    controller = TrajectoryController(node, gateway, parameters, keep_drives)
    joints = gateway.model.joints
    entry = trajectory_entry(node.get_name(), joints, period, controller.set_active)
    ControllerManager(manager, [entry])


def main(args: Sequence[str] | None = None) -> int:
    """Run until Ctrl-C.

    Args:
        args: ROS arguments; None takes those of the process.
    """
    return run_standalone('trajectory_controller', _build, args)


if __name__ == '__main__':
    sys.exit(main())
