# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a Python interpreter is and has."""

from __future__ import annotations

from dataclasses import dataclass
import json
from pathlib import Path
import subprocess

from .errors import WorkspaceError

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


@dataclass(frozen=True, slots=True)
class Interpreter:
    """A Python interpreter outside of any virtual environment.

    Attributes:
        path: The program.
        version: Major and minor number.
        machine: Processor architecture, as the kernel names it.
        has_headers: Whether extensions can be compiled for it.
        has_venv: Whether it can make virtual environments with pip.
    """

    path: str
    version: tuple[int, int]
    machine: str
    has_headers: bool
    has_venv: bool

    @property
    def name(self) -> str:
        """Its versioned name, `python3.11`."""
        return f'python{self.version[0]}.{self.version[1]}'

    @property
    def of_the_system(self) -> bool:
        """Whether it came with the system, so that apt has its parts."""
        return Path(self.path).parent in {Path('/usr/bin'), Path('/bin')}


def probe(program: str) -> Interpreter:
    """Query an interpreter, by its path or a name on PATH.

    Raises:
        WorkspaceError: It cannot be started.
    """
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
