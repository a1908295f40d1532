# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot to try things on: the Panda of this repository, installed with the package."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).with_name('panda')


class ArmFiles(NamedTuple):
    """The files of an arm, in the order of :meth:`.RobotModel.from_files`."""

    urdf: Path  # the description
    srdf: Path  # groups, named poses, pairs of links that may touch
    limits: Path  # limits of the joints, in the format of MoveIt's joint_limits.yaml


def example_files() -> ArmFiles:
    """Return the files of a Franka Emika Panda: 7 joints, a hand, capsules for its links."""
    return ArmFiles(FOLDER / 'panda.urdf', FOLDER / 'panda.srdf', FOLDER / 'limits.yaml')
