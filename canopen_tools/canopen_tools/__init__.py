# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The `canopen` command, a decoding `candump`, EDS lint and DCF export; needs no ROS.

The names here are the public API.
"""

from canopen_core.can import read_log

from .eds_lint import EdsReport, lint_eds
from .monitor.describe import Description, FrameDescriber

__all__ = ['Description', 'EdsReport', 'FrameDescriber', 'lint_eds', 'read_log']
