# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Compute /tf from a robot description and joint positions, for viewers.

:class:`StatePublisher` computes the transforms for a JointState, as ROS'
robot_state_publisher does. It needs no ROS; the nodes are in :mod:`.nodes`. urdf_reader parses
the descriptions.
"""

from .state_publisher import (
    FrameTransform,
    MessageProblem,
    Settings,
    StatePublisher,
)

__version__ = '0.1.0'

__all__ = [
    'FrameTransform',
    'MessageProblem',
    'Settings',
    'StatePublisher',
]
