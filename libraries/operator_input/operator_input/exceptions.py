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
    """There is no terminal to read keys from, or it is gone.

    Scenarios: started by a service manager or with a pipe, the window was closed, SSH broke off.
    """


class DeviceError(OperatorInputError, OSError):
    """An input device cannot be opened or read.

    Scenarios: the user is not in the group input, the device was unplugged.
    """


class PresetError(OperatorInputError, ValueError):
    """No gamepad can be chosen by preset or expression.

    Scenarios: a preset misspelt (the message lists what there is), a malformed expression.
    """


class SettingError(OperatorInputError, ValueError):
    """Settings make no sense together.

    Scenarios: a time-out for still sticks that is shorter than the one for all others.
    """
