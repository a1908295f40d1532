# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The processes of a quadruped: which there are, with which arguments, and when each is ready."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from process_supervisor import (
    Executable,
    FindExecutable,
    LOG_FORMAT,
    node_argv,
    ProcessSpec,
    RosOptions,
    StartError,
    state_publisher,
    view_process,
)

CONTROLLER_FIRST, THEN_BRIDGE, SIMULATOR_LAST = range(3)
"""Order of stopping: the controller, then the bridge, then the robot."""


@dataclass(frozen=True, slots=True)
class Stack:
    """What is to be brought up.

    Attributes:
        port: Serial port of the robot; with ``simulate`` a link to the simulated one's.
        preset: Preset of the description.
        simulate: With a simulated robot at the port.
        servo: Servo model of the simulated robot, as fake_xgo takes it; None for its default.
        arm: The robot has its arm.
        gait: Gait of the controller.
        policy: Policy that the controller loads; None for the geometric gait alone.
        protocol: Serial protocol, ``v2`` or ``v1``; ``auto`` asks the robot.
        calibration: Parameter file that ``quad_hardware calibrate`` has written.
        ready_timeout: How long each process may take to be ready in [s].
        ros: Options of all nodes.
        record: Folder in which the controller records its runs; None for none.
        view: With the page on which the robot is seen.
    """

    port: str
    preset: str = 'lite'
    simulate: bool = False
    servo: str | None = None
    arm: bool = False
    gait: str = 'trot'
    policy: Path | None = None
    protocol: str = 'auto'
    calibration: Path | None = None
    ready_timeout: float = 30.0
    ros: RosOptions = field(default_factory=RosOptions)
    record: Path | None = None
    view: bool = False


def quad_processes(stack: Stack, parameters: Path, find: FindExecutable) -> list[ProcessSpec]:
    """Return which processes make a quadruped.

    Args:
        stack: What is to be brought up.
        parameters: A ROS parameter file with the robot description.
        find: Finds executables.

    Returns:
        The processes; they start side by side.

    Raises:
        StartError: An executable is missing.
    """
    processes = [
        _bridge(stack, parameters, find),
        _controller(stack, parameters, find),
        _state_publisher(stack, parameters, find),
    ]
    if stack.simulate:
        processes.insert(0, _simulator(stack, find))
    viewer = _viewer(stack, find)
    return processes if viewer is None else [*processes, viewer]


def _viewer(stack: Stack, find: FindExecutable) -> ProcessSpec | None:
    if not stack.view:
        return None
    return view_process(find, stack.ros, ready_timeout=stack.ready_timeout, stop_order=THEN_BRIDGE)


def _simulator(stack: Stack, find: FindExecutable) -> ProcessSpec:
    executable = Executable('quad_sim', 'fake_xgo')
    program, *ros_arguments = node_argv(executable, find, ros=stack.ros)
    spoken = 'both' if stack.protocol == 'auto' else stack.protocol
    options = ['--link', stack.port, '--preset', stack.preset, '--protocol', spoken]
    if stack.arm:
        options.append('--arm')
    if stack.servo is not None:
        options += ['--servo', stack.servo]
    return ProcessSpec(
        name='fake_xgo',
        argv=(program, *options, *ros_arguments),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=stack.ready_timeout,
        stop_order=SIMULATOR_LAST,
    )


def _bridge(stack: Stack, parameters: Path, find: FindExecutable) -> ProcessSpec:
    values = {'port': stack.port, 'protocol': stack.protocol, **stack.ros.frame_parameters}
    if stack.simulate:  # its IMU is where the description has it
        values |= {'imu.mounting_checked': 'true', 'imu.rates_checked': 'true'}
    executable = Executable('quad_hardware', 'hardware_node')
    files = (parameters,) if stack.calibration is None else (parameters, stack.calibration)
    return ProcessSpec(
        name='hardware',
        argv=node_argv(executable, find, values, files, stack.ros),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=stack.ready_timeout,
        stop_order=THEN_BRIDGE,
    )


def _controller(stack: Stack, parameters: Path, find: FindExecutable) -> ProcessSpec:
    values = {'gait': stack.gait}
    if stack.policy is not None:
        values['policy'] = str(stack.policy)
    if stack.record is not None:
        values['record'] = str(stack.record)
    if stack.simulate:  # nobody is hurt, and nothing breaks
        values['get_up_swings'] = 'true'
    executable = Executable('quad_controller', 'controller_node')
    return ProcessSpec(
        name='controller',
        argv=node_argv(executable, find, values, (parameters,), stack.ros),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=stack.ready_timeout,
        stop_order=CONTROLLER_FIRST,
    )


def _state_publisher(stack: Stack, parameters: Path, find: FindExecutable) -> ProcessSpec:
    spec = state_publisher(
        parameters, find, stack.ros, ready_timeout=stack.ready_timeout, order=THEN_BRIDGE
    )
    if spec is None:
        raise StartError(
            'no robot_state_publisher; source env.sh in this shell again; '
            'if that does not help, run make build before it'
        )
    return spec
