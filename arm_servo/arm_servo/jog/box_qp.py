# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A small quadratic program with bounds and rows, solved by daqp."""

from __future__ import annotations

from dataclasses import dataclass
import math

import daqp
import numpy as np

from arm_model import Array

OPTIMAL = 1  # exit flag of daqp
FREE = 1e30  # what daqp takes for no bound


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """Minimise x'Hx/2 + g'x with lower <= x <= upper and rows x >= least."""

    hessian: Array  # H, positive definite (n, n)
    gradient: Array  # g (n)
    lower: Array  # least values (n)
    upper: Array  # greatest values (n)
    rows: Array  # rows (m, n); m may be 0
    least: Array  # least values of the rows (m)

    def solve(self) -> Solution | None:
        """Return the answer; None when there is none."""
        above = np.concatenate((self.upper, np.full(len(self.least), FREE)))
        below = np.concatenate((self.lower, self.least))
        values, _, flag, info = daqp.solve(self.hessian, self.gradient, self.rows, above, below)
        if flag != OPTIMAL or not math.isfinite(values.sum()):
            return None
        within = np.minimum(np.maximum(values, self.lower), self.upper)
        return Solution(within, np.array(info['lam']))


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Answer of a program."""

    values: Array  # the variables (n)
    # how hard each bound (n), then each row (m) presses: above zero where the upper bound presses,
    # below zero where the lower one does, zero where none does
    forces: Array
