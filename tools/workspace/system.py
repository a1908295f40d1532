# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks the system requirements before anything is installed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import json
from pathlib import Path
import shutil
import subprocess

from .interfaces import COMPILERS
from .layout import WorkspaceError
from .underlay import PREFIX_VARIABLE, SYSTEM_PREFIX, Underlay, UnderlayKind

_QUESTIONS = """
import importlib.util, json, os, platform, sys, sysconfig
path = getattr(sys, '_base_executable', None) or sys.executable
if sys.prefix != sys.base_prefix and path == sys.executable:  # before Python 3.11
    path = os.path.realpath(path)
print(json.dumps([
    path,
    sys.version_info[:2],
    platform.machine(),
    os.path.exists(os.path.join(sysconfig.get_path('include'), 'Python.h')),
    all(importlib.util.find_spec(name) for name in ('venv', 'ensurepip')),
]))
"""  # the fields of Interpreter in their order

PYTHON_OLDEST = (3, 10)
PYTHON_NEWEST = (3, 14)
WHEEL_MACHINE = 'x86_64'  # the wheels exist for no other
# any one of the programs does; the apt package that brings the usual one
PROGRAMS: tuple[tuple[tuple[str, ...], str], ...] = (
    (COMPILERS, 'g++'),
    (('git',), 'git'),
)
# of the system's ROS, what the packages and their build use directly
SYSTEM_ROS_PACKAGES: tuple[str, ...] = (
    'ament_cmake',
    'diagnostic_msgs',
    'geometry_msgs',
    'rclpy',
    'rosidl_default_generators',
    'sensor_msgs',
    'std_msgs',
    'std_srvs',
    'trajectory_msgs',
)


@dataclass(frozen=True, slots=True)
class Interpreter:
    """A Python interpreter outside of any virtual environment."""

    path: str  # the program
    version: tuple[int, int]  # major and minor number
    machine: str  # processor architecture, as the kernel names it
    has_headers: bool  # whether extensions can be compiled for it
    has_venv: bool  # whether it can make virtual environments with pip

    @property
    def name(self) -> str:
        """Versioned name, such as `python3.11`."""
        return f'python{self.version[0]}.{self.version[1]}'

    @property
    def of_the_system(self) -> bool:
        """Whether it belongs to the system, so that apt has its parts."""
        return Path(self.path).parent in {Path('/usr/bin'), Path('/bin')}


def probe(program: str) -> Interpreter:
    """Query an interpreter, by its path or its name on PATH."""
    try:
        answer = subprocess.run(
            [program, '-c', _QUESTIONS], check=True, capture_output=True, text=True
        ).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        raise WorkspaceError(
            f'{program} does not start.', 'Name another one, as in: make PYTHON=python3.12'
        ) from error
    path, (major, minor), *rest = json.loads(answer)
    return Interpreter(path, (major, minor), *rest)


def check_supported(underlay: Underlay, python: Interpreter, root: Path) -> None:
    """Reject an unsupported machine, Python or checkout location that this set-up cannot fix."""
    if any(character.isspace() for character in str(root)):
        raise WorkspaceError(
            f'The path of the checkout has a space in it: {root}',
            'CMake rules of ROS break on that. Move the checkout and run again.',
        )
    if not PYTHON_OLDEST <= python.version <= PYTHON_NEWEST:
        raise WorkspaceError(
            f'Python {python.version[0]}.{python.version[1]} ({python.path}) is not supported.',
            f'Name one of Python 3.{PYTHON_OLDEST[1]} to 3.{PYTHON_NEWEST[1]}, '
            'as in: make PYTHON=python3.12',
        )
    if underlay.python_name not in {None, python.name}:
        raise WorkspaceError(
            f'{underlay.prefix} is built for {underlay.python_name}, not for {python.name}.',
            f'Run again without PYTHON=..., or with an empty {PREFIX_VARIABLE} to use the wheels.',
        )
    if underlay.kind is UnderlayKind.WHEELS and python.machine != WHEEL_MACHINE:
        raise WorkspaceError(
            f'There are no ROS wheels for {python.machine}, and no {SYSTEM_PREFIX}.',
            'On Ubuntu 24.04 install ROS 2 Jazzy (package ros-jazzy-ros-base) and run again;\n'
            f'a ROS in another folder is named with {PREFIX_VARIABLE}.',
        )


def _python_packages(python: Interpreter) -> list[str]:
    """Return the apt packages that an interpreter needs; reject one unknown to apt."""
    missing = [
        f'{python.name}-{part}'
        for part, present in (('venv', python.has_venv), ('dev', python.has_headers))
        if not present
    ]
    if missing and not python.of_the_system:
        parts = ' and '.join(part.rpartition('-')[2] for part in missing)
        raise WorkspaceError(
            f'{python.path} was installed without {parts} (venv with pip, or the C headers).',
            'Install it completely, or name another one, as in: make PYTHON=/usr/bin/python3',
        )
    return missing


def missing_packages(
    underlay: Underlay,
    python: Interpreter,
    which: Callable[[str], str | None] = shutil.which,
) -> tuple[str, ...]:
    """Return all missing apt packages; `which` finds a program on PATH."""
    missing = [package for names, package in PROGRAMS if not any(map(which, names))]
    missing += _python_packages(python)
    if underlay.kind is UnderlayKind.SYSTEM:
        missing += [
            f'ros-jazzy-{name.replace("_", "-")}'
            for name in SYSTEM_ROS_PACKAGES
            if not underlay.has_package(name)
        ]
    return tuple(missing)


def check(underlay: Underlay, python: Interpreter, root: Path) -> None:
    """Reject a system that lacks requirements; the error names all.

    Raises:
        WorkspaceError: It is not supported, or packages have to be installed.
    """
    check_supported(underlay, python, root)
    missing = missing_packages(underlay, python)
    if missing:
        count = 'package is' if len(missing) == 1 else 'packages are'
        raise WorkspaceError(
            f'{len(missing)} system {count} missing.',
            f'Install with:\n  sudo apt-get install {" ".join(missing)}\nand run again.',
        )
