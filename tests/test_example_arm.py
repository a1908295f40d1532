# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The example arm of arm_model is the Panda of arm_bringup."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from arm_model import example_files, RobotModel

TOOL = Path(__file__).parents[1] / 'arm_bringup' / 'tools' / 'make_example_arm.py'


def test_the_files_are_those_of_the_robot_folder() -> None:
    """Whoever changes robots/panda runs the tool that makes them."""
    spec = importlib.util.spec_from_file_location('make_example_arm', TOOL)
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    contents = tool.contents()
    assert set(contents) == set(example_files())
    for path, text in contents.items():
        assert path.read_text('utf-8') == text, f'run {TOOL}'


def test_it_is_an_arm_of_seven_joints() -> None:
    """As the READMEs take it."""
    model = RobotModel.from_files(*example_files())
    assert model.joints == tuple(f'panda_joint{number}' for number in range(1, 8))
