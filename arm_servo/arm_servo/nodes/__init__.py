# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes on the motion core; what they share with its cycle needs no ROS."""
