# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes of robot_viewer.

Conventions: positions of joints are in [rad] or [m] by name, always the last ones, times on the
steady clock in [s]; `order` runs something in the thread of the node.
"""
