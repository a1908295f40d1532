# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup bringup``: start all processes of an arm with one command."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
import contextlib
from functools import partial
import itertools
from pathlib import Path
import sys
import tempfile
import threading
import time
from typing import TYPE_CHECKING

from process_supervisor import (
    CallError,
    Executable,
    find_executable,
    ForkServer,
    GivenUpError,
    join_in_time,
    parse_with_ros,
    Phase,
    RosOptions,
    STATE_PUBLISHERS,
    supervise,
    SupervisorError,
    USAGE_ERROR,
    VIEWER,
    write_parameters,
)
from process_supervisor.ros_options import apply_network

from .groups import controller_names, motion_files, moved_groups, planning_files
from .robots import BringupError, in_namespace_of_bus, read_bus, read_description, RobotError
from .session import (
    add_arguments,
    choose_master,
    controller_process,
    enabling_services,
    locate,
    MASTER,
    no_files,
    PLANNER,
    REAL_BUS,
    robots_epilog,
    session,
    SIMULATED_BUS,
    SLAVES,
)

if TYPE_CHECKING:
    from .service_client import ServiceClient


ENABLE_TIMEOUT = 60.0  # longest time for all drives to boot and to be enabled in [s]
BOOT_TIMEOUT = 30.0
"""Longest time in [s] to wait for drives to boot before they are enabled anyway."""
OPERATIONAL = 'START'  # the NMT state of a device that has booted, on its topic nmt_state
AGAIN = 1.0  # pause after a refusal in [s]; a drive that is still booting refuses


@contextlib.contextmanager
def enabling(
    drives: Sequence[str],
    mode_service: str,
    say: Callable[[str], None],
    namespace: str = '',
    booted: threading.Event | None = None,
) -> Iterator[None]:
    """Enable drives in a background thread while the block runs; any thread may call ``say``.

    ``booted`` is set when all drives have booted; heartbeats may show that up to 1 s later.
    """
    ended = threading.Event()
    thread = threading.Thread(
        target=_enable,
        args=[drives, mode_service, say, ended, namespace],
        kwargs={'booted': booted or threading.Event()},
        name='enabling',
        daemon=True,
    )
    thread.start()
    try:
        yield
    finally:
        ended.set()
        if late := join_in_time(thread):
            say(f'error: {late}')


def _enable(
    drives: Sequence[str],
    mode_service: str,
    say: Callable[[str], None],
    ended: threading.Event,
    namespace: str,
    *,
    booted: threading.Event,
) -> None:
    from .service_client import ServiceClient

    client = ServiceClient('bringup', ended.is_set, namespace)
    groups = enabling_services(drives, mode_service)
    deadline = time.monotonic() + ENABLE_TIMEOUT
    try:
        client.prepare(itertools.chain(*groups))
        with contextlib.suppress(CallError):  # the services report why
            _await_boot(client, groups[0], booted)
        while (refusal := _refusal(client, groups)) and time.monotonic() < deadline:
            client.wait_until(_after(AGAIN), 2 * AGAIN, 'another try')
        if refusal:
            say(f'error: the drives are not enabled: {refusal}')
        else:
            say(f'all {len(drives)} drives are enabled, in {mode_service}')
    except GivenUpError:
        pass  # the bring-up ends, and reports why
    finally:
        client.close()


def _await_boot(client: ServiceClient, services: Sequence[str], booted: threading.Event) -> None:
    """Wait until ``booted`` is set or all drives that publish ``nmt_state`` are operational."""
    from std_msgs.msg import String

    from node_runner import LATCHED

    node, states = client.node, dict[str, str]()

    def watch(service: str) -> str:
        topic = f'{service.rpartition("/")[0]}/nmt_state'

        def note(message: String) -> None:
            states[topic] = message.data

        node.create_subscription(String, topic, note, LATCHED)
        return topic

    topics = {service: watch(service) for service in services}

    def have_booted() -> bool:
        return booted.is_set() or all(
            states.get(topic) == OPERATIONAL
            or (client.is_ready(service) and not node.count_publishers(topic))
            for service, topic in topics.items()
        )

    client.wait_until(have_booted, BOOT_TIMEOUT, 'the boot of the drives')


def _refusal(client: ServiceClient, groups: Sequence[list[str]]) -> str:
    """Call groups of services in sequence; return why one refused, or an empty string."""
    try:
        for services in groups:
            client.call(services, ENABLE_TIMEOUT)
    except CallError as error:
        return str(error)
    return ''


def _after(pause: float) -> Callable[[], bool]:
    end = time.monotonic() + pause
    return lambda: time.monotonic() > end


CALL = 'ros2 service call {} std_srvs/srv/Trigger'
TARGET = 'ros2 service call {}/target canopen_interfaces/srv/COTargetDouble "{{ target: 0.1 }}"'


def next_commands(
    drives: Sequence[str],
    mode_service: str,
    controllers: Sequence[str],
    ros: RosOptions,
    *,
    enabled: bool,
    simulated: bool,
    planned: bool = False,
) -> str:
    """Return suggested commands to print; ``controllers`` are the trajectory controllers.

    A target of a single drive is absolute, so it is suggested for simulated drives only.
    """

    def lines() -> Iterator[str]:
        first = ros.resolve(drives[0])
        if not enabled:
            others = ' # and of the others' if len(drives) > 1 else ''
            for name in ('init', mode_service):
                yield CALL.format(f'{first}/{name}') + others
        if controllers:
            yield f'ros2 run arm_servo servo_keyboard_input{ros.hint}'
        elif simulated:
            yield TARGET.format(first)
        for name in controllers:
            yield f'ros2 action info {ros.resolve(name)}/follow_joint_trajectory'
        if planned:
            yield f'ros2 action info {ros.resolve("move_action")}'
        yield f'ros2 topic echo --once {ros.resolve("joint_states")}'

    advice = '' if enabled else ' (--enable enables all drives at the start)'
    return '\n    '.join([f'in a second terminal{advice}:', *lines()])


def parse(argv: Sequence[str]) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line: return its arguments, and the ROS options of all nodes."""
    parser = argparse.ArgumentParser(
        prog='ros2 run arm_bringup bringup',
        description='Bring an arm up: CANopen master with all its drives, /joint_states, '
        'trajectories and jogging; with --simulate also the drives themselves. Ctrl-C stops and '
        'disables the drives and ends everything.',
        epilog=robots_epilog(),
        allow_abbrev=False,
    )
    default_bus = f'{REAL_BUS}; with --simulate {SIMULATED_BUS}, which is vcan0 when it is there'
    add_arguments(parser, default_bus=default_bus)
    parser.add_argument(
        '--simulate',
        action='store_true',
        help='start a simulated drive for each device of the bus',
    )
    parser.add_argument(
        '--enable',
        action='store_true',
        help='enable the drives as soon as they have booted, so that they follow trajectories and '
        'jogging',
    )
    parser.add_argument(
        '--plan',
        action='store_true',
        help='start move_group with the arm: motions among obstacles, for clients of MoveIt',
    )
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument(
        '--drives-only',
        action='store_true',
        help='without trajectories and jogging, as where arm_servo is not built',
    )
    kinds.add_argument(
        '--controller-only',
        action='store_true',
        help='trajectories and jogging only, for drives of another process: it subscribes '
        'to /joint_states, and publishes set-points',
    )
    return parse_with_ros(parser, argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Bring up an arm, and run until Ctrl-C or SIGTERM.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 if a process failed, 2 if nothing was started.
    """
    arguments, ros = parse(sys.argv[1:] if argv is None else argv)
    try:
        if arguments.plan and (arguments.drives_only or arguments.controller_only):
            raise RobotError('--plan needs the whole arm: leave --drives-only and its like out')
        if arguments.controller_only:
            return _controllers(arguments, ros)
        return _arm(arguments, ros)
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR


def _arm(arguments: argparse.Namespace, ros: RosOptions) -> int:
    master, no_motion, robot = MASTER, '--drives-only', locate(arguments)
    if not arguments.drives_only:
        master, no_motion = choose_master(robot, find_executable)
    files, controllers = no_files, dict[str, str]()
    if not no_motion:
        groups = moved_groups(robot)
        files = partial(planning_files if arguments.plan else motion_files, groups=groups)
        controllers = controller_names(robot, groups)
    elif arguments.plan:
        raise RobotError(f'--plan: nothing would execute a plan: {no_motion}')
    with (
        ForkServer(_programs(arguments, master)) as fork_server,
        session(
            robot,
            arguments,
            ros,
            simulate=arguments.simulate,
            master=master,
            master_files=files,
            plan=arguments.plan,
        ) as arm,
    ):
        offered = f'no motion ({no_motion})' if no_motion else 'trajectories and jogging'
        offered += ', planning' if arguments.plan else ''
        place = f' in namespace /{arm.ros.namespace}' if arm.ros.namespace else ''
        _say(f'{arm.robot.name} on CAN bus {arm.bus}{place}: {offered}')
        if arm.start:
            _say(arm.start)
        _say(
            next_commands(
                arm.drives,
                arm.mode_service,
                list(controllers.values()),
                arm.ros,
                enabled=arguments.enable,
                simulated=arguments.simulate,
                planned=arguments.plan,
            )
        )
        with contextlib.ExitStack() as stack:
            running = threading.Event()
            if arguments.enable:
                stack.enter_context(
                    enabling(arm.drives, arm.mode_service, _say, arm.ros.namespace, running)
                )

            def note(phase: Phase) -> None:
                if phase is Phase.RUNNING:
                    running.set()

            return supervise(arm.processes, on_phase=note, fork_server=fork_server).exit_code


def _programs(arguments: argparse.Namespace, master: Executable) -> Iterator[Executable]:
    """Yield the programs to start, in order of their start."""
    if arguments.simulate:
        yield SLAVES
    yield from (master, STATE_PUBLISHERS[-1])
    if arguments.plan:
        yield PLANNER
    if arguments.view:
        yield VIEWER


def _controllers(arguments: argparse.Namespace, ros: RosOptions) -> int:
    apply_network(arguments)
    robot = locate(arguments)
    ros = in_namespace_of_bus(ros, read_bus(robot))
    if robot.lacking:
        raise RobotError(
            f'{robot.name} lacks {robot.lacking}: '
            f'ros2 run arm_bringup check {arguments.robot} reports all of it'
        )
    with tempfile.TemporaryDirectory(prefix='arm_bringup-') as folder:
        parameters = Path(folder) / 'robot_description.yaml'
        write_parameters(parameters, read_description(robot))
        files = motion_files(robot, Path(folder), ros, moved_groups(robot))
        _say(f'{robot.name}: trajectories and jogging for drives of another process')
        process = controller_process(files, parameters, arguments.timeout, find_executable, ros)
        return supervise([process]).exit_code


def _say(text: str) -> None:
    sys.stdout.write(f'{text}\n')
    sys.stdout.flush()
