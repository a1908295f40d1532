# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Former names of the canopen_sim and canopen_tools programs, kept in arm_canopen."""

from __future__ import annotations

from importlib import import_module
import sys


def fake_slave() -> None:
    """Simulate one device: fake_slave of canopen_sim, by its former name."""
    _run('canopen_sim', 'nodes.fake_slave')


def fake_slaves() -> None:
    """Simulate all slaves of a bus.yml: fake_slaves of canopen_sim, by its former name."""
    _run('canopen_sim', 'nodes.fake_slaves')


def candump() -> None:
    """Decode and print the frames of a bus: candump of canopen_tools, by its former name."""
    _run('canopen_tools', 'candump')


def canopen() -> None:
    """Check, make and scan a bus: canopen of canopen_tools, by its former name."""
    _run('canopen_tools', 'cli.main')


def _run(package: str, module: str) -> None:
    try:
        program = import_module(f'{package}.{module}')
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        sys.exit(
            f'this program belongs to {package}, which is not installed; build it with '
            f'`colcon build --packages-up-to {package}`, or `pip install ./{package}`'
        )
    sys.exit(program.main())
