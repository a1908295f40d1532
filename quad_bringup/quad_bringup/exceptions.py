# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_bringup raises.

::

    BringupError
    ├── ArgumentError (ValueError)   what was asked for cannot be brought up
    ├── CallError                    the controller refused, fell silent or is in a fault
    └── GivenUpError                 what is waited for is no longer wanted

What cannot be started is told by ``process_supervisor.StartError``. Arguments of the wrong kind
from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class BringupError(Exception):
    """Root of all errors of this package."""


class ArgumentError(BringupError, ValueError):
    """What was asked for cannot be brought up.

    Scenarios: a policy or calibration file that is not there, an unknown preset.
    """


class CallError(BringupError):
    """The controller refused, did not answer in time, or is in a fault.

    Scenarios: a mode that is not accepted says why, a robot that has fallen.
    """


class GivenUpError(BringupError):
    """What is waited for is no longer wanted.

    Scenarios: Ctrl-C, a process of the bring-up has ended.
    """
