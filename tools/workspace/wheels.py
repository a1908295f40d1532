# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Patches the ROS wheels to fit this machine instead of the one that built them; idempotent."""

from __future__ import annotations

import json
from pathlib import Path
import re

from .layout import WorkspaceError, write_atomically
from .process import Runner

# exported by the wheels' CMake files, and absent on every other machine
_BUILDER_INCLUDE = re.compile(r'/opt/python/cp[\w.-]+/include/python3\.\d+t?')
_BUILDER_NUMPY = re.compile(
    r'/opt/python/cp[\w.-]+/lib/python3\.\d+t?/site-packages/numpy/_core/include'
)
BOOTSTRAP_FILE = 'ros_wheels_bootstrapper.pth'
# The wheels' own line starts every interpreter twice, and trusts a variable that another
# environment's interpreter may have set. Ours looks at what counts, the library path.
BOOTSTRAP_LINE = (
    "import os, sys; os.path.join(sys.prefix, 'lib') in "
    "os.environ.get('LD_LIBRARY_PATH', '').split(os.pathsep) or "
    "(os.environ.pop('_ROS_WHEELS_BOOTSTRAP_COMPLETE', None), "
    "__import__('ros_wheels_bootstrapper'))\n"
)

DDS_LIBRARIES = 'libfastrtps.so*'
# DomainParticipant::set_listener(listener), and the one with a mask beside it, wait seconds::max()
# for the callbacks that run. The wheels are built for a C library without a wait on the steady
# clock; what the compiler has in its place turns that into a time before 1970. The wait fails at
# once, again and again, and never gives up the lock that the callback waits for: a process that
# leaves the graph while it discovers another one hangs for good.
_FOREVER = (2**63 - 1).to_bytes(8, 'little')
_LONG_ENOUGH = (3600).to_bytes(8, 'little')  # [s]
_WAITS = re.compile(
    rb'(\x48\xba)(%b|%b)(\xe9.{4}\x90\x48\xb9)\2(\xe9.{4}\x90)' % (_FOREVER, _LONG_ENOUGH),
    re.DOTALL,
)
_STEADY_WAIT = b'\0pthread_cond_clockwait\0'  # what a library built for a newer one imports


def patch_cmake_text(text: str, include: str, numpy_include: str) -> str:
    """Replace the builder's include folders by those of this machine.

    Args:
        text: A CMake file.
        include: Folder of Python.h.
        numpy_include: Folder of numpy's headers.
    """
    return _BUILDER_NUMPY.sub(
        lambda _: numpy_include, _BUILDER_INCLUDE.sub(lambda _: include, text)
    )


def patch_cmake_files(prefix: Path, include: str, numpy_include: str) -> int:
    """Patch every CMake file of an installation.

    Args:
        prefix: The virtual environment.
        include: Folder of Python.h.
        numpy_include: Folder of numpy's headers.

    Returns:
        Number of changed files.
    """
    changed = 0
    for path in sorted((prefix / 'share').rglob('*.cmake')):
        text = path.read_text(encoding='utf-8', errors='surrogateescape')
        patched = patch_cmake_text(text, include, numpy_include)
        if patched != text:
            write_atomically(path, patched)
            changed += 1
    return changed


def patch_bootstrapper(site_packages: Path) -> None:
    """Patch ROS's module so that an interpreter with the library path starts only once."""
    path = site_packages / BOOTSTRAP_FILE
    if path.is_file() and path.read_text(encoding='utf-8') != BOOTSTRAP_LINE:
        write_atomically(path, BOOTSTRAP_LINE)


def patch_dds(libraries: Path) -> int:
    """Patch DDS so that a process can leave the graph while it discovers another one.

    Args:
        libraries: The folder of the libraries.

    Returns:
        Number of changed files.

    Raises:
        WorkspaceError: A library differs from those that this patch was made for.
    """
    changed = 0
    for path in sorted(libraries.glob(DDS_LIBRARIES)):
        code = path.read_bytes()
        if _STEADY_WAIT in code:
            continue
        patched, count = _WAITS.subn(rb'\1%b\3%b\4' % (_LONG_ENOUGH, _LONG_ENOUGH), code)
        if count != 1:
            raise WorkspaceError(
                f'{path} is not the Fast DDS that has to be patched',
                'Take the wheels that tools/requirements pins. If those are new, look whether '
                'set_listener of\nDomainParticipant still waits forever (workspace/wheels.py).',
            )
        if patched != code:
            write_atomically(path, patched, mode=path.stat().st_mode)
            changed += 1
    return changed


def library_folders(prefix: Path, site_packages: Path) -> list[Path]:
    """List the folders whose shared libraries the ROS extensions load."""
    return [prefix / 'lib', *sorted(site_packages.glob('ros_*.libs'))]


def patch(runner: Runner, prefix: Path, python: Path) -> list[Path]:
    """Make the wheels in a virtual environment fit this machine.

    Args:
        runner: Starts the interpreter.
        prefix: The virtual environment.
        python: Its interpreter.

    Returns:
        The folders for the library path.
    """
    answer = prefix / '.paths.json'
    code = (
        'import json, numpy, sys, sysconfig; json.dump([sysconfig.get_path("purelib"), '
        'sysconfig.get_path("include"), numpy.get_include()], open(sys.argv[1], "w"))'
    )
    runner.run('Asking the new environment for its paths', [python, '-c', code, answer])
    site_packages, include, numpy_include = json.loads(answer.read_text(encoding='utf-8'))
    patch_cmake_files(prefix, include, numpy_include)
    patch_bootstrapper(Path(site_packages))
    patch_dds(prefix / 'lib')
    return library_folders(prefix, Path(site_packages))
