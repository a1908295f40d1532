# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of quad_teleop.

::

    TeleopError
    ├── SettingError (ValueError)   a parameter is misspelt, or its value is invalid
    └── CommandError (ValueError)   a velocity is not finite

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class TeleopError(Exception):
    """Root of all errors of this package."""


class SettingError(TeleopError, ValueError):
    """Invalid settings: a priority above 255, two sources on one topic, an excessive speed."""


class CommandError(TeleopError, ValueError):
    """A velocity is not finite, such as NaN from a planner's division by zero."""
