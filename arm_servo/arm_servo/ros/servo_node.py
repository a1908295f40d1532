# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_node``: jogging of an arm whose controller is elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
import sys

from arm_model.ros import declare_robot
from node_runner import ParameterReader

from ..core.settings import CoreSettings
from ..io.motion_thread import MotionThread
from ..io.topic_output import declare_output, TRAJECTORY
from .servo.node import Servo
from .servo.parameters import declare_servo, PREFIX
from .standalone import declare_loop, keep_drives, make_loop, MakeNode, run_standalone
from .trajectory.parameters import declare_check


def _build(make_node: MakeNode) -> MotionThread:
    node = make_node('servo_node')
    model = declare_robot(node)
    servo = declare_servo(node, model)
    topic = f'{model.group}_controller/joint_trajectory'
    output = declare_output(node, PREFIX, topic, TRAJECTORY)
    settings = CoreSettings(
        servo=servo.settings,
        timeout=servo.timeout,
        clearance=servo.clearance,
        check_self_collision=declare_check(ParameterReader(node, PREFIX)),
    )
    gateway, thread = make_loop(node, model, settings, declare_loop(node, PREFIX), output)
    Servo(node, gateway, servo, keep_drives)
    return thread


def main(args: Sequence[str] | None = None) -> int:
    """Run until Ctrl-C.

    Args:
        args: ROS arguments; None takes those of the process.
    """
    return run_standalone('servo_node', _build, args)


if __name__ == '__main__':
    sys.exit(main())
