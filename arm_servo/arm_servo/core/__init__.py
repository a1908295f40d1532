# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion core: one source moves an arm, within limits and without collision; no ROS.

A :class:`MotionCore` belongs to the loop that steps it. A :class:`CommandGateway` accepts requests
from any thread, prepares motions outside the cycle and starts them in the cycle.
"""
