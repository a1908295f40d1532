# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a viewer needs of a robot: /tf from its description and its joint positions.

:class:`StatePublisher` computes which transforms follow from a JointState, as ROS'
robot_state_publisher does. It knows no ROS; the nodes are in :mod:`.nodes`. Descriptions are read
by urdf_reader.
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
