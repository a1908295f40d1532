# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_bringup raises.

::

    BringupError
    └── ArgumentError (ValueError)   what was asked for cannot be brought up

What cannot be started, or refuses, is told by the errors of ``process_supervisor``. Arguments of
the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class BringupError(Exception):
    """Root of all errors of this package."""


class ArgumentError(BringupError, ValueError):
    """What was asked for cannot be brought up.

    Scenarios: a policy or calibration file that is not there, an unknown preset.
    """
