# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writes the scripts that set up a shell for the environment."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote

from .layout import write_atomically
from .underlay import Underlay, UnderlayKind

SHELLS = ('sh', 'bash', 'zsh')
_HEAD = '# Written by the set-up (tools/workspace/shell.py); sourced by env.sh\n'
_PREPEND = """\
_workspace_prepend() {
  eval "_workspace_old=\\${$1-}"
  case ":$_workspace_old:" in
    *":$2:"*) ;;
    *) eval "export $1=\\"\\$2\\${_workspace_old:+:\\$_workspace_old}\\"" ;;
  esac
}
"""
_UNSET = 'unset -f _workspace_prepend\nunset _workspace_old\n'
_DISCOVERY = """\
# a person's own choice counts; without one, DDS stays on this host
export ROS_AUTOMATIC_DISCOVERY_RANGE="${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}"
"""
# A ROS that was sourced before would be found first, and its libraries do not fit the wheels.
_LEAVE_SYSTEM_ROS = """\
case ":${AMENT_PREFIX_PATH:-}:" in
  *:/opt/ros/*)
    echo "env.sh: leaving the ROS that was sourced before (${ROS_DISTRO:-unknown})" >&2
    unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PYTHONPATH LD_LIBRARY_PATH
    ;;
esac
if [ "${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}" != rmw_fastrtps_cpp ]; then
  echo "env.sh: there is no $RMW_IMPLEMENTATION among the wheels, using rmw_fastrtps_cpp" >&2
  export RMW_IMPLEMENTATION=rmw_fastrtps_cpp
fi
"""
_FRONT_END = """\
#!{python} -S
\"\"\"The `ros2` command of this workspace, for a ROS that has none; written by the set-up.\"\"\"

import os
import sys

if {library!r} in os.environ.get('LD_LIBRARY_PATH', '').split(os.pathsep):
    sys.path.append({packages!r})
else:  # without env.sh; what `site` runs for other packages takes a tenth of a command's time
    import site

    site.main()
sys.path.insert(0, {folder!r})

from ros2_frontend.main import main

os._exit(main())  # the end of the interpreter would take 0.2 s
"""


def _prepend(*pairs: tuple[str, Path]) -> str:
    lines = (f'_workspace_prepend {name} {quote(str(path))}\n' for name, path in pairs)
    return f'{_PREPEND}{"".join(lines)}{_UNSET}'


def write_setup_scripts(venv: Path, underlay: Underlay, libraries: Sequence[Path]) -> None:
    """Write `local_setup.*` into the virtual environment, where colcon also searches for them.

    Args:
        venv: The virtual environment.
        underlay: The ROS installation below the workspace.
        libraries: Folders for the library path, if ROS comes from wheels.
    """
    path = ('PATH', venv / 'bin')
    wheels = [('AMENT_PREFIX_PATH', venv), ('CMAKE_PREFIX_PATH', venv)]
    wheels += [('LD_LIBRARY_PATH', folder) for folder in reversed(libraries)]
    for shell in SHELLS:
        if underlay.kind is UnderlayKind.SYSTEM:
            text = f'. {quote(str(underlay.prefix / f"setup.{shell}"))}\n{_prepend(path)}'
        else:
            text = f'{_LEAVE_SYSTEM_ROS}{_prepend(*wheels, path)}'
            text += 'export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3\n'
        text += f'export VIRTUAL_ENV={quote(str(venv))}\n'
        write_atomically(venv / f'local_setup.{shell}', f'{_HEAD}{text}{_DISCOVERY}')


def write_install_scripts(venv: Path, install: Path, python: Path) -> None:
    """Write the set-up scripts that colcon would write.

    Args:
        venv: The virtual environment.
        install: The installation prefix, on wheels.
        python: The folder of the Python modules.
    """
    names = ('AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH')
    folders = (('LD_LIBRARY_PATH', install / 'lib'), ('PYTHONPATH', python))
    text = f'{_HEAD}{_prepend(*((name, install) for name in names), *folders)}'
    for shell in SHELLS:
        write_atomically(install / f'local_setup.{shell}', text)
        both = (venv / f'local_setup.{shell}', install / f'local_setup.{shell}')
        sourced = ''.join(f'. {quote(str(path))}\n' for path in both)
        write_atomically(install / f'setup.{shell}', f'{_HEAD}{sourced}')


def write_front_end(venv: Path, underlay: Underlay, folder: Path) -> None:
    """Put our `ros2`, with its Python package in `folder`, on PATH unless ROS has its own."""
    command = venv / 'bin' / 'ros2'
    if underlay.kind is UnderlayKind.SYSTEM and underlay.has_command('ros2'):
        command.unlink(missing_ok=True)
        return
    found = (venv / 'lib').glob('python3*/site-packages')
    text = _FRONT_END.format(
        python=venv / 'bin' / 'python',
        library=str(venv / 'lib'),
        packages=str(next(found, venv)),
        folder=str(folder),
    )
    write_atomically(command, text, mode=0o755)
