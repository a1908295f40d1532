# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robots that were dropped in physics get up, or say why not."""

from __future__ import annotations

from itertools import combinations

from bench_get_up import fallen, get_up, MODEL, Outcome, URDF
import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from quad_controller import Controller, GaitParameters, StateParameters
from quad_controller.states.get_up import Lying, RECOVERIES, Stage
from quad_description import LEGS
from quad_sim.physics import Robot

pytestmark = pytest.mark.slow

DROPS = 5  # on each side
MIN_STOOD = 0.8  # of the robots; the bench has what it is with more of them


FAR = 0.05  # [m] a greater distance is of no interest


def clearance(model: mujoco.MjModel, pose: npt.NDArray[np.float64]) -> float:
    """Return the least distance of links of different legs, and of shanks from the trunk [m]."""
    data, points = mujoco.MjData(model), np.empty(6)
    for name, position in zip(MODEL.names, pose, strict=True):
        data.joint(name).qpos = position
    mujoco.mj_kinematics(model, data)
    links = {
        f'{leg}_{part}': int(model.body(f'{leg}_{part}').geomadr[0])
        for leg in LEGS
        for part in ('thigh', 'calf', 'foot')
    }
    trunk = int(model.body('base_link').geomadr[0])
    pairs = [
        (links[one], links[other]) for one, other in combinations(links, 2) if one[:2] != other[:2]
    ] + [(geom, trunk) for link, geom in links.items() if not link.endswith('thigh')]
    return min(float(mujoco.mj_geomDistance(model, data, *pair, FAR, points)) for pair in pairs)


def outcomes(side: Lying, servo: str = 'firm') -> list[Outcome]:
    """Return what became of robots that came to rest on the side that they were dropped on."""
    found: list[Outcome] = []
    seed = 1000
    while len(found) < DROPS:
        outcome = get_up(seed, side, only=True, servo=servo)
        found += [outcome] if outcome.lay is side else []
        seed += 1
    return found


RESTS = [
    stage
    for tried in RECOVERIES.values()
    for recovery in tried
    for stage in recovery
    if stage.duration is None
]


@pytest.mark.parametrize('stage', RESTS)
def test_no_pose_presses_a_leg_into_another_one(stage: Stage) -> None:
    """Nor a shank into the trunk; physics would let it pass."""
    assert clearance(Robot(URDF)._model, np.array(stage.legs).ravel()) > 0.005  # [m]


def test_no_swing_presses_a_leg_into_another_one() -> None:
    """From the first pose off the back, on the way that the joints really take."""
    backend = fallen(1000, Lying.BACK, 'firm')
    controller = Controller(MODEL, GaitParameters(), StateParameters(get_up_swings=True))
    state = backend.step(controller.step(backend.observe(), backend.period).targets)
    assert controller.set_mode('get_up').accepted
    first, *_, last = (np.array(stage.legs).ravel() for stage in RECOVERIES[Lying.BACK][0])
    least, swings = 1.0, False
    for _ in range(round(10.0 / backend.period)):
        targets = controller.step(state, backend.period).targets
        assert targets is not None
        state = backend.step(targets)
        swings = swings or np.allclose(targets, first)
        if swings:
            least = min(least, clearance(backend.robot._model, backend.robot.joint_positions))
        if np.allclose(targets, last):
            break
    assert swings
    assert 0.0 < least < 1.0  # [m]


@pytest.mark.parametrize('side', Lying)
def test_most_robots_get_up(side: Lying) -> None:
    """Whatever their joints and the friction; those that do not say where they lie."""
    nominal = side in {Lying.BELLY, Lying.LEFT, Lying.RIGHT, Lying.TAIL}
    found = outcomes(side, 'nominal' if nominal else 'firm')
    assert sum(outcome.stood for outcome in found) >= MIN_STOOD * DROPS, found
    assert all('it lies' in outcome.words for outcome in found if not outcome.stood)


def test_nominal_servos_are_too_weak_to_get_off_the_back() -> None:
    """It gives up in words; the swings were found for firm ones."""
    outcome = get_up(1000, Lying.BACK, only=True)
    assert not outcome.stood
    assert 'it lies on its back' in outcome.words
