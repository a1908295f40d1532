# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of commands: chains of TF, what is not connected, and what is no rotation."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pinocchio as pin
import pytest

from arm_servo.exceptions import CommandError
from arm_servo.model import Pose
from arm_servo.nodes.frame_tree import combined, FrameTree, inverse, rotation_of

ANGLES = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6)


def pose(numbers: list[float]) -> Pose:
    """Return the pose with a rotation vector and a position."""
    return Pose(pin.exp3(np.array(numbers[:3])), np.array(numbers[3:]))


@given(ANGLES, ANGLES, ANGLES)
def test_a_frame_is_found_up_and_down_the_tree(
    table: list[float], base: list[float], tool: list[float]
) -> None:
    """The pose of a frame on another branch is that through the common ancestor."""
    tree = FrameTree()
    tree.learn('table', 'world', pose(table), math.inf)
    tree.learn('base', 'world', pose(base), math.inf)
    tree.learn('cup', 'table', pose(tool), 5.0)
    found = tree.pose('cup', 'base', 5.5)
    assert found is not None
    wanted = combined(inverse(pose(base)), combined(pose(table), pose(tool)))
    assert found.position == pytest.approx(wanted.position, abs=1e-9)
    assert found.rotation == pytest.approx(wanted.rotation, abs=1e-9)


def test_what_is_old_or_not_connected_is_not_found() -> None:
    """A transform that nobody renews, another tree and a loop lead nowhere."""
    tree = FrameTree()
    still = pose([0.0] * 6)
    tree.learn('cup', 'base', still, 5.0)
    assert tree.pose('cup', 'base', 5.5) is not None
    assert tree.pose('cup', 'base', 7.0) is None
    tree.learn('a', 'b', still, math.inf)
    tree.learn('b', 'a', still, math.inf)
    assert tree.pose('a', 'base', 5.5) is None


@pytest.mark.parametrize(
    'numbers', [[0.0] * 4, [1.0, 1.0, 0.0, 0.0], [math.nan, 0.0, 0.0, 1.0], [math.inf] * 4]
)
def test_a_quaternion_that_is_none_is_refused(numbers: list[float]) -> None:
    """Its length is told."""
    with pytest.raises(CommandError, match='length'):
        rotation_of(numbers)
