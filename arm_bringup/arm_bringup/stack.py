# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The processes of an arm: which there are, with which arguments, and when each is ready."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from process_supervisor import (
    Executable,
    FindExecutable,
    LOG_FORMAT,
    node_argv,
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
    """Say which processes make an arm.

    Args:
        stack: What is to be brought up.
        parameters: The file of :func:`process_supervisor.write_parameters`.
        find: Finds executables.

    Returns:
        The processes; they start side by side.

    Raises:
        StartError: An executable is missing.
    """
    bus = {'bus_config': str(stack.robot.bus_config), 'can_interface_name': stack.bus}
    everything = [
        _slaves(stack, bus, find),
        _master(stack, bus, parameters, find),
        state_publisher(  # without it the arm moves without TF
            parameters, find, stack.ros, ready_timeout=stack.ready_timeout, order=THEN_LISTENERS
        ),
        _planner(stack, parameters, find),
        _viewer(stack, find),
    ]
    return [spec for spec in everything if spec is not None]


def _slaves(stack: Stack, bus: Mapping[str, str], find: FindExecutable) -> ProcessSpec | None:
    if not stack.simulate:
        return None
    places = {f'positions.{name}': f'{at!r}' for name, at in stack.start_positions.items()}
    executable = Executable('canopen_sim', 'fake_slaves')
    return ProcessSpec(
        name='slaves',
        argv=node_argv(executable, find, {**bus, **places}, ros=stack.ros),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=stack.ready_timeout,
        stop_order=SLAVES_LAST,
    )


def _master(
    stack: Stack, bus: Mapping[str, str], parameters: Path, find: FindExecutable
) -> ProcessSpec:
    own = {'robot_joint_states': 'true'}
    if stack.master == MOTION_NODE:
        own = {'backend': 'canopen'}
    return ProcessSpec(
        name='master',
        argv=node_argv(
            stack.master,
            find,
            {**bus, **own, **stack.master_parameters},
            (parameters, *stack.master_files),
            stack.ros,
        ),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=stack.ready_timeout,
        stop_order=MASTER_FIRST,
    )


def _planner(stack: Stack, parameters: Path, find: FindExecutable) -> ProcessSpec | None:
    if not stack.plan:
        return None
    return ProcessSpec(
        name='planner',
        argv=node_argv(PLANNER, find, {}, (parameters, *stack.master_files), stack.ros),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=stack.ready_timeout,
        stop_order=THEN_LISTENERS,
    )


def _viewer(stack: Stack, find: FindExecutable) -> ProcessSpec | None:
    if not stack.view:
        return None
    return view_process(
        find, stack.ros, ready_timeout=stack.ready_timeout, stop_order=THEN_LISTENERS
    )


def controller_process(
    files: Sequence[Path],
    parameters: Path,
    ready_timeout: float,
    find: FindExecutable,
    ros: RosOptions,
) -> ProcessSpec:
    """Say which process moves drives that another process has; that one makes /tf, too.

    Args:
        files: Parameter files of the nodes that move the arm.
        parameters: The file of :func:`process_supervisor.write_parameters`.
        ready_timeout: How long it may take to be ready in [s].
        find: Finds executables.
        ros: Options of all nodes.

    Raises:
        StartError: An executable is missing.
    """
    return ProcessSpec(
        name='controller',
        argv=node_argv(MOTION_NODE, find, {'backend': 'topics'}, (parameters, *files), ros),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=ready_timeout,
        stop_order=MASTER_FIRST,
    )
