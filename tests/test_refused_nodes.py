# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes whose parameters are refused, made in the process of a test or of another program."""

from __future__ import annotations

from collections.abc import Callable
import threading

from isolation import Isolation
import pytest
import rclpy
from rclpy.node import Node
from urdf_reader import DescriptionError

from arm_bringup.exceptions import BringupError
from arm_canopen import CanopenError
from arm_canopen.nodes.joint_state_publisher import JointStatePublisher
from node_runner import ParameterError
from quad_controller import QuadControllerError
from quad_controller.nodes.controller_node import ControllerNode
from quad_description.display import Display
from quad_hardware import HardwareError
from quad_hardware.nodes.hardware_node import HardwareNode
from robot_viewer.nodes.robot_state_publisher import RobotStatePublisher

ERRORS = (
    ParameterError,
    BringupError,
    CanopenError,
    HardwareError,
    QuadControllerError,
    DescriptionError,
)


SPACE = '/refused'  # nodes of tests of before may still be known in the domain


def controller() -> Node:
    """Make the quadruped's controller."""
    return ControllerNode(threading.Event())


@pytest.mark.parametrize(
    ('make', 'parameter', 'reason'),
    [
        (controller, 'swing_hight:=0.03', "did you mean 'swing_height'"),
        (controller, 'arm_pose:=[0.5, 1.0]', 'arm_pose has 2 positions'),
        (HardwareNode, 'protokoll:=old', "did you mean 'protocol'"),
        (controller, 'robot_description:=none', 'robot_description: .*no XML'),
        (HardwareNode, 'robot_description:=none', 'robot_description: .*no XML'),
        (RobotStatePublisher, 'publish_frequncy:=9.0', "did you mean 'publish_frequency'"),
        (RobotStatePublisher, 'frame_prefix:=robot', 'no robot_description'),
        (RobotStatePublisher, 'robot_description:=<robot/>', '^robot_description: .*no <link>'),
        (Display, 'motion:=dance', "motion is 'dance': it must be sweep, stand"),
        (Display, 'preset:=rider', "preset is 'rider': it must be lite or mini"),
        (Display, 'rate:=1000', 'rate is 1000: it must be 1.0 to 200.0'),
        (JointStatePublisher, 'robot_description:=none', '^robot_description: .*no XML'),
        (JointStatePublisher, 'robot_descripton:=none', "did you mean 'robot_description'"),
    ],
)
def test_a_refused_node_leaves_nothing_in_the_graph(
    isolation: Isolation, make: Callable[[], Node], parameter: str, reason: str
) -> None:
    """A node that raises what its program logs in a line is gone from the process's graph."""
    args = ['--ros-args', '-p', parameter, '-r', f'__ns:={SPACE}']
    rclpy.init(args=args, domain_id=isolation.domain_id)
    watcher = Node('watcher')
    try:
        with pytest.raises(ERRORS, match=reason):
            make()
        nodes = watcher.get_node_names_and_namespaces()
        assert [name for name, space in nodes if space == SPACE] == ['watcher']
    finally:
        watcher.destroy_node()
        rclpy.shutdown()
