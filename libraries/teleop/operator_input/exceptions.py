# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that operator_input raises.

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
    """Started by a service manager or with a pipe; the window was closed, or SSH broke off."""


class DeviceError(OperatorInputError, OSError):
    """The user is not in the group input, or the device was unplugged."""


class PresetError(OperatorInputError, ValueError):
    """A preset is misspelt (the message lists what there is), or an expression malformed."""


class SettingError(OperatorInputError, ValueError):
    """Such as a time-out for still sticks that is shorter than the one for all others."""
