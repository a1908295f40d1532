# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bridge to Foxglove: foxglove-sdk on one side, rclpy on the other."""


class BridgeError(Exception):
    """A bridge that cannot begin; the message has the remedy."""
