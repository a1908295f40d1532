# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo motion_controller``: trajectories and jogging for drives elsewhere.

On one motion core, so that they hand over to each other as in motion_master.
"""

from __future__ import annotations

from collections.abc import Sequence
import sys

from arm_model.ros import declare_robot, same_robot

from ..core.settings import CoreSettings
from ..io.motion_thread import MotionThread
from ..io.topic_output import ARRAY, declare_output
from .controller_manager import declare_manager
from .servo.node import Servo
from .servo.parameters import declare_servo
from .standalone import declare_loop, keep_drives, make_loop, MakeNode, run_standalone
from .trajectory.parameters import declare_trajectory
from .trajectory_program import offer_trajectories, OUTPUT_TOPIC


def _build(make_node: MakeNode) -> MotionThread:
    manager = make_node('controller_manager')
    model = declare_robot(manager)
    name, _ = declare_manager(manager, model)
    node, servo = make_node(name), make_node('servo_node')
    same_robot(servo, model)
    trajectory = declare_trajectory(node, model.joints)
    jogging = declare_servo(servo, model)
    loop = declare_loop(node, '')
    output = declare_output(node, '', OUTPUT_TOPIC, ARRAY)
    settings = CoreSettings(
        jogging.settings,
        trajectory.execution,
        jogging.timeout,
        jogging.clearance,
        check_self_collision=trajectory.check,
    )
    gateway, thread = make_loop(node, model, settings, loop, output)
    Servo(servo, gateway, jogging, keep_drives)
    offer_trajectories(manager, node, gateway, trajectory, loop.period)
    return thread


def main(args: Sequence[str] | None = None) -> int:
    """Run until Ctrl-C.

    Args:
        args: ROS arguments; None takes those of the process.
    """
    return run_standalone('motion_controller', _build, args)


if __name__ == '__main__':
    sys.exit(main())
