# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of hardware_node that make no sense are refused at the start."""

from __future__ import annotations

import re

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node

from node_runner import ParameterError
from quad_hardware import HardwareError
from quad_hardware.nodes.parameters import declare_parameters, NodeSettings

WRONG = {
    'protokoll:=old': "did you mean 'protocol'",
    'protocol:=v3': "protocol is 'v3': it must be auto, vendor, v1 or v2",
    'joints.fl_hip_joint.sign:=0': 'sign 0 is neither 1 nor -1',
    'joints.fl_calf_joint.offset:=6.9': 'correct joints.fl_calf_joint.offset',
    'robot_description:=<robot/>': 'has no <link>',
    'robot_description:=none': 'no XML',
    'max_joint_speed:=fast': "max_joint_speed is 'fast': it must be a number",
    'max_joint_speed:=500.0': 'max_joint_speed is 500.0: it must be 0.1 to 100.0',
    'publish_tf:=3': 'publish_tf is 3: it must be true or false',
}


def read(argument: str) -> NodeSettings:
    """What the node understands of a parameter on its command line."""
    context = Context()
    rclpy.init(args=['--ros-args', '-p', argument], context=context)
    node = Node('hardware_node', context=context, enable_rosout=False)
    try:
        return declare_parameters(node)
    finally:
        node.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.shutdown(context=context)


@pytest.mark.parametrize(('argument', 'reason'), WRONG.items())
def test_a_wrong_parameter_is_refused(argument: str, reason: str) -> None:
    """The message names the value and the remedy."""
    with pytest.raises((ParameterError, HardwareError), match=re.escape(reason)):
        read(argument)
