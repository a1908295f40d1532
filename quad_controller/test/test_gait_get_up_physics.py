# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robots that were dropped in physics get up, or say why not."""

from __future__ import annotations

from bench_get_up import get_up, Outcome, URDF
import numpy as np
import pytest
from search_get_up import clearance

from quad_controller.states.get_up_poses import RECOVERIES, Stage
from quad_controller.states.lying import Lying
from quad_sim.physics import Robot

pytestmark = pytest.mark.slow

DROPS = 5  # on each side
MIN_STOOD = 0.8  # of the robots; the bench has what it is with more of them


def outcomes(side: Lying) -> list[Outcome]:
    """Return what became of robots that came to rest on the side that they were dropped on."""
    found: list[Outcome] = []
    seed = 1000
    while len(found) < DROPS:
        outcome = get_up(seed, side, only=True)
        found += [outcome] if outcome.lay is side else []
        seed += 1
    return found


STAGES = [stage for tried in RECOVERIES.values() for recovery in tried for stage in recovery]


@pytest.mark.parametrize('stage', STAGES)
def test_no_pose_presses_a_leg_into_another_one(stage: Stage) -> None:
    """Nor a shank into the trunk; physics would let it pass."""
    assert clearance(Robot(URDF)._model, np.array(stage.legs).ravel()) > 0.005  # [m]


@pytest.mark.parametrize('side', [side for side in Lying if side is not Lying.BACK])
def test_most_robots_get_up(side: Lying) -> None:
    """Whatever their joints and the friction; those that do not say where they lie."""
    found = outcomes(side)
    assert sum(outcome.stood for outcome in found) >= MIN_STOOD * DROPS, found
    assert all('it lies' in outcome.words for outcome in found if not outcome.stood)


def test_on_the_back_nothing_is_tried() -> None:
    """It is refused at once, with what a person has to do."""
    for outcome in outcomes(Lying.BACK):
        assert not outcome.stood
        assert outcome.time == 0.0
        assert 'by hand' in outcome.words
