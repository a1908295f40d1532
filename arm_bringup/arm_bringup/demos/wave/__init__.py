# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup demo``: a simulated arm that waves, and a table of what it does."""
