# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 run`: replace this process by an executable of a package.

So the executable gets every signal exactly once, from any sender; its exit code is ours; and there
is one process less per node. (ros2cli keeps a parent, which leaves the node running when only the
parent is killed.)
"""

from __future__ import annotations

from argparse import Namespace, REMAINDER
import os
import shlex
import signal
import sys
from typing import NoReturn

from ..cli.commands import argument, FrontendError, hint, UnknownNameError, verb
from ..index import executables

_MISSING = """\
This ROS was installed from wheels, which have no launch. {0}
Launch files run where ROS 2 Jazzy is installed (https://docs.ros.org/en/jazzy)."""


@verb(
    argument(
        '--prefix',
        help='Prefix command, which should go before the executable. '
        'Command must be wrapped in quotes if it contains spaces '
        "(e.g. --prefix 'gdb -ex run --args').",
    ),
    argument('package_name', help='Name of the ROS package'),
    argument('executable_name', help='Name of the executable'),
    argument('argv', nargs=REMAINDER, help='Pass arbitrary arguments to the executable'),
)
def run(args: Namespace) -> NoReturn:
    """Replace this process by the executable."""
    package, name = args.package_name, args.executable_name
    paths = executables(package)
    found = [path for path in paths if path.name == name]
    if not paths:
        text = f"No executable found\nPackage '{package}' has no executables; is it built?"
        raise UnknownNameError(text)
    if not found:
        names = sorted(path.name for path in paths)
        near = hint(name, names) or f'\n{package} has: {", ".join(names)}'
        raise UnknownNameError('No executable found' + near)
    if len(found) > 1:
        listed = ''.join(f'\n- {path}' for path in found)
        raise FrontendError(f'Multiple executables found:{listed}')
    prefix = shlex.split(args.prefix) if args.prefix else []
    command = [*prefix, str(found[0]), *args.argv]
    sys.stdout.flush()
    sys.stderr.flush()
    # Python ignores SIGPIPE, and what is ignored stays ignored across exec
    numbers = (signal.SIGPIPE, signal.SIGTERM)
    before = [signal.signal(number, signal.SIG_DFL) for number in numbers]
    try:
        os.execvp(command[0], command)  # noqa: S606
    except OSError as error:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)  # else a closed pipe ends this process without a word
        raise FrontendError(f'Cannot run {command[0]}: {error.strerror}') from error


@verb(
    argument('package_name', help='Name of the ROS package'),
    argument('launch_file_name', nargs='?', default='', help='Name of the launch file'),
    argument('launch_arguments', nargs=REMAINDER, help='Arguments to the launch file'),
)
def launch(args: Namespace) -> NoReturn:
    """Print the executables of the package, or the one named like the launch file."""
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
