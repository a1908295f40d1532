# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the simulated robot raises, below the root of the package.

::

    HardwareError
    └── SimulationError (RuntimeError)   the robot cannot be simulated, or its physics blew up
        └── SetupError (ValueError)      an option of the simulated robot has no sense

A target that is no position raises the package's ``CommandError``.
"""

from __future__ import annotations

from ..exceptions import HardwareError


class SimulationError(HardwareError, RuntimeError):
    """The robot cannot be simulated, or its physics blew up.

    Scenarios: MuJoCo is not installed, a servo far too stiff for the time step.
    """


class SetupError(SimulationError, ValueError):
    """An option of the simulated robot has no sense.

    Scenarios: a URDF without base_link, a link path that is a file, a rate of faults above one.
    """
