# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The quick check of the search agrees with the distances of the scene."""

from __future__ import annotations

from model_robots import ready, robot
import numpy as np
from planning_scenes import with_box, with_random_boxes
import pytest

from arm_model import Clearances, CollisionObject, Mesh, Plane, PlanningScene
from arm_planning.free.motion_check import MotionCheck
from arm_planning.validity import MARGIN


def plane() -> PlanningScene:
    """The panda over a half-space, which has no box about it."""
    model = robot('panda')
    return model.scene.with_object(CollisionObject('ground', Plane(offset=-0.05)))


def hull() -> PlanningScene:
    """The panda beside a mesh."""
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (30, 3)) + np.array((0.5, 0.0, 0.5))
    return robot('panda').scene.with_object(CollisionObject('rock', Mesh(points)))


def carried() -> PlanningScene:
    """The panda with a box in its hand, among boxes."""
    model = robot('panda')
    at = tuple((model.pose(ready('panda')).position - np.array((0.0, 0.0, 0.1))).tolist())
    scene = with_box(with_random_boxes(model, 4, 3), 'load', (0.1, 0.1, 0.2), at)
    return scene.attached('load', model.tip, ready('panda'), touch_links=['panda_hand'])


@pytest.mark.parametrize('scene', [plane(), hull(), carried()], ids=['plane', 'hull', 'carried'])
def test_what_overlaps_is_not_free(scene: PlanningScene) -> None:
    """And what is farther apart than the margin is free, with the broad phase and without."""
    model, check, clearances = robot('panda'), MotionCheck(scene), Clearances(scene)
    touching = 0
    for refined in (False, True):
        if refined:
            check.refine()
        draw = np.random.default_rng(4)
        for state in draw.uniform(model.limits.lower, model.limits.upper, (150, 7)):
            distance = float(clearances.least(state, 2.0 * MARGIN).min())
            if distance < 0.0 or (refined and distance < 0.9 * MARGIN):
                assert not check.free(state)
                touching += 1
            elif distance > 1.1 * MARGIN:
                assert check.free(state)
    assert touching > 10
