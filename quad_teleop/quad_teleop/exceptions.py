# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_teleop raises.

::

    TeleopError
    ├── SettingError (ValueError)   a parameter is misspelt, or its value makes no sense
    └── CommandError (ValueError)   a velocity is not finite

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class TeleopError(Exception):
    """Root of all errors of this package."""


class SettingError(TeleopError, ValueError):
    """Such as a priority above 255, two sources on one topic, a speed above its limit."""


class CommandError(TeleopError, ValueError):
    """Such as NaN from a planner that divided by zero."""
