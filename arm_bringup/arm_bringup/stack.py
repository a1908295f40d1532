# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The processes of an arm: which there are, with which arguments, and when each is ready."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from process_supervisor import (
    Executable,
    FindExecutable,
    node_process,
    ProcessSpec,
    RosOptions,
    state_publisher,
    view_process,
)

from .robots import Robot

MASTER = Executable('arm_canopen', 'master')
"""What runs the bus unless something else is asked for."""
MOTION_NODE = Executable('arm_servo', 'motion_node')
"""Trajectories and jogging: with the master in it, or for drives that another process has."""
PLANNER = Executable('arm_planning', 'move_group')
"""Motions among obstacles, for clients of MoveIt."""
SLAVES = Executable('canopen_sim', 'fake_slaves')  # simulated drives

MASTER_FIRST, THEN_LISTENERS, SLAVES_LAST = range(3)
"""Order of stopping: the master disables the drives, so they must still be there."""


@dataclass(frozen=True, slots=True)
class Stack:
    """What is to be brought up.

    Attributes:
        robot: The robot.
        bus: Name of the CAN bus.
        simulate: With simulated slaves for all devices of the bus.
        start_positions: Where simulated drives stand at power-on that do not at 0 [rad or m].
        ready_timeout: How long each process may take to be ready in [s].
        master: What runs the bus.
        master_parameters: ROS parameters for it beside the usual ones.
        master_files: Parameter files for it beside the usual one.
        ros: Options of all nodes.
        plan: With move_group, which has the files of the master.
        view: With the page on which the robot is seen.
    """

    robot: Robot
    bus: str
    simulate: bool
    start_positions: Mapping[str, float] = field(default_factory=dict)
    ready_timeout: float = 30.0
    master: Executable = MASTER
    master_parameters: Mapping[str, str] = field(default_factory=dict)
    master_files: Sequence[Path] = ()
    ros: RosOptions = field(default_factory=RosOptions)
    plan: bool = False
    view: bool = False


def arm_processes(stack: Stack, parameters: Path, find: FindExecutable) -> list[ProcessSpec]:
    """Return the processes that make an arm; they start side by side.

    Raises:
        StartError: An executable is missing.
    """
    make = partial(node_process, find=find, ros=stack.ros, ready_timeout=stack.ready_timeout)
    bus = {'bus_config': str(stack.robot.bus_config), 'can_interface_name': stack.bus}
    own = {'backend': 'canopen'} if stack.master == MOTION_NODE else {'robot_joint_states': 'true'}
    files = (parameters, *stack.master_files)
    processes: list[ProcessSpec | None] = []
    if stack.simulate:
        places = {f'positions.{name}': f'{at!r}' for name, at in stack.start_positions.items()}
        processes.append(make('slaves', SLAVES, values={**bus, **places}, stop_order=SLAVES_LAST))
    processes += [
        make(
            'master',
            stack.master,
            values={**bus, **own, **stack.master_parameters},
            parameters=files,
            stop_order=MASTER_FIRST,
        ),
        state_publisher(  # without it the arm moves without TF
            parameters, find, stack.ros, ready_timeout=stack.ready_timeout, order=THEN_LISTENERS
        ),
    ]
    if stack.plan:
        processes.append(make('planner', PLANNER, parameters=files, stop_order=THEN_LISTENERS))
    if stack.view:
        timeout = stack.ready_timeout
        view = view_process(find, stack.ros, ready_timeout=timeout, stop_order=THEN_LISTENERS)
        processes.append(view)
    return [spec for spec in processes if spec is not None]


def controller_process(
    files: Sequence[Path],
    parameters: Path,
    ready_timeout: float,
    find: FindExecutable,
    ros: RosOptions,
) -> ProcessSpec:
    """Return the process that moves drives of another process; that one makes /tf, too.

    Raises:
        StartError: An executable is missing.
    """
    return node_process(
        'controller',
        MOTION_NODE,
        find,
        ros,
        values={'backend': 'topics'},
        parameters=(parameters, *files),
        ready_timeout=ready_timeout,
        stop_order=MASTER_FIRST,
    )
