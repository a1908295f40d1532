# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes around the motion core: servo_node, the trajectory controller, controller_manager."""
