# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of operator_input.

::

    OperatorInputError
    ├── TerminalError (OSError)     there is no terminal to read keys from, or it is gone
    ├── DeviceError (OSError)       an input device cannot be opened or read
    ├── PresetError (ValueError)    no gamepad can be chosen by that preset or expression
    └── SettingError (ValueError)   settings make no sense together

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class OperatorInputError(Exception):
    """Root of all errors of this package."""


class TerminalError(OperatorInputError, OSError):
    """There is no terminal (service manager, pipe), or its window or SSH session has closed."""


class DeviceError(OperatorInputError, OSError):
    """An input device cannot be read: the user is not in the group input, or it was unplugged."""


class PresetError(OperatorInputError, ValueError):
    """A preset is misspelt (the message lists all), or an expression is malformed."""


class SettingError(OperatorInputError, ValueError):
    """Settings conflict, such as a shorter time-out for still sticks than for all others."""
