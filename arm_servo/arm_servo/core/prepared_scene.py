# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A planning scene as the core uses it: measured beside the cycle before the cycle takes it."""

from __future__ import annotations

from dataclasses import dataclass

from arm_model import Array, Clearances, PlanningScene
from arm_trajectory import PathCheck


@dataclass(frozen=True, slots=True, eq=False)
class PreparedScene:
    """What measures a scene: one thing for each thread."""

    version: int  # number of the scene; 0 is the robot alone
    clearances: Clearances  # of the cycle
    # looks for contact on paths, in the thread that prepares motions; None where nobody wants that
    check: PathCheck | None

    @classmethod
    def of(
        cls, scene: PlanningScene, version: int, *, near: Array | None, checks_paths: bool
    ) -> PreparedScene:
        """Prepare a scene.

        Args:
            near: Where the arm is in [rad]: every pair is measured there, so that the cycle has
                not to. None where that is not known.
        """
        clearances = Clearances(scene)
        if near is not None:
            clearances.least(near, 0.0)
        return cls(version, clearances, PathCheck(scene) if checks_paths else None)
