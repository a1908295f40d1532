# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whose drives a page may move, where several robots share a domain."""

from __future__ import annotations

import pytest

from robot_viewer.nodes.interfaces import of_robot

TOPICS = ['/robot_description', '/left/robot_description', '/tf', '/left/joint_states']
NODES = ['/joint1', '/left/joint1', '/left/wrist/joint2', '/leftover/joint1']


@pytest.mark.parametrize(
    ('namespace', 'nodes'),
    [
        ('', ['/joint1', '/leftover/joint1']),
        ('/left', ['/left/joint1', '/left/wrist/joint2']),
        ('/left/wrist', ['/left/wrist/joint2']),
        ('/right', []),
    ],
)
def test_a_node_is_of_the_robot_that_is_nearest(namespace: str, nodes: list[str]) -> None:
    """Also where that robot's description has not been seen yet."""
    assert of_robot(f'{namespace}/robot_description', TOPICS, NODES) == nodes
