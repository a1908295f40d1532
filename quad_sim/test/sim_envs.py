# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Environments for tests; other processes import them by the name of this module."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from quad_sim.env import Randomization, WalkingEnv


def varied(share: float) -> WalkingEnv:
    """Make an environment that differs by a share of all that may."""
    return WalkingEnv(randomization=Randomization().scaled(share), duration=0.2)


class Broken(WalkingEnv):
    """Fails at its third step, or ends its process."""

    def __init__(self, deadly: bool) -> None:
        super().__init__()
        self._deadly, self._done = deadly, 0

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Fail."""
        self._done += 1
        if self._done == 3:
            if self._deadly:
                os._exit(7)
            raise ValueError('the third step')
        return super().step(action)
