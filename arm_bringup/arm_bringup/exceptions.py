# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that arm_bringup raises.

::

    BringupError
    ├── RobotError (ValueError)   a robot folder is unknown or incomplete; lists what there is
    ├── DescriptionError (ValueError)   a xacro file cannot be expanded, or its URDF is not usable
    └── WaveError (ValueError)    the wave cannot be planned within the limits of a joint

What cannot be started, or refuses, raises the errors of ``process_supervisor``. Arguments of
the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class BringupError(Exception):
    """Root of all errors of this package."""


class RobotError(BringupError, ValueError):
    """A robot folder is unknown or incomplete.

    Scenarios: a name misspelt, a folder without bus.yml, a bus.yml whose EDS is missing.
    """


class DescriptionError(BringupError, ValueError):
    """A xacro file cannot be expanded, or the URDF that it makes is not usable.

    Scenarios: malformed XML, an undefined xacro property, a movable joint without limits.
    """


class WaveError(BringupError, ValueError):
    """The wave cannot be planned within the limits of a joint.

    Scenarios: a joint's range is narrower than the margins, its velocity limit is zero.
    """
