# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which processes a quadruped has, and what they make of their arguments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import re

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node

from process_supervisor import ProcessSpec, StartError, write_parameters
from quad_bringup.bringup import (
    ArgumentError,
    argv,
    LAUNCH_ARGUMENTS,
    parse,
    quad_processes,
    Stack,
)
from quad_controller.nodes.parameters import declare_parameters as controller_parameters
from quad_controller.nodes.parameters import NodeSettings as ControllerSettings
from quad_description import movable_joints, robot_urdf
from quad_hardware.calibration.main import write_parameters as write_calibration
from quad_hardware.calibration.odometry import BRING_UP
from quad_hardware.doctor.graph import check_graph, Observation
from quad_hardware.nodes.parameters import declare_parameters as hardware_parameters
from quad_hardware.nodes.parameters import NodeSettings as HardwareSettings
from quad_hardware.protocol import Code, Frame, Kind, Register, ROBOT_KINDS, StreamParser, V2
from quad_sim.options import build, parse_arguments, Simulation

DEFAULTS = {argument.name: argument.default for argument in LAUNCH_ARGUMENTS}


def test_every_argument_of_launch_reaches_the_bring_up() -> None:
    """Under its own name; without any it is the real robot, on its own computer (the article)."""
    for given, expected in (
        ({}, {'simulate': False, 'port': '/dev/ttyAMA0', 'preset': 'lite'}),
        ({'simulate': 'true'}, {'simulate': True, 'port': None}),
        ({'preset': 'mini', 'arm': 'True'}, {'preset': 'mini', 'arm': True}),
        ({'policy': '/a.onnx'}, {'policy': Path('/a.onnx')}),
        ({'calibration': '/c.yaml'}, {'calibration': Path('/c.yaml')}),
        ({'gait': 'pace', 'port': '/dev/ttyUSB0'}, {'gait': 'pace', 'port': '/dev/ttyUSB0'}),
    ):
        arguments = vars(parse(argv({**DEFAULTS, **given}))[0])
        assert {name: arguments[name] for name in expected} == expected
    with pytest.raises(ArgumentError, match='arm:=maybe'):
        argv({**DEFAULTS, 'arm': 'maybe'})


def test_launch_can_read_the_file() -> None:
    """Where ROS has launch; all arguments are declared."""
    # not 'launch' itself: without ROS' package, the folder beside this one has that name
    sources = pytest.importorskip('launch.launch_description_sources')
    launch = pytest.importorskip('launch')
    file = Path(__file__).parents[1] / 'launch' / 'bringup.launch.py'
    source = sources.PythonLaunchDescriptionSource(str(file))
    description = source.get_launch_description(launch.LaunchContext())
    declared = {argument.name for argument in description.get_launch_arguments()}
    assert declared == set(DEFAULTS)


def test_commands_that_the_tools_of_quad_hardware_print_are_accepted() -> None:
    """As remedies of doctor and calibrate."""
    one_node = Observation(1.0, nodes={'hardware_node'})
    found = [*check_graph(Observation(1.0), '/dev/x'), *check_graph(one_node, '/dev/x')]
    printed = [BRING_UP, *(finding.remedy for finding in found)]
    command = re.compile(r'ros2 run quad_bringup bringup((?: --?\S+ [/\w]+)*)')
    commands = [match[1].split() for text in printed for match in command.finditer(text)]
    assert [parse(words)[0].port for words in commands] == ['/dev/ttyAMA0', '/dev/x', '/dev/x']


OURS = ('quad_hardware', 'quad_sim', 'quad_controller', 'robot_viewer')


def underlay(folder: Path, *packages: str) -> Callable[[str, str], Path | None]:
    """Make executables of packages that are there; answer as find_executable does."""

    def find(package: str, name: str) -> Path | None:
        if package not in packages:
            return None
        file = folder / package / name
        file.parent.mkdir(exist_ok=True)
        file.touch(mode=0o755)
        return file

    return find


def processes(folder: Path, stack: Stack, *packages: str) -> dict[str, ProcessSpec]:
    """Plan a stack on an underlay with our packages and more."""
    find = underlay(folder, *OURS, *packages)
    parameters = folder / 'robot_description.yaml'
    write_parameters(parameters, robot_urdf(stack.preset, arm=stack.arm))
    return {spec.name: spec for spec in quad_processes(stack, parameters, find)}


@contextmanager
def as_node(spec: ProcessSpec, name: str) -> Iterator[Node]:
    """Give a node what its process gets on its command line."""
    context = Context()
    rclpy.init(args=list(spec.argv), context=context)
    node = Node(name, context=context, enable_rosout=False)
    try:
        yield node
    finally:
        node.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.shutdown(context=context)


def bridge_of(specs: dict[str, ProcessSpec]) -> HardwareSettings:
    """What the serial bridge understands."""
    with as_node(specs['hardware'], 'hardware_node') as node:
        return hardware_parameters(node)


def controller_of(specs: dict[str, ProcessSpec]) -> ControllerSettings:
    """What the controller understands."""
    with as_node(specs['controller'], 'controller_node') as node:
        return controller_parameters(node)


def simulator_of(specs: dict[str, ProcessSpec]) -> tuple[Path, Simulation]:
    """The port and the robot that the simulator makes."""
    argv = specs['fake_xgo'].argv
    options = parse_arguments([*argv[1 : argv.index('--ros-args')], '--physics', 'none'])
    return options.link, build(options)


@pytest.mark.slow
def test_hardware_has_no_simulator_and_simulation_has(tmp_path: Path) -> None:
    """The bridge opens the port that it is given; only of a simulated robot the IMU is known."""
    port = tmp_path / 'xgo'
    real = processes(tmp_path, Stack(str(port)))
    soft = Stack(str(port), simulate=True, servo='vendor_rl', view=True)
    simulated = processes(tmp_path, soft)
    assert set(real) == {'hardware', 'controller', 'robot_state'}
    assert set(simulated) == {'fake_xgo', *real, 'viewer'}
    assert not simulated['viewer'].required
    compensated = controller_of(real).tuning.servo, controller_of(simulated).tuning.servo
    assert [servo and servo.kp for servo in compensated] == [2.45, 1.1]
    argv = simulated['fake_xgo'].argv
    assert argv[argv.index('--servo') + 1] == 'vendor_rl'
    assert bridge_of(real).robot.link == bridge_of(simulated).robot.link
    assert bridge_of(real).robot.link.path == str(port)
    assert simulator_of(simulated)[0] == port
    for part, known in ((real, False), (simulated, True)):
        mounting = bridge_of(part).robot.estimator.mounting
        assert mounting.checked is mounting.rates_checked is known
        assert bridge_of(part).robot.joints_checked is known


@pytest.mark.slow
@pytest.mark.parametrize(('preset', 'arm'), [('lite', False), ('mini', True)])
def test_everyone_has_the_same_robot(tmp_path: Path, preset: str, arm: bool) -> None:
    """Bridge, controller and simulator: the joints of the description, in its order."""
    specs = processes(tmp_path, Stack(str(tmp_path / 'xgo'), preset, simulate=True, arm=arm))
    names = tuple(joint.name for joint in movable_joints(robot_urdf(preset, arm=arm)))
    assert bridge_of(specs).robot.joints.names == names
    assert bridge_of(specs).robot.urdf == robot_urdf(preset, arm=arm)
    assert controller_of(specs).robot.names == names
    robot = simulator_of(specs)[1].board
    assert len(robot.servos.fitted) == len(names)
    assert robot.model.value == preset


@pytest.mark.slow
@pytest.mark.parametrize('protocol', ['auto', 'v2', 'v1'])
def test_both_ends_of_the_line_speak_the_same_protocol(tmp_path: Path, protocol: str) -> None:
    """Whichever the bridge tries first, the simulated robot answers in it."""
    specs = processes(tmp_path, Stack(str(tmp_path / 'xgo'), simulate=True, protocol=protocol))
    first = bridge_of(specs).robot.link.protocols[0]
    line = simulator_of(specs)[1].line
    line.set_baud(first.baud)
    register = Code.VERSION if first is V2 else Register.FIRMWARE
    request = Frame(Kind.READ, register, b'' if first is V2 else bytes((10,)))
    line.receive(request.encode(first), 0.0)
    received = StreamParser(first, ROBOT_KINDS).feed(line.advance(0.1))
    assert [frame.address for frame in received] == [register]


@pytest.mark.slow
def test_gait_policy_and_calibration_reach_their_nodes(tmp_path: Path) -> None:
    """A policy, and a folder for recordings, only where there is one."""
    calibration = tmp_path / 'calibration.yaml'
    values = {'joints': {'fl_hip_joint': {'sign': -1}}, 'imu': {'mounting_checked': True}}
    write_calibration(calibration, values)
    for stack, expected in (
        (Stack('p', gait='crawl', calibration=calibration), ('crawl', '', '')),
        (Stack('p', policy=Path('/a.onnx'), record=Path('/runs')), ('trot', '/a.onnx', '/runs')),
    ):
        specs = processes(tmp_path, stack)
        settings, robot = controller_of(specs), bridge_of(specs).robot
        assert (settings.gait.value, settings.policy, settings.record) == expected
        is_calibrated = stack.calibration is not None
        assert robot.joints.servos[0].sign == (-1 if is_calibrated else 1)
        assert robot.estimator.mounting.checked is is_calibrated


@pytest.mark.slow
@pytest.mark.parametrize('missing', OURS)
def test_a_workspace_that_is_not_built_says_so(tmp_path: Path, missing: str) -> None:
    """Whichever package it is."""
    find = underlay(tmp_path, *(name for name in OURS if name != missing))
    with pytest.raises(StartError, match='make build'):
        quad_processes(Stack('p', simulate=True), tmp_path / 'none.yaml', find)
