# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch`, which the wheels of ROS lack: what to run instead."""

from __future__ import annotations

from argparse import Namespace, REMAINDER
from typing import NoReturn

from ..cli.errors import FrontendError
from ..cli.verb import argument, verb
from ..index.packages import executables

_MISSING = """\
This ROS was installed from wheels, which have no launch. {0}
Launch files run where ROS 2 Jazzy is installed (https://docs.ros.org/en/jazzy)."""


@verb(
    argument('package_name', help='Name of the ROS package'),
    argument('launch_file_name', nargs='?', default='', help='Name of the launch file'),
    argument('launch_arguments', nargs=REMAINDER, help='Arguments to the launch file'),
)
def launch(args: Namespace) -> NoReturn:
    """Name the executables of the package; the one with the name of the launch file, if any."""
    package = args.package_name
    names = sorted(path.name for path in executables(package))
    wanted = args.launch_file_name.partition('.')[0]
    if wanted in names:
        remedy = f'Do the same with:\n    ros2 run {package} {wanted} --help'
    elif names:
        remedy = f'Executables of {package} (ros2 run {package} NAME): {", ".join(names)}'
    else:
        remedy = f'{package} has no executables.'
    raise FrontendError(_MISSING.format(remedy))
