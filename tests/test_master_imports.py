# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a master loads, in an interpreter of its own: each library is memory of every robot."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

FOREIGN = {'can', 'canopen', 'launch', 'lark', 'rich', 'rosidl_generator_py', 'scipy', 'xacro'}
"""Adapters of python-can, tools, terminals and descriptions; none is a master's business."""
MODEL = {'pinocchio'}
"""Of the arm, which one of the masters computes with."""

LOADED = """
import importlib, sys
importlib.import_module(sys.argv[1])
print(*{name.partition('.')[0] for name in sys.modules})
"""
CORE_LOADED = """
import importlib, pkgutil, sys
import arm_canopen
parts = [f'arm_canopen.{part}' for part in ('cia402', 'cia402.modes', 'config', 'master')]
importlib.import_module('arm_canopen.joints')
for part in (*parts, 'canopen_core.eds', 'canopen_core.standard'):
    package = importlib.import_module(part)
    for module in pkgutil.iter_modules(package.__path__, f'{package.__name__}.'):
        importlib.import_module(module.name)
print(*{name.partition('.')[0] for name in sys.modules})
"""


def libraries(program: str, *arguments: str) -> set[str]:
    """Return the top names of all modules after a program."""
    command = [sys.executable, '-c', program, *arguments]
    answer = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60.0)
    return set(answer.stdout.split())


@pytest.mark.parametrize(
    ('entry', 'unwanted'),
    [
        ('arm_canopen.nodes.master', FOREIGN | MODEL),
        ('arm_servo.ros.canopen_backend', FOREIGN),
    ],
)
def test_a_master_loads_nothing_that_it_does_not_use(entry: str, unwanted: set[str]) -> None:
    """NumPy is there, since rclpy.action and sensor_msgs import it for arrays in messages."""
    loaded = libraries(LOADED, entry)
    assert 'rclpy' in loaded
    assert not loaded & unwanted


def test_the_core_of_the_master_needs_neither_numpy_nor_ros() -> None:
    """NumPy comes with messages alone."""
    loaded = libraries(CORE_LOADED)
    assert 'arm_canopen' in loaded
    assert not loaded & (FOREIGN | MODEL | {'numpy', 'rclpy'})
