# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_motion_bringup demo``: a simulated arm is jogged and follows trajectories."""
