# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Battery, temperatures and overload of the simulated robot."""

from __future__ import annotations

import numpy as np

from quad_sim.board.power import Overload, OVERLOAD_TIME


def test_a_landing_foot_is_no_overload() -> None:
    """Moments of full torque do not count, however often they come; a servo that is held does."""
    overload = Overload(2)
    for _ in range(100):
        overload.advance(np.array([1.0, 0.2]), 0.1)
        overload.advance(np.array([0.3, 1.0]), 0.1)
        assert not overload.lasts
    for _ in range(round(OVERLOAD_TIME / 0.1) + 2):
        overload.advance(np.array([1.0, 0.0]), 0.1)
    assert overload.lasts
