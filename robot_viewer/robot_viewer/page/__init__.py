# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page on which a robot is seen and moved; nothing in here knows ROS."""
