# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a Python interpreter is and has."""

from __future__ import annotations

from dataclasses import dataclass
import json
from pathlib import Path
import subprocess

from .errors import UnsupportedSystemError

_QUESTIONS = """
import importlib.util, json, os, platform, sys, sysconfig
path = getattr(sys, '_base_executable', None) or sys.executable
if sys.prefix != sys.base_prefix and path == sys.executable:  # before Python 3.11
    path = os.path.realpath(path)
print(json.dumps({
    'path': path,
    'version': sys.version_info[:2],
    'machine': platform.machine(),
    'has_headers': os.path.exists(os.path.join(sysconfig.get_path('include'), 'Python.h')),
    'has_venv': all(importlib.util.find_spec(name) for name in ('venv', 'ensurepip')),
}))
"""


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
    """Query an interpreter.

    Args:
        program: Path, or a name on PATH.

    Raises:
        UnsupportedSystemError: It cannot be started.
    """
    try:
        answer = subprocess.run(
            [program, '-c', _QUESTIONS], check=True, capture_output=True, text=True
        ).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        raise UnsupportedSystemError(
            f'{program} does not start.', 'Name another one, as in: make PYTHON=python3.12'
        ) from error
    facts = json.loads(answer)
    return Interpreter(
        path=facts['path'],
        version=(facts['version'][0], facts['version'][1]),
        machine=facts['machine'],
        has_headers=facts['has_headers'],
        has_venv=facts['has_venv'],
    )
