# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""MoveIt's servo node: topics and services of moveit_servo on the motion core."""
