# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Programs: their end as background jobs, what they load, and nodes that are refused.

Shells start background jobs with SIGINT ignored, which a program inherits. The exit code is the
program's own: one that the signal kills, or that ends by a traceback, has another.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time

from isolation import Isolation
from processes import executable, RunningProcess
import pytest
import rclpy
from rclpy.node import Node
from urdf_reader import DescriptionError

from arm_bringup.robots import BringupError
from arm_canopen import CanopenError
from arm_canopen.nodes.joint_state_publisher import JointStatePublisher
from canopen_core.can import open_bus
from canopen_tools.cli.main import INTERRUPTED
from node_runner import ParameterError
from quad_controller import QuadControllerError
from quad_controller.nodes.controller_node import ControllerNode
from quad_description.display import Display
from quad_hardware import HardwareError
from quad_hardware.nodes.hardware_node import HardwareNode
from quad_pty_peer import PtyPeer
from robot_viewer.nodes.robot_state_publisher import RobotStatePublisher

POLICY = ['trot_ppo', '--walk', '0.1', '0', '0', '--duration', '600']
DOCTOR = ['quad_hardware', 'doctor', '--port', '/dev/null']
IGNORING = ['env', '--ignore-signal=INT']


@pytest.mark.scenario
@pytest.mark.slow
@pytest.mark.parametrize(
    ('command', 'begun', 'code'),
    [
        (['operator_input', 'show_gamepad', '--device', 'no such pad'], 'no gamepad yet', 0),
        (['quad_controller', 'check_policy', *POLICY], 'order of joints', INTERRUPTED),
        ([*DOCTOR, '--duration', '300'], '.', INTERRUPTED),
    ],
    ids=lambda each: each[1] if isinstance(each, list) else '',
)
def test_a_program_ends(command: list[str], begun: str, code: int, isolation: Isolation) -> None:
    """Whatever it does at that moment."""
    package, name, *arguments = command
    program = [*IGNORING, executable(package, name), *arguments]
    with RunningProcess(program, isolation.env) as process:
        process.wait_for(begun, 30.0)
        process.signal(signal.SIGINT)
        assert process.wait(30.0) == code, process.output


@pytest.mark.scenario
@pytest.mark.slow
def test_a_scan_ends(isolation: Isolation) -> None:
    """While it waits for answers of devices that are not there."""
    program = [*IGNORING, executable('canopen_tools', 'canopen'), 'scan', '--query']
    with (
        open_bus(isolation.bus) as bus,
        RunningProcess([*program, '--can', isolation.bus], isolation.env) as process,
    ):
        deadline = time.monotonic() + 30.0
        while not bus.receive(1.0):
            assert time.monotonic() < deadline, process.output
        process.signal(signal.SIGINT)
        assert process.wait(30.0) == INTERRUPTED


@pytest.mark.scenario
@pytest.mark.slow
def test_a_calibration_ends(isolation: Isolation, tmp_path: Path) -> None:
    """While it waits for the person, and the servos hold."""
    program = [*IGNORING, executable('quad_hardware', 'calibrate'), 'joints', '--output']
    with PtyPeer(tmp_path / 'port') as peer:
        process = subprocess.Popen(
            [*program, str(tmp_path / 'found.yaml'), '--port', str(peer.link)],
            env=isolation.env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout is not None
            assert '12 joints' in process.stdout.readline()
            process.send_signal(signal.SIGINT)
            assert process.wait(30.0) == 1  # nothing was written
        finally:
            process.kill()
            process.communicate()
        assert peer.torque


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
        (controller, 'gait:=gallop', "gait is 'gallop': it must be trot, crawl or pace"),
        (controller, 'nominal_height:=0.5', 'do not reach'),
        (controller, 'loop_rate:=fast', "loop_rate is 'fast': it must be a number"),
        (controller, 'loop_rate:=10.0', 'it must be 25.0 to 200.0'),
        (HardwareNode, 'protokoll:=old', "did you mean 'protocol'"),
        (controller, 'robot_description:=none', 'robot_description: .*no XML'),
        (HardwareNode, 'robot_description:=none', 'robot_description: .*no XML'),
        (RobotStatePublisher, 'publish_frequncy:=9.0', "did you mean 'publish_frequency'"),
        (RobotStatePublisher, 'publish_frequency:=1000.1', 'must be 0.0 to 1000.0'),
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


FOREIGN = {'can', 'canopen', 'launch', 'lark', 'rich', 'rosidl_generator_py', 'scipy', 'xacro'}
"""Adapters of python-can, tools, terminals and descriptions; none is a master's business."""
MODEL = {'pinocchio'}
"""Of the arm, which one of the masters computes with."""

LOADED = """
import importlib, sys
importlib.import_module(sys.argv[1])
print(*{name.partition('.')[0] for name in sys.modules})
"""
CORE_LOADED = """
import importlib, pkgutil, sys
import arm_canopen
parts = [f'arm_canopen.{part}' for part in ('cia402', 'cia402.modes', 'config', 'master')]
importlib.import_module('arm_canopen.joints')
for part in (*parts, 'canopen_core.eds', 'canopen_core.standard'):
    package = importlib.import_module(part)
    for module in pkgutil.iter_modules(package.__path__, f'{package.__name__}.'):
        importlib.import_module(module.name)
print(*{name.partition('.')[0] for name in sys.modules})
"""


def libraries(program: str, *arguments: str) -> set[str]:
    """Return the top names of all modules after a program."""
    command = [sys.executable, '-c', program, *arguments]
    answer = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60.0)
    return set(answer.stdout.split())


@pytest.mark.slow
@pytest.mark.parametrize(
    ('entry', 'unwanted'),
    [('arm_canopen.nodes.master', FOREIGN | MODEL), ('arm_servo.ros.canopen_backend', FOREIGN)],
)
def test_a_master_loads_nothing_that_it_does_not_use(entry: str, unwanted: set[str]) -> None:
    """NumPy is there, since rclpy.action and sensor_msgs import it for arrays in messages."""
    loaded = libraries(LOADED, entry)
    assert 'rclpy' in loaded
    assert not loaded & unwanted


@pytest.mark.slow
def test_the_core_of_the_master_needs_neither_numpy_nor_ros() -> None:
    """NumPy comes with messages alone."""
    loaded = libraries(CORE_LOADED)
    assert 'arm_canopen' in loaded
    assert not loaded & (FOREIGN | MODEL | {'numpy', 'rclpy'})
