# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Starts the set-up with a supported Python outside of any virtual environment.

Only this file must parse in any Python 3, so that an old one prints a message, not a traceback.
"""

import os
import shutil
import subprocess
import sys

OLDEST = (3, 10)
NEWEST = (3, 14)


def _works(path: str) -> bool:
    """Return whether a candidate is a supported Python, not a broken shim."""
    code = f'import sys; sys.exit(not {OLDEST} <= sys.version_info[:2] <= {NEWEST})'
    try:
        return subprocess.call([path, '-c', code], stderr=subprocess.DEVNULL) == 0
    except OSError:
        return False


def _another() -> str:
    """Find a supported Python among the versioned names on PATH; empty when there is none."""
    for minor in range(NEWEST[1], OLDEST[1] - 1, -1):
        path = shutil.which(f'python3.{minor}')
        if path and _works(path):
            return path
    return ''


def _better_interpreter() -> str:
    """Return the interpreter that should run the set-up instead of this one; empty for none."""
    if sys.prefix != sys.base_prefix:
        base = getattr(sys, '_base_executable', sys.executable)
        if base == sys.executable:  # before Python 3.11
            base = os.path.realpath(sys.executable)
        if base != sys.executable and os.path.exists(base):  # noqa: PTH110
            return base
    return '' if OLDEST <= sys.version_info[:2] <= NEWEST else _another()


def _start() -> int:
    """Run the set-up in this Python, or in a better one."""
    if not sys.platform.startswith('linux'):
        sys.stderr.write('error: ROS 2 Jazzy has no packages for %s.\n' % sys.platform)  # noqa: UP031
        sys.stderr.write(
            '  Run this in Ubuntu 24.04: on Windows in WSL2, on a Mac in a virtual machine,\n'
            '  which on Apple silicon (arm64) needs ros-jazzy-ros-base from apt.\n'
        )
        return 1
    other = _better_interpreter()
    if other:
        os.execv(other, [other, '-m', 'workspace', *sys.argv[1:]])  # noqa: S606
    if not OLDEST <= sys.version_info[:2] <= NEWEST:
        sys.stderr.write(
            f'error: Python {sys.version_info[0]}.{sys.version_info[1]} is not supported.\n'
            f'  Install one of Python 3.{OLDEST[1]} to 3.{NEWEST[1]}, for example with\n'
            '    sudo apt-get install python3.12 python3.12-venv python3.12-dev\n'
            '  and run again; it is found by its name, or named with: make PYTHON=python3.12\n'
        )
        return 1
    from workspace.cli import main

    return main(sys.argv[1:])


if __name__ == '__main__':
    sys.exit(_start())
