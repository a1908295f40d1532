# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads ROS arguments without ROS, for programs that start faster than rclpy is imported.

The grammar is that of ``--ros-args`` up to ``--`` or the end (ROS 2 design, "ROS command line
arguments"). Parameters are read, everything else that ROS knows is taken and means nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

_BEGIN, _END = '--ros-args', '--'
_PARAMETER = frozenset({'-p', '--param'})
_WITH_VALUE = frozenset(
    {'-r', '--remap', '--params-file', '-e', '--enclave', '--log-level', '--log-config-file'}
)


@dataclass(slots=True)
class Arguments:
    """A command line, taken apart."""

    own: list[str] = field(default_factory=list)  # what is not for ROS
    # values of ``-p name:=value`` by name, without the node's name before it
    parameters: dict[str, str] = field(default_factory=dict)


def split_ros_arguments(argv: Sequence[str]) -> Arguments:
    """Split the ROS arguments from a command line without the program.

    Raises:
        ValueError: A parameter has no value, or an option nothing behind it.
    """
    arguments = Arguments()
    words = iter(argv)
    in_ros = False
    for word in words:
        if word == _BEGIN:
            in_ros = True
        elif not in_ros:
            arguments.own.append(word)
        elif word == _END:
            in_ros = False
        elif word in _PARAMETER | _WITH_VALUE:
            value = next(words, None)
            if value is None:
                raise ValueError(f'{word} needs a value')
            if word in _PARAMETER:
                name, text = _parameter(value)
                arguments.parameters[name] = text
    return arguments


def _parameter(rule: str) -> tuple[str, str]:
    name, assigned, value = rule.partition(':=')
    if not assigned or not name:
        raise ValueError(f'{rule!r} is not a parameter; write name:=value')
    return name.rpartition(':')[2], value
