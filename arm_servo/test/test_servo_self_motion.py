# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The elbow of a redundant arm does not swing while the tool is jogged."""

from __future__ import annotations

import numpy as np
import pytest
from servo_commands import Drives, twist

IN_PLANE = {
    'x': [0.12, 0.0, 0.0, 0.0, 0.0, 0.0],
    'z': [0.0, 0.0, 0.12, 0.0, 0.0, 0.0],
    'about y': [0.0, 0.0, 0.0, 0.0, 0.3, 0.0],
}
"""Twists for which the Panda's arm stays in the plane that it is in when it is ready."""
SIDEWAYS = [0, 2, 4, 6]  # joints that lead out of that plane


@pytest.mark.parametrize('pause', [0, 10, 13, 20], ids='pauses of {} cycles'.format)
@pytest.mark.parametrize('axis', IN_PLANE)
def test_a_jog_in_the_plane_of_the_arm_stays_in_it(axis: str, pause: int) -> None:
    """Steady or interrupted: where the acceleration of one joint is at its limit, all are slower.

    A swing would win back the last of the asked speed, and grow from rounding errors.
    """
    arm = Drives()
    arm.attach()
    arm.run(3)
    begin = arm.path[-1]
    for cycle in range(300):
        if not pause or (cycle // pause) % 2 == 0:
            twist(arm.gateway, IN_PLANE[axis], arm.now)
        arm.run()
    path = np.array(arm.path)
    assert np.abs(path[-1] - begin).max() > 0.1
    assert np.abs(path[:, SIDEWAYS] - begin[SIDEWAYS]).max() < 1e-3
