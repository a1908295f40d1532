# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_bringup demo``: a simulated quadruped walks, and a table of what it does."""
