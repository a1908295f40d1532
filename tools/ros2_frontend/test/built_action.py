# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An interface package with one action, built for the tests: the wheels have no action type."""

from __future__ import annotations

from collections.abc import Mapping
import hashlib
import os
from pathlib import Path
import subprocess
import sys
import sysconfig
import tempfile

PACKAGE = 'frontend_test_msgs'
TYPE = f'{PACKAGE}/action/Count'

_FILES = {
    'action/Count.action': 'int32 order\n---\nint32[] sequence\n---\nint32 step\n',
    'CMakeLists.txt': f"""\
cmake_minimum_required(VERSION 3.16)
project({PACKAGE})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(${{PROJECT_NAME}} "action/Count.action")
ament_package()
""",
    'package.xml': f"""\
<?xml version="1.0"?>
<package format="3">
  <name>{PACKAGE}</name>
  <version>0.0.0</version>
  <description>An action for tests</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>action_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
""",
}
_TOOLS = Path(__file__).parents[2]


def build(cache: Path) -> Path:
    """Build the package, unless the cache has it for this Python and this text.

    Args:
        cache: A folder that outlives the test run.

    Returns:
        The install prefix.
    """
    key = hashlib.sha256(repr((sys.version, sys.prefix, _FILES)).encode()).hexdigest()[:12]
    prefix = cache / key
    if not prefix.exists():
        with tempfile.TemporaryDirectory(dir=cache) as folder:
            _run_cmake(Path(folder))
            try:
                Path(folder, 'install').rename(prefix)
            except OSError:  # a suite side by side was faster
                if not prefix.exists():
                    raise
    return prefix


def _run_cmake(folder: Path) -> None:
    for name, text in _FILES.items():
        path = folder / 'source' / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    configure = [
        *('cmake', '-S', 'source', '-B', 'build', '-DCMAKE_INSTALL_PREFIX=install'),
        f'-DPython3_EXECUTABLE={sys.executable}',
        f'-DCMAKE_PROJECT_INCLUDE={_TOOLS}/cmake/c_type_support_only.cmake',
        '-Wno-dev',
    ]
    for command in (configure, ['cmake', '--build', 'build', '--target', 'install', '-j2']):
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f'{done.stdout}\n{done.stderr}')


def with_package(prefix: Path, env: Mapping[str, str]) -> dict[str, str]:
    """Return an environment in which the package can be imported.

    Args:
        prefix: Where it is installed.
        env: The environment to extend.

    Returns:
        The environment.
    """
    purelib = sysconfig.get_path('purelib', vars={'base': str(prefix)})
    additions = {
        'AMENT_PREFIX_PATH': prefix,
        'LD_LIBRARY_PATH': prefix / 'lib',
        'PYTHONPATH': purelib,
    }
    return {
        **env,
        **{name: f'{path}{os.pathsep}{env.get(name, "")}' for name, path in additions.items()},
    }
