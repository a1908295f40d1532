# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of quad_sim.

::

    SimulationError (RuntimeError)   the robot cannot be simulated, or became unstable
    ├── SetupError (ValueError)      an option of the simulated robot is wrong
    └── TargetError (ValueError)     servo targets are rejected; nothing moves
"""

from __future__ import annotations


class SimulationError(RuntimeError):
    """The robot cannot be simulated, or its simulation became unstable.

    Scenarios: MuJoCo is not installed, a servo far too stiff for the time step.
    """


class SetupError(SimulationError, ValueError):
    """An option of the simulated robot is wrong.

    Scenarios: a URDF without base_link, a link path that is a file, a rate of faults above one.
    """


class TargetError(SimulationError, ValueError):
    """Servo targets are rejected.

    Scenarios: NaN or infinite positions, a wrong number of joints, an unknown joint name.
    """
