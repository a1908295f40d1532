# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo motion_node``: jogging and trajectories of an arm on one motion core.

``motion_master``, ``motion_controller``, ``servo_node`` and ``trajectory_controller`` are the same
program with its parameters set.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import sys
import threading

from rclpy.node import Node

from arm_model import ArmError, ModelError
from node_runner import ParameterReader, run_program

from .group_motion import Offers
from .topics_backend import serve_topics

NAME = 'motion_node'

SWITCH_INTERVAL = 0.0005  # longest time a busy callback may delay the cycle in [s]

HELP = """\
Jog an arm and send it trajectories: moveit_servo's and joint_trajectory_controller's interfaces.

usage: ros2 run arm_servo motion_node --ros-args -p backend:=BACKEND [-p NAME:=VALUE ...]

examples:
  ros2 run arm_servo motion_node --ros-args -p bus_config:=bus.yml --params-file arm.yaml
  ros2 run arm_servo motion_node --ros-args -p backend:=topics --params-file arm.yaml

parameters:
  backend       canopen: the drives of a bus.yml, in the process of its master (default);
                topics: drives elsewhere, by /joint_states and a topic for set-points
  jogging       offer /servo_node (default true)
  trajectories  offer /<group>_controller and /controller_manager (default true)
  with backend canopen those of `ros2 run arm_canopen master --help`, too

One program moves an arm: do not run two of motion_node, motion_master, motion_controller,
servo_node and trajectory_controller for the same arm.
"""


def _serve_canopen(stop: threading.Event, offers: Offers) -> None:
    from .canopen_backend import serve_canopen  # load arm_canopen only if needed

    serve_canopen(stop, offers)


Serve = Callable[[threading.Event, Offers], None]  # runs a back end until stopped
BACKENDS: Mapping[str, Serve] = {'canopen': _serve_canopen, 'topics': serve_topics}


def _serve_declared(stop: threading.Event, _: Offers) -> None:
    """Run as set by the parameters of node ``motion_node``, which exists only for them."""
    node = Node(NAME)
    try:
        read = ParameterReader(node)
        serve = read.choice('backend', 'canopen', BACKENDS, 'where the drives are')
        offers = Offers(
            read.flag('jogging', 'offer servo_node', default=True),
            read.flag('trajectories', 'offer the trajectory controller', default=True),
        )
    finally:
        node.destroy_node()
    if not (offers.jogging or offers.trajectories):
        raise ModelError('jogging and trajectories are both false: nothing would move the arm')
    serve(stop, offers)


def _run(name: str, serve: Serve, *, jogging: bool = True, trajectories: bool = True) -> int:
    """Run until Ctrl-C or SIGTERM.

    Returns:
        Exit code: 0, or 1 if parameters, the arm or the bus are refused.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    offers = Offers(jogging, trajectories)
    return run_program(name, lambda stop: serve(stop, offers), ArmError, help_text=HELP)


def main() -> int:
    """Run as set by the parameters."""
    return _run(NAME, _serve_declared)


def motion_master() -> int:
    """Run motion_node with drives on a CAN bus."""
    return _run('master', _serve_canopen)


def motion_controller() -> int:
    """Run motion_node with drives in another process."""
    return _run('motion_controller', serve_topics)


def trajectory_controller() -> int:
    """Run motion_node for trajectories only, with drives in another process."""
    return _run('trajectory_controller', serve_topics, jogging=False)


def servo_node() -> int:
    """Run motion_node for jogging only, with drives in another process (ros2_control)."""
    return _run('servo_node', serve_topics, trajectories=False)


if __name__ == '__main__':
    sys.exit(main())
