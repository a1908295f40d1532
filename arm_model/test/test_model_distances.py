# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Distances: what was measured holds on, and the compiled core agrees with coal."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
import logging
import math
from pathlib import Path
import sys
import tempfile

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain, chain_texts, ready, robot, ROBOTS, two_arms
import numpy as np
import pytest

import arm_model as am
from arm_model.scene import clearances, compiled

ARMS = [*(robot(name) for name in ROBOTS), chain('zpyypz'), two_arms()]
"""The robots, a chain with sliding joints, and a tree."""

SEARCHED = 1e-4  # accuracy of a distance that was searched for from another begin in [m]


def among_things() -> am.RobotModel:
    """Return a chain between a table, an object, and one that it carries."""
    model = am.RobotModel(*chain_texts('zyyp'))
    place = am.Pose(np.eye(3), np.array([0.4, 0.0, 0.5]))
    cup = am.CollisionObject('cup', am.Cylinder(0.04, 0.1), pose=place)
    scene = model.scene.with_object(
        am.CollisionObject('table', am.Plane(offset=-0.1))
    ).with_object(cup)
    tool = am.AttachedBody(am.CollisionObject('tool', am.Cone(0.05, 0.2)), 'link_4')
    model.use_scene(am.Clearances(scene.with_attached(tool)))
    return model


@pytest.mark.parametrize('model', [*ARMS, among_things()], ids=lambda model: model.name)
@pytest.mark.parametrize(('stride', 'at_once'), [(0.003, 100), (0.05, 0), (1.0, 0), (1.0, 100)])
def test_what_is_known_is_a_lower_bound_and_exact_where_it_matters(
    model: am.RobotModel, stride: float, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On random walks, for each pair at each step, also where spheres show what is far apart."""
    monkeypatch.setattr(clearances, 'AT_ONCE', at_once)
    rng = np.random.default_rng(5)
    lower, upper = np.maximum(model.limits.lower, -4.0), np.minimum(model.limits.upper, 4.0)
    at, within = (lower + upper) / 2.0, 0.05
    known = am.Clearances(model.scene)
    for _ in range(150):
        at = np.clip(at + stride * rng.uniform(-1.0, 1.0, len(at)), lower, upper)
        measured = am.Clearances(model.scene).least(at, math.inf)
        bounds = known.least(at, within)
        assert (bounds <= measured + SEARCHED).all()
        near = measured < within
        assert bounds[near] == pytest.approx(measured[near], abs=SEARCHED)


def test_threads_that_ask_one_model_do_not_disturb_each_other() -> None:
    """Each gets the answers that it gets from a model of its own, however they take turns."""
    shared, places = robot('panda'), np.random.default_rng(7).uniform(0.0, 1.0, (4, 300, 7))

    def answers(model: am.RobotModel, at: am.Array) -> list[list[float]]:
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


EXACT = 2e-5  # how far a distance may be below that of coal in [m]
ROUNDING = 1e-6  # how far it may be above that in [m]
PADDING = 0.02  # of a link in [m]

lengths = st.floats(0.02, 0.5)
solids = st.one_of(
    st.builds(am.Box, lengths, lengths, lengths),
    st.builds(am.Sphere, lengths),
    st.builds(am.Cylinder, lengths, lengths),
    st.builds(am.Capsule, lengths, lengths),
    st.builds(am.Cone, lengths, lengths),
    st.builds(am.Plane, st.tuples(lengths, lengths, lengths), st.floats(-1.5, -0.5)),
    st.integers(0, 99).map(lambda seed: am.Mesh(np.random.default_rng(seed).random((20, 3)))),
)
numbers = st.floats(-1.0, 1.0)
poses = st.builds(
    lambda turn, place: am.Pose(am.rotation_of(turn / np.linalg.norm(turn)), np.array(place)),
    st.tuples(numbers, numbers, numbers, st.just(1.0)),
    st.tuples(numbers, numbers, numbers),
)


def scene_with(shape: am.Shape, pose: am.Pose, name: str = 'panda') -> am.PlanningScene:
    """An arm beside an object, one of its links thicker than it is."""
    model = robot(name)
    scene = model.scene.with_object(am.CollisionObject('thing', shape, pose=pose))
    link = list(model.scene.link_shapes)[-1]
    return scene.with_contents(padding={link: PADDING})


def crowd(seed: int) -> am.PlanningScene:
    """An arm among many things and a cloud of cells; one link may touch one thing."""
    draw = np.random.default_rng(seed)
    shapes: list[am.Shape] = [am.Box(0.03, 0.05, 0.1), am.Sphere(0.03), am.Cylinder(0.02, 0.2)]
    shapes += [am.Cone(0.05, 0.1), am.Mesh(0.1 * draw.random((20, 3)))]
    cells = am.Cells(np.array(0.04 * (draw.integers(-30, 30, (50, 3)) + 0.5)), 0.04)
    things = {}
    for number, turn in enumerate(draw.normal(size=(24, 4))):
        place = am.Pose(am.rotation_of(turn / np.linalg.norm(turn)), draw.uniform(-1.2, 1.2, 3))
        shape = shapes[number % len(shapes)]
        things[f'thing{number}'] = am.CollisionObject(f'thing{number}', shape, pose=place)
    tilted = am.Pose(am.rotation_of((0.1, 0.2, 0.3, 0.927)), draw.normal(0.0, 0.1, 3))
    things['cells'] = am.CollisionObject('cells', cells, pose=tilted)
    scene = robot('panda').scene.with_contents(objects=things)
    return scene.allowing(list(scene.link_shapes)[-1], 'thing0')


def core(scene: am.PlanningScene) -> am.CompiledScene:
    """The compiled core of a scene; machines for tests have a compiler."""
    found = am.compiled_scene(scene)
    assert found is not None
    return found


@given(shape=solids, pose=poses, seed=st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_distances_are_those_of_coal(shape: am.Shape, pose: am.Pose, seed: int) -> None:
    """Never above, hardly below; what overlaps there has no distance here."""
    agrees_with_coal(scene_with(shape, pose), seed)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_distances_in_a_crowd_are_those_of_coal(seed: int) -> None:
    """Also where most shapes are not looked at one by one."""
    agrees_with_coal(crowd(seed), seed)


def agrees_with_coal(scene: am.PlanningScene, seed: int) -> None:
    """Compare the distances at a random place."""
    limits = robot('panda').limits
    place = np.random.default_rng(seed).uniform(limits.lower, limits.upper)
    results = am.Clearances(scene).measure(place, range(len(scene.pairs)))
    expected = np.array([results[pair].min_distance for pair in range(len(scene.pairs))])
    found, apart = core(scene).least(place, np.inf), expected > 0.0
    assert (found <= np.maximum(expected, 0.0) + ROUNDING).all()
    assert (found[apart] >= expected[apart] - EXACT).all()
    for within in (0.001, 0.1, 1.0):
        bounds = core(scene).least(place, within)
        assert (bounds <= np.maximum(expected, 0.0) + ROUNDING).all()
        assert (bounds[apart] >= np.minimum(expected[apart], within) - EXACT).all()
        assert core(scene).clear(place, within) == bool((found >= within).all())


@pytest.mark.parametrize(('link', 'moves'), [('panda_link8', True), ('panda_link0', False)])
def test_an_attached_octree_is_solid(link: str, *, moves: bool) -> None:
    """Also where it moves with its link: then coal measures, instead of the compiled core."""
    model, at = robot('panda'), ready('panda')
    elbow = model.scene.kinematics.link_pose('panda_link4', at)
    scan = am.CollisionObject('scan', am.Cells(np.zeros((1, 3)), 0.1), pose=elbow)
    scene = model.scene.with_object(scan).attached('scan', link, at)
    found = am.compiled_scene(scene)
    assert (found is None) is moves
    measured = found or am.Clearances(scene)
    assert measured.least(at, 1.0)[scene.pairs.index(('scan', 'panda_link4'))] <= 0.0


@pytest.fixture
def anew(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """A process that has not built the core."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    compiled.library.cache_clear()
    yield
    compiled.library.cache_clear()


@pytest.mark.usefixtures('anew')
@pytest.mark.parametrize(
    ('setting', 'value', 'warned'),
    [('CC', '/bin/false', 1), ('CC', '/nowhere/cc', 1), ('ARM_MODEL_COMPILED', '0', 0)],
)
def test_without_the_core_there_is_one_warning(
    setting: str,
    value: str,
    warned: int,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """And none where it is not wanted."""
    monkeypatch.setenv(setting, value)
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            assert am.compiled_scene(robot('panda').scene) is None
    assert len(caplog.records) == warned


@pytest.mark.usefixtures('anew')
def test_what_is_built_is_kept_and_what_is_damaged_is_built_again(tmp_path: Path) -> None:
    """One file, and nothing beside it; several threads build it once; a power failure cuts it."""
    with ThreadPoolExecutor(4) as threads:  # as plans of several groups
        found = list(threads.map(lambda _: core(robot('panda').scene), range(4)))
    assert len({id(scene.library) for scene in found}) == 1
    (folder,) = (tmp_path / 'arm_model').iterdir()
    (kept,) = folder.iterdir()
    assert kept.suffix == '.so'
    kept.unlink()  # it is loaded, and may not change
    kept.write_bytes(b'no library')
    compiled.library.cache_clear()
    core(robot('panda').scene)
    assert kept.stat().st_size > 1000


@pytest.mark.usefixtures('anew')
def test_a_cache_that_cannot_be_written_costs_no_speed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The core is built for this process alone, and nothing of it stays."""
    (tmp_path / 'arm_model').write_text('no folder', encoding='ascii')
    elsewhere = tmp_path / 'elsewhere'
    elsewhere.mkdir()
    monkeypatch.setattr(tempfile, 'tempdir', str(elsewhere))
    core(robot('panda').scene)
    assert not list(elsewhere.iterdir())
