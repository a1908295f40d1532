# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_bringup bringup``: starts all processes of a quadruped.

Command line, shared in part with the demo and the launch file; process list; supervision. Errors::

    BringupError
    └── ArgumentError (ValueError)   the requested configuration is invalid
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass, field
from functools import partial
import os
from pathlib import Path
import sys
from typing import NamedTuple

from process_supervisor import (
    add_namespace,
    add_view,
    bring_up_place,
    exclusive,
    Executable,
    find_executable,
    FindExecutable,
    namespaced_parameters,
    node_process,
    parse_with_ros,
    ProcessSpec,
    RosOptions,
    StartError,
    state_publisher,
    supervise,
    SupervisorError,
    USAGE_ERROR,
    view_process,
    write_parameters,
)
from process_supervisor.ros_options import add_network, add_timeout, apply_network
from quad_description import PRESETS, robot_urdf
from quad_hardware.protocol import DEVELOPER, V1, V2


class BringupError(Exception):
    """Root of all errors of this package."""


class ArgumentError(BringupError, ValueError):
    """The requested configuration is invalid.

    Scenarios: a missing policy or calibration file, an unknown preset.
    """


GAITS = ('trot', 'crawl', 'pace')
"""Gaits of quad_controller."""
AUTO, VENDOR = 'auto', 'vendor'
PROTOCOLS = (AUTO, V2.name, V1.name, DEVELOPER.name, VENDOR)
"""Serial protocols of quad_hardware, and ways to choose one."""
PORT_REMEDY = 'another --port'
"""What a second bring-up on a port has to choose."""
CONTROLLER_FIRST, THEN_BRIDGE, SIMULATOR_LAST = range(3)
"""Order of stopping: the controller, then the bridge, then the robot."""
THROWING = 10.0
"""Stiffness of servos [N m/rad] that throw a robot off its back."""
SIMULATOR = Executable('quad_sim', 'fake_xgo')
BRIDGE = Executable('quad_hardware', 'hardware_node')
CONTROLLER = Executable('quad_controller', 'controller_node')


@dataclass(frozen=True, slots=True)
class Stack:
    """Configuration of a bring-up."""

    port: str  # serial port of the robot; with ``simulate`` a link to the simulated one's
    preset: str = 'lite'  # preset of the description
    simulate: bool = False  # with a simulated robot at the port
    # servo model of the simulated robot, as fake_xgo takes it; None for its default
    servo: str | None = None
    arm: bool = False  # the robot has its arm
    gait: str = 'trot'  # gait of the controller
    # policy that the controller loads; None for the geometric gait alone
    policy: Path | None = None
    protocol: str = 'auto'  # serial protocol, ``v2`` or ``v1``; ``auto`` asks the robot
    calibration: Path | None = None  # parameter file that ``quad_hardware calibrate`` has written
    ready_timeout: float = 30.0  # how long each process may take to be ready in [s]
    ros: RosOptions = field(default_factory=RosOptions)  # options of all nodes
    record: Path | None = None  # folder in which the controller records its runs; None for none
    view: bool = False  # with the page on which the robot is seen

    @property
    def title(self) -> str:
        """Description of the configuration."""
        arm, simulated = ' with arm' * self.arm, ', simulated,' * self.simulate
        return f'XGO {self.preset}{arm}{simulated} on {self.port}'


def quad_processes(stack: Stack, parameters: Path, find: FindExecutable) -> list[ProcessSpec]:
    """Return the processes of a quadruped; they start in parallel.

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
    if stack.simulate:  # its joints and IMU are as the description has them
        checked = 'joints_checked', 'imu.mounting_checked', 'imu.rates_checked'
        values |= dict.fromkeys(checked, 'true')
    return values


def _controller_parameters(stack: Stack) -> dict[str, str]:
    values = {'gait': stack.gait}
    if stack.servo is not None:
        values['servo_compensation.kp'] = str(_stiffness(stack.servo))
    if stack.policy is not None:
        values['policy'] = str(stack.policy)
    if stack.record is not None:
        values['record'] = str(stack.record)
    if stack.simulate and stack.servo is not None and _stiffness(stack.servo) >= THROWING:
        values['get_up_swings'] = 'true'  # no person is hurt, and nothing breaks
    return values


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments that bring-up and demo share."""
    parser.add_argument(
        '--preset',
        choices=PRESETS,
        default='lite',
        help='which robot it is (default: %(default)s)',
    )
    parser.add_argument('--arm', action='store_true', help='the robot has its arm')
    parser.add_argument(
        '--servo',
        metavar='MODEL',
        help='servos of a simulated robot: nominal (as published), firm (they follow), '
        'vendor_rl (soft, of the vendor), or kp=4,delay=0.04 (default: nominal)',
    )
    way = parser.add_mutually_exclusive_group()
    way.add_argument(
        '--gait',
        choices=GAITS,
        default='trot',
        help='how the geometric gait puts its feet (default: %(default)s)',
    )
    way.add_argument(
        '--policy',
        metavar='FILE',
        type=Path,
        help='ONNX policy to load and check, a file or trot_ppo; mode "policy" lets it walk',
    )
    parser.add_argument(
        '--record',
        metavar='FOLDER',
        type=Path,
        help='record each step of the controller there (MCAP), for replay_policy and Foxglove',
    )
    parser.add_argument(
        '--protocol',
        choices=PROTOCOLS,
        default=AUTO,
        help='protocol of the serial line; auto detects it on a real robot, and is v2 with a '
        "simulated one; vendor goes through the vendor's xgo_lib2, whose vendor_servo_method is "
        'given in --calibration (default: %(default)s)',
    )
    add_namespace(parser)
    add_view(parser)
    add_network(parser)
    add_timeout(parser)


@contextlib.contextmanager
def session(
    arguments: argparse.Namespace, ros: RosOptions, port: str | None
) -> Iterator[tuple[Stack, list[ProcessSpec]]]:
    """Prepare a bring-up; during the block, it owns the port and the namespace.

    Args:
        arguments: Parsed arguments of :func:`add_arguments`, optionally with ``calibration``.
        ros: ROS options for all nodes.
        port: Serial port of the robot; None for a simulated robot.

    Raises:
        ArgumentError: A file is missing, or a servo model was chosen for a real robot.
        StartError: An executable or a network is missing, or another bring-up is on this port or
            in this namespace of the domain.
    """
    policy, calibration = (
        _existing(name, getattr(arguments, name, None)) for name in ('policy', 'calibration')
    )
    apply_network(arguments)
    with contextlib.ExitStack() as stack:
        if port is not None:
            name = f'port {os.path.realpath(port)}'  # two names of one port are one port
            stack.enter_context(exclusive(name, PORT_REMEDY))
        folder = stack.enter_context(bring_up_place('quad_bringup', ros))
        parameters = folder / 'robot_description.yaml'
        write_parameters(parameters, robot_urdf(arguments.preset, arm=arguments.arm))
        wanted = Stack(
            port=port or str(folder / 'xgo'),
            preset=arguments.preset,
            simulate=port is None,
            servo=_servo(arguments.servo, port),
            arm=arguments.arm,
            gait=arguments.gait,
            protocol=_protocol(arguments.protocol, simulate=port is None),
            policy=policy,
            record=arguments.record and arguments.record.expanduser().resolve(),
            calibration=calibration and namespaced_parameters(calibration, ros, folder),
            ros=ros,
            ready_timeout=arguments.timeout,
            view=arguments.view,
        )
        yield wanted, quad_processes(wanted, parameters, find_executable)


def _protocol(wanted: str, *, simulate: bool) -> str:
    if simulate and wanted == VENDOR:
        raise ArgumentError('--protocol vendor is for a real robot; leave it out, or --simulate')
    # a simulated robot may answer late on a busy machine, which is no reason for the slow protocol
    return V2.name if simulate and wanted == AUTO else wanted


def _servo(model: str | None, port: str | None) -> str | None:
    if model is not None and port is not None:
        raise ArgumentError(f'--servo {model} is for a simulated robot; leave it out, or --port')
    if model is not None:
        _stiffness(model)  # refuses what is no servo
    return model


def _stiffness(servo: str) -> float:
    """Return the stiffness of the simulated servo [N m/rad]."""
    # only here, as it takes a while and most runs choose none
    from quad_sim import parse_servo, SetupError

    try:
        return parse_servo(servo).stiffness
    except SetupError as error:
        raise ArgumentError(str(error)) from error


def _existing(name: str, path: Path | None) -> Path | None:
    if path is None:
        return None
    if name == 'policy' and not path.suffix:  # the name of a shipped one
        # only here, as it takes a while and most runs have no policy
        from quad_controller import find_policy, PolicyError

        try:
            return find_policy(str(path)).resolve()
        except PolicyError as error:
            raise ArgumentError(f'--policy: {error}') from error
    if not path.is_file():
        raise ArgumentError(f'--{name}: no file {path}')
    return path.resolve()


HINT = """in a second terminal:
    ros2 run quad_teleop teleop_keyboard{hint}
    ros2 service call {set_mode} quad_msgs/srv/SetMode "{{mode: stand}}\""""
"""What to do with a robot that has been brought up."""


def parse(argv: Sequence[str]) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line.

    Returns:
        The arguments, and the ROS options for all nodes.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run quad_bringup bringup',
        description='Bring a quadruped up: serial bridge, controller and /tf; with --simulate '
        'also the robot itself, in physics, on a pseudo-serial port. It stays as it is until a '
        'mode is requested, by teleop_keyboard or /set_mode. Ctrl-C lets it lie down and '
        'ends everything; Ctrl-C again ends it at once, and the servos hold their last position '
        '(the bridge folds legs that were walking).',
        allow_abbrev=False,
    )
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument(
        '--simulate', action='store_true', help='start a simulated robot and use its port'
    )
    where.add_argument(
        '--port', metavar='PATH', help='serial port of the robot, e.g. /dev/ttyAMA0'
    )
    parser.add_argument(
        '--calibration',
        metavar='FILE',
        type=Path,
        help='parameters of the serial bridge, as "ros2 run quad_hardware calibrate" writes them',
    )
    parser.add_argument(
        '--hold',
        action='store_true',
        help='at Ctrl-C let the robot end its gait and the servos hold it standing, '
        'instead of lying down first',
    )
    add_arguments(parser)
    return parse_with_ros(parser, argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a quadruped until it is stopped.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 when a process failed, 2 if nothing was started.
    """
    arguments, ros = parse(sys.argv[1:] if argv is None else argv)
    try:
        with session(arguments, ros, arguments.port) as (quad, processes):
            hint = HINT.format(hint=ros.hint, set_mode=ros.resolve('set_mode'))
            sys.stdout.write(f'{quad.title}\n{hint}\n')
            shutdown = partial(_leave, namespace=ros.namespace, hold=arguments.hold)
            return supervise(processes, shutdown=shutdown).exit_code
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR


def _leave(
    report: Callable[[str], None], given_up: Callable[[], bool], *, namespace: str, hold: bool
) -> None:
    # rclpy is loaded only now, a bring-up does not need it
    from .mode_client import leave

    leave(report, given_up, namespace=namespace, hold=hold)


STOP_TIMEOUT = 30.0
"""Time in [s] that launch gives the bring-up to stop its processes in order."""
TRUE, FALSE = 'true', 'false'


class LaunchArgument(NamedTuple):
    """A launch argument, ``name:=value``."""

    name: str  # with two dashes in front, that of the bring-up's argument
    default: str  # empty to leave it to the bring-up
    description: str  # what ``ros2 launch --show-args`` prints
    flag: bool = False  # it is true or false, and the bring-up's argument has no value


LAUNCH_ARGUMENTS = (
    LaunchArgument('simulate', FALSE, 'true: a robot in physics instead of a real one', flag=True),
    LaunchArgument('port', '/dev/ttyAMA0', 'serial port of the real robot'),
    LaunchArgument('preset', 'lite', 'which robot it is: lite or mini'),
    LaunchArgument('arm', FALSE, 'true: the robot has its arm', flag=True),
    LaunchArgument('gait', '', 'trot, crawl or pace'),
    LaunchArgument('policy', '', 'ONNX policy to load'),
    LaunchArgument('record', '', 'folder for recordings of each step (MCAP)'),
    LaunchArgument('servo', '', 'servo model of a simulated robot'),
    LaunchArgument('protocol', '', 'auto, v2, v1, developer or vendor'),
    LaunchArgument('calibration', '', 'parameters of the serial bridge'),
    LaunchArgument('namespace', '', 'namespace of all nodes, and prefix of TF frames'),
    LaunchArgument('no-view', FALSE, 'true: without the page in the browser', flag=True),
    LaunchArgument('network', '', 'interfaces or peers that DDS is opened to'),
)
"""What the launch file takes; the port is that of the robot's computer."""


def argv(values: Mapping[str, str]) -> list[str]:
    """Convert launch arguments to the bring-up's command line.

    Args:
        values: Value of each launch argument.

    Returns:
        The command line; empty arguments with a default in the bring-up are left out.

    Raises:
        ArgumentError: A flag is neither true nor false.
    """
    simulate = _flag('simulate', values['simulate'])
    found: list[str] = []
    for argument in LAUNCH_ARGUMENTS:
        value = values[argument.name]
        if argument.flag:
            found += [f'--{argument.name}'] if _flag(argument.name, value) else []
        elif value and not (simulate and argument.name == 'port'):
            found += [f'--{argument.name}', value]
    return found


def _flag(name: str, value: str) -> bool:
    if value.lower() not in {TRUE, FALSE}:
        raise ArgumentError(f'{name}:={value} is neither true nor false')
    return value.lower() == TRUE
