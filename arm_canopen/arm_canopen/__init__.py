# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CANopen master, CiA 402 drives and simulated slaves for ROS 2."""
