# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot's numbers: model/robot.yaml, which the xacro files read too."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

MODEL = Path(__file__).parent / 'model'
"""Folder with the xacro files and their numbers."""


@lru_cache(maxsize=1)
def robot_numbers() -> dict[str, Any]:
    """Return what robot.yaml says; one copy for everybody, nobody changes it."""
    with (MODEL / 'robot.yaml').open(encoding='utf-8') as file:
        numbers: dict[str, Any] = yaml.safe_load(file)
    return numbers
