# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Distances that hold on from what was measured before are never too great."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import math
import sys

from model_robots import chain, chain_texts, robot, ROBOTS, two_arms
import numpy as np
import pytest

from arm_model import (
    Array,
    AttachedBody,
    Clearances,
    CollisionObject,
    Cone,
    Cylinder,
    Plane,
    Pose,
    RobotModel,
)
from arm_model.scene import clearances

ARMS = [*(robot(name) for name in ROBOTS), chain('zpyypz'), two_arms()]
"""The robots, a chain with sliding joints, and a tree."""

ROUNDING = 1e-4  # accuracy of a distance that was searched for from another begin in [m]


def among_things() -> RobotModel:
    """Return a chain between a table, an object, and one that it carries."""
    model = RobotModel(*chain_texts('zyyp'))
    place = Pose(np.eye(3), np.array([0.4, 0.0, 0.5]))
    cup = CollisionObject('cup', Cylinder(0.04, 0.1), pose=place)
    scene = model.scene.with_object(CollisionObject('table', Plane(offset=-0.1))).with_object(cup)
    tool = AttachedBody(CollisionObject('tool', Cone(0.05, 0.2)), 'link_4')
    model.use_scene(Clearances(scene.with_attached(tool)))
    return model


@pytest.mark.parametrize('model', [*ARMS, among_things()], ids=lambda model: model.name)
@pytest.mark.parametrize(('stride', 'at_once'), [(0.003, 100), (0.05, 0), (1.0, 0), (1.0, 100)])
def test_what_is_known_is_a_lower_bound_and_exact_where_it_matters(
    model: RobotModel, stride: float, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On random walks, for each pair at each step, also where spheres show what is far apart."""
    monkeypatch.setattr(clearances, 'AT_ONCE', at_once)
    rng = np.random.default_rng(5)
    lower, upper = np.maximum(model.limits.lower, -4.0), np.minimum(model.limits.upper, 4.0)
    at, within = (lower + upper) / 2.0, 0.05
    known = Clearances(model.scene)
    for _ in range(150):
        at = np.clip(at + stride * rng.uniform(-1.0, 1.0, len(at)), lower, upper)
        measured = Clearances(model.scene).least(at, math.inf)
        bounds = known.least(at, within)
        assert (bounds <= measured + ROUNDING).all()
        near = measured < within
        assert bounds[near] == pytest.approx(measured[near], abs=ROUNDING)


@pytest.mark.parametrize('model', ARMS, ids=lambda model: model.name)
def test_no_distance_changes_faster_than_its_bounds_say(model: RobotModel) -> None:
    """Gradients anywhere are at most the bounds of their rates."""
    rng = np.random.default_rng(6)
    lower, upper = np.maximum(model.limits.lower, -4.0), np.minimum(model.limits.upper, 4.0)
    bounds = Clearances(model.scene).distance_rate_bounds
    for _ in range(100):
        for near in model.nearest(rng.uniform(lower, upper), math.inf, len(model.pairs)):
            assert (np.abs(near.gradient) <= bounds[near.pair] + 1e-9).all()


def test_threads_that_ask_one_model_do_not_disturb_each_other() -> None:
    """Each gets the answers that it gets from a model of its own, however they take turns."""
    shared, places = robot('panda'), np.random.default_rng(7).uniform(0.0, 1.0, (4, 300, 7))

    def answers(model: RobotModel, at: Array) -> list[list[float]]:
        return [[near.distance for near in model.nearest(one, math.inf, 5)] for one in at]

    alone = [answers(robot('panda'), at) for at in places]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(len(places)) as threads:
            together = list(threads.map(lambda at: answers(shared, at), places))
    finally:
        sys.setswitchinterval(interval)
    assert together == alone
