# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo motion_node``: jogging and trajectories of an arm on one motion core.

``motion_master``, ``motion_controller``, ``servo_node`` and ``trajectory_controller`` are the same
program with its parameters set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
import sys
import threading

from rclpy.node import Node

from arm_model import ArmError, ModelError
from node_runner import ParameterReader, run_program

from .group_motion import Offers
from .topics_backend import serve_topics

NAME = 'motion_node'

SWITCH_INTERVAL = 0.0005  # how long a busy callback may keep the interpreter from the cycle in [s]

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


class Backend(Enum):
    """Where the drives are."""

    CANOPEN = 'canopen'
    TOPICS = 'topics'


@dataclass(frozen=True, slots=True)
class Program:
    """What is run."""

    backend: Backend  # where the drives are
    offers: Offers = field(default_factory=Offers)  # what is offered to clients


def _declared() -> Program:
    """Return what the parameters of the node ``motion_node`` say; it is there for them only."""
    node = Node(NAME)
    try:
        read = ParameterReader(node)
        backend = read.text(
            'backend', Backend.CANOPEN.value, 'canopen, or topics: drives elsewhere'
        )
        offers = Offers(
            read.flag('jogging', 'offer servo_node', default=True),
            read.flag('trajectories', 'offer the trajectory controller', default=True),
        )
    finally:
        node.destroy_node()
    known = [each.value for each in Backend]
    if backend not in known:
        raise ModelError(f'backend {backend!r}: choose one of {", ".join(known)}')
    if not (offers.jogging or offers.trajectories):
        raise ModelError('jogging and trajectories are both false: nothing would move the arm')
    return Program(Backend(backend), offers)


def _serve(stop: threading.Event, program: Program) -> None:
    if program.backend is Backend.TOPICS:
        serve_topics(stop, program.offers)
        return
    from .canopen_backend import serve_canopen  # arm_canopen is not loaded where it has no use

    serve_canopen(stop, program.offers)


def run_motion(name: str, program: Program | None, args: Sequence[str] | None = None) -> int:
    """Run until Ctrl-C or SIGTERM.

    Args:
        program: What is run; None for what parameters say.
        args: ROS arguments; None takes those of the process.

    Returns:
        Exit code: 0, or 1 when parameters, the arm or the bus are refused.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    return run_program(
        name,
        lambda stop: _serve(stop, program or _declared()),
        ArmError,
        args=args,
        help_text=HELP,
    )


def main() -> int:
    """Run what the parameters say."""
    return run_motion(NAME, None)


def motion_master() -> int:
    """Run motion_node with drives on a CAN bus."""
    return run_motion('master', Program(Backend.CANOPEN))


def motion_controller() -> int:
    """Run motion_node with drives elsewhere."""
    return run_motion('motion_controller', Program(Backend.TOPICS))


def trajectory_controller() -> int:
    """Run motion_node with drives elsewhere, for trajectories only: beside a servo, or none."""
    return run_motion('trajectory_controller', Program(Backend.TOPICS, Offers(jogging=False)))


def servo_node() -> int:
    """Run motion_node with drives elsewhere, for jogging only: beside ros2_control."""
    return run_motion('servo_node', Program(Backend.TOPICS, Offers(trajectories=False)))


if __name__ == '__main__':
    sys.exit(main())
