# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments of the launch file, and the command line that they become."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from .exceptions import ArgumentError

STOP_TIMEOUT = 30.0
"""Time in [s] that launch gives the bring-up to stop its processes in order."""
TRUE, FALSE = 'true', 'false'


class LaunchArgument(NamedTuple):
    """An argument as ``name:=value``."""

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
    LaunchArgument('protocol', '', 'auto, v2, v1 or vendor'),
    LaunchArgument('calibration', '', 'parameters of the serial bridge'),
    LaunchArgument('namespace', '', 'namespace of all nodes, and prefix of TF frames'),
    LaunchArgument('no-view', FALSE, 'true: without the page in the browser', flag=True),
    LaunchArgument('network', '', 'interfaces or peers that DDS is opened to'),
)
"""What the launch file takes; the port is that of the robot's computer."""


def argv(values: Mapping[str, str]) -> list[str]:
    """Make the bring-up's command line.

    Args:
        values: Value of each launch argument.

    Returns:
        Its arguments; those that the bring-up has defaults for are left out when they are empty.

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
