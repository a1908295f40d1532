# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 launch quad_bringup bringup.launch.py``, where ROS provides launch.

It runs ``ros2 run quad_bringup bringup``, which starts, supervises and stops the processes, so
both behave the same.
"""

from __future__ import annotations

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown

from quad_bringup.bringup import argv, LAUNCH_ARGUMENTS, STOP_TIMEOUT


def _bringup(context: LaunchContext) -> list[ExecuteProcess]:
    values = {
        argument.name: context.launch_configurations[argument.name]
        for argument in LAUNCH_ARGUMENTS
    }
    return [
        ExecuteProcess(
            cmd=['ros2', 'run', 'quad_bringup', 'bringup', *argv(values)],
            output='screen',
            sigterm_timeout=f'{STOP_TIMEOUT:g}',
            on_exit=Shutdown(),
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments and run the bring-up."""
    arguments = [
        DeclareLaunchArgument(
            argument.name, default_value=argument.default, description=argument.description
        )
        for argument in LAUNCH_ARGUMENTS
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_bringup)])
