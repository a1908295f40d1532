# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of xgo_lib2.

::

    XgoError
    ├── XgoNotSupportedError   the robot, or its protocol, cannot do that
    └── XgoTimeoutError (TimeoutError)   the robot does not answer
"""

from __future__ import annotations


class XgoError(Exception):
    """Root of all errors of this package; also raised for a missing or lost port."""


class XgoNotSupportedError(XgoError):
    """The robot or its protocol does not support the request."""


class XgoTimeoutError(XgoError, TimeoutError):
    """The robot does not answer."""
