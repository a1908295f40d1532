# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The processes of a quadruped: which there are, with which arguments, and when each is ready."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from process_supervisor import (
    Executable,
    FindExecutable,
    node_process,
    ProcessSpec,
    RosOptions,
    StartError,
    state_publisher,
    view_process,
)

CONTROLLER_FIRST, THEN_BRIDGE, SIMULATOR_LAST = range(3)
"""Order of stopping: the controller, then the bridge, then the robot."""
SIMULATOR = Executable('quad_sim', 'fake_xgo')
BRIDGE = Executable('quad_hardware', 'hardware_node')
CONTROLLER = Executable('quad_controller', 'controller_node')


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
    """Return the processes that make a quadruped; they start side by side.

    Raises:
        StartError: An executable is missing.
    """
    ros, timeout = stack.ros, stack.ready_timeout
    make = partial(node_process, find=find, ros=ros, ready_timeout=timeout)
    calibration = () if stack.calibration is None else (stack.calibration,)
    publisher = state_publisher(parameters, find, ros, ready_timeout=timeout, order=THEN_BRIDGE)
    if publisher is None:
        raise StartError(
            'no robot_state_publisher; source env.sh in this shell again; '
            'if that does not help, run make build before it'
        )
    processes: list[ProcessSpec | None] = [
        make(
            'hardware',
            BRIDGE,
            values=_bridge_parameters(stack),
            parameters=(parameters, *calibration),
            stop_order=THEN_BRIDGE,
        ),
        make(
            'controller',
            CONTROLLER,
            values=_controller_parameters(stack),
            parameters=(parameters,),
            stop_order=CONTROLLER_FIRST,
        ),
        publisher,
    ]
    if stack.simulate:
        options = _simulator_options(stack)
        simulator = make('fake_xgo', SIMULATOR, options=options, stop_order=SIMULATOR_LAST)
        processes.insert(0, simulator)
    if stack.view:
        view = view_process(find, ros, ready_timeout=timeout, stop_order=THEN_BRIDGE)
        processes.append(view)
    return [spec for spec in processes if spec is not None]


def _simulator_options(stack: Stack) -> list[str]:
    spoken = 'both' if stack.protocol == 'auto' else stack.protocol
    options = ['--link', stack.port, '--preset', stack.preset, '--protocol', spoken]
    if stack.arm:
        options.append('--arm')
    if stack.servo is not None:
        options += ['--servo', stack.servo]
    return options


def _bridge_parameters(stack: Stack) -> dict[str, str]:
    values = {'port': stack.port, 'protocol': stack.protocol, **stack.ros.frame_parameters}
    if stack.simulate:  # its IMU is where the description has it
        values |= {'imu.mounting_checked': 'true', 'imu.rates_checked': 'true'}
    return values


def _controller_parameters(stack: Stack) -> dict[str, str]:
    values = {'gait': stack.gait}
    if stack.policy is not None:
        values['policy'] = str(stack.policy)
    if stack.record is not None:
        values['record'] = str(stack.record)
    if stack.simulate:  # no person is hurt, and nothing breaks
        values['get_up_swings'] = 'true'
    return values
