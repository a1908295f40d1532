# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The launch file's arguments become the bring-up's, and nothing else."""

from __future__ import annotations

from pathlib import Path
import re

import pytest

from quad_bringup.bringup import ArgumentError, argv, LAUNCH_ARGUMENTS, parse
from quad_hardware.calibration.odometry import BRING_UP
from quad_hardware.doctor.graph import check_graph, Observation

DEFAULTS = {argument.name: argument.default for argument in LAUNCH_ARGUMENTS}


def test_without_arguments_it_is_the_real_robot_on_its_own_computer() -> None:
    """As in the article: ros2 launch quad_bringup bringup.launch.py."""
    arguments = parse(argv(DEFAULTS))[0]
    assert not arguments.simulate
    assert arguments.port == '/dev/ttyAMA0'
    assert arguments.preset == 'lite'
    simulated = parse(argv({**DEFAULTS, 'simulate': 'true'}))[0]
    assert simulated.simulate
    assert simulated.port is None


def test_every_argument_reaches_the_bring_up() -> None:
    """Under its own name."""
    given = {'preset': 'mini', 'arm': 'True', 'policy': '/a.onnx', 'calibration': '/c.yaml'}
    arguments = parse(argv({**DEFAULTS, **given, 'port': '/dev/ttyUSB0'}))[0]
    assert (arguments.port, arguments.preset, arguments.arm) == ('/dev/ttyUSB0', 'mini', True)
    assert (arguments.policy, arguments.calibration) == (Path('/a.onnx'), Path('/c.yaml'))
    assert parse(argv({**DEFAULTS, 'gait': 'pace'}))[0].gait == 'pace'


def test_a_flag_that_is_neither_true_nor_false_is_refused() -> None:
    """With its name."""
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
