# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS arguments without ROS."""

from __future__ import annotations

import pytest

from canopen_tools.ros_arguments import split_ros_arguments


@pytest.mark.parametrize(
    ('line', 'own', 'parameters'),
    [
        ('', '', {}),
        ('vcan0 -n 3', 'vcan0 -n 3', {}),
        ('vcan0 --ros-args', 'vcan0', {}),
        ('--ros-args -p a:=1', '', {'a': '1'}),
        ('--ros-args --param a:=1 -p b:=x:y -- vcan0', 'vcan0', {'a': '1', 'b': 'x:y'}),
        ('--ros-args -p candump:a:=1', '', {'a': '1'}),
        ('--ros-args -p a:=', '', {'a': ''}),
        ('--ros-args -r __node:=x --log-level debug --params-file f.yaml -p a:=1', '', {'a': '1'}),
        ('--ros-args --disable-stdout-logs -p a:=1', '', {'a': '1'}),
        ('-n 3 --ros-args -p a:=1 -- -t a --ros-args -p b:=2', '-n 3 -t a', {'a': '1', 'b': '2'}),
        ('-p 3', '-p 3', {}),
    ],
)
def test_ros_arguments_are_taken_out(line: str, own: str, parameters: dict[str, str]) -> None:
    """What is for ROS ends at `--` or at the end; the rest is the program's own."""
    arguments = split_ros_arguments(line.split())
    assert arguments.own == own.split()
    assert arguments.parameters == parameters


@pytest.mark.parametrize('line', ['--ros-args -p', '--ros-args -p a', '--ros-args -p :=1'])
def test_a_parameter_without_name_or_value_is_refused(line: str) -> None:
    """A forgotten half is reported, as rcl does."""
    with pytest.raises(ValueError, match=r'needs a value|not a parameter'):
        split_ros_arguments(line.split())
