# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Adapters to ROS; nothing else in this package imports rclpy."""
