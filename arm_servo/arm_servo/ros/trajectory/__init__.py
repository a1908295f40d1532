# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The trajectory controller: joint_trajectory_controller's action, topics and parameters."""
