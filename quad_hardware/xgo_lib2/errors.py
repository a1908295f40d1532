# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What xgo_lib2 raises.

::

    XgoError
    ├── XgoNotSupportedError   the robot, or its protocol, cannot do that
    └── XgoTimeoutError (TimeoutError)   the robot does not answer
"""

from __future__ import annotations


class XgoError(Exception):
    """Root of all errors of this package; also a port that is missing or was lost."""


class XgoNotSupportedError(XgoError):
    """The robot, or the protocol that it speaks, cannot do that."""


class XgoTimeoutError(XgoError, TimeoutError):
    """The robot does not answer."""
