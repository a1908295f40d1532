# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_bringup raises.

::

    BringupError
    └── ArgumentError (ValueError)   what was requested cannot be brought up

Errors of ``process_supervisor`` report what cannot be started, or refuses. Arguments of the wrong
kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class BringupError(Exception):
    """Root of all errors of this package."""


class ArgumentError(BringupError, ValueError):
    """What was requested cannot be brought up.

    Scenarios: a policy or calibration file that is not there, an unknown preset.
    """
