# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node foxglove_bridge: foxglove-sdk on one side, rclpy on the other."""
