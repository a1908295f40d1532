# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes of robot_viewer.

Conventions: joint positions are the latest ones, in [rad] or [m] by joint name; times are on the
steady clock in [s]; `order` runs a function in the node's thread.
"""
