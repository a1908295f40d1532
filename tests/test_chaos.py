# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An arm and a quadruped in motion get over disturbances: killed, stopped, a bad line, a full CPU.

``make chaos`` does all of them for longer, in an order and at moments of chance.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from chaos_arm import ArmVictim
from chaos_quad import QuadVictim
from disturbance import draw, run
import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from isolation import Isolation

pytestmark = [pytest.mark.scenario, pytest.mark.timeout(400)]

SEED = 145
"""Frames doubled and lost, a killed master; a bridge that is stopped, and noise. The others are
killed in test_arm_faults and test_quad_faults."""


@pytest.mark.parametrize(('robot', 'events'), [(ArmVictim, 3), (QuadVictim, 2)])
def test_nothing_moves_unasked_and_all_recovers(
    isolation: Isolation, tmp_path: Path, robot: type[ArmVictim | QuadVictim], events: int
) -> None:
    """No set-point leaves limits, every stop is named, and it works again."""
    with robot(isolation, tmp_path, SEED) as victim:
        report = run(victim, itertools.islice(draw(victim, SEED), events))
    assert not report.violations, '\n'.join(report.violations)
    assert len(report.events) == events, report.events
