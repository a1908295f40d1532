# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of commands: chains of TF, what is not connected, and what is no rotation."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast, TYPE_CHECKING

from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from model_robots import robot
import numpy as np
import pinocchio as pin
import pytest
from tf2_msgs.msg import TFMessage

from arm_model import combined, CommandError, inverse, Pose, rotation_of
from arm_model.ros import FrameTree, TfListener

if TYPE_CHECKING:
    from rclpy.node import Node

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
    """A transform that is not renewed, another tree and a loop lead nowhere."""
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
    """The message has its length."""
    with pytest.raises(CommandError, match='length'):
        rotation_of(numbers)


class TfNode:
    """What a TfListener needs of a node, with a clock of its own."""

    def __init__(self) -> None:
        self.subscribed: dict[str, Any] = {}

    def create_subscription(self, _kind: object, topic: str, take: object, _qos: object) -> None:
        """Remember it."""
        self.subscribed[topic] = take

    def get_clock(self) -> Any:
        """Return a clock that stands at 100 s."""
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=100_000_000_000))

    def publish(self, sec: int, x: float) -> None:
        """Publish where the cup is."""
        transform = TransformStamped(child_frame_id='cup')
        transform.header.frame_id = 'base_link'
        transform.header.stamp.sec = sec
        transform.transform.translation.x = x
        self.subscribed['/tf'](TFMessage(transforms=[transform]))


def test_transforms_that_come_late_or_are_no_numbers_do_not_count() -> None:
    """A frame is where a fresh message says; the stamp counts, not the arrival."""
    node = TfNode()
    frames = TfListener(cast('Node', node), robot('gp110').kinematics, base='base_link')
    with pytest.raises(CommandError, match="Unknown frame: 'cup'"):
        frames.pose('cup')
    node.publish(90, 0.1)
    with pytest.raises(CommandError, match=r"'cup' to frame 'base_link': .* 10\.0 s old"):
        frames.pose('cup')
    node.publish(100, 0.2)
    node.publish(100, math.nan)
    assert frames.pose('cup').position.tolist() == [0.2, 0.0, 0.0]
    node.publish(101, 0.3)  # of a clock a little ahead
    assert frames.pose('cup').position.tolist() == [0.3, 0.0, 0.0]


def test_a_world_that_tf_has_placed_is_no_other_name_of_the_root() -> None:
    """Also while its publisher pauses: the arm does not jump to another frame."""
    node, model = TfNode(), robot('gp110')
    frames = TfListener(
        cast('Node', node), model.kinematics, base='base_link', world_frames=['cup']
    )
    assert frames.link('cup') == model.kinematics.root
    node.publish(90, 0.1)
    assert frames.link('cup') is None
    with pytest.raises(CommandError, match=r'10\.0 s old'):
        frames.pose('cup')
