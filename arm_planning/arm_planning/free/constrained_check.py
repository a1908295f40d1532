# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last word on a free motion with path constraints: limits and contact, then constraints."""

from __future__ import annotations

from dataclasses import dataclass

from arm_model import Array
from arm_trajectory import Path

from ..constraints import ConstraintCheck
from ..validity import ValidityCheck, Violation


@dataclass(frozen=True, slots=True)
class ConstrainedCheck:
    """Checks paths; belongs to one thread."""

    validity: ValidityCheck  # limits and contact
    constraints: ConstraintCheck | None = None  # what holds everywhere; None for nothing

    def waypoints(self, places: Array) -> Violation | None:
        """Return what is wrong with the straight lines between places; None for nothing.

        Args:
            places: Joint positions in [rad] (m, n).
        """
        violation = self.validity.waypoints(places)
        if violation is None and self.constraints is not None:
            return self.constraints.lines(places)
        return violation

    def path(self, path: Path) -> Violation | None:
        """Return what is wrong with a path; None for nothing."""
        violation = self.validity.path(path)
        if violation is None and self.constraints is not None:
            return self.constraints.path(path)
        return violation
