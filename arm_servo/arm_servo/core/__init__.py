# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion core: one source moves an arm, within its limits and clear of contact; no ROS.

A :class:`MotionCore` belongs to the loop that steps it. Requests are prepared beside the cycle and
begun in it, by a :class:`CommandGateway` for any number of threads.
"""
