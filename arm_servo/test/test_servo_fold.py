# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From the border of its reach an arm comes back the way it went: its elbow keeps its side."""

from __future__ import annotations

import math

import core_commands
from model_robots import ready, robot, ROBOTS
import numpy as np
import pytest

from arm_servo import Cause, MotionCore, MotionReport

pytestmark = pytest.mark.slow

# place of the elbow, and the angle at which the arm is straight
ELBOW = {
    'panda': (3, -2.0 * math.atan2(0.0825, 0.35)),
    'prbt': (2, 0.0),
    'gp110': (2, math.pi / 2 - math.atan2(0.235, 1.02)),
}

STUCK = 0.05  # share of the asked speed below which the tool has come to its end


class Jogger:
    """Jogs the tool of an arm along a line."""

    def __init__(self, name: str, period: float, down: float) -> None:
        self.model, self.period, self.now = robot(name), period, 0.0
        self.core = MotionCore(self.model)
        self.core.reset(ready(name))
        self.report = MotionReport()
        self.begin = self.model.pose(ready(name)).position
        ahead = np.array([*self.begin[:2], 0.0]) / np.linalg.norm(self.begin[:2])
        self.line = math.cos(down) * ahead - np.array([0.0, 0.0, math.sin(down)])

    @property
    def way(self) -> float:
        """How far the tool is along the line in [m]."""
        place = self.model.pose(self.core.state.position).position
        return float((place - self.begin) @ self.line)

    def jog(self, speed: float) -> float:
        """Jog for a cycle; return the speed along the line in [m/s]."""
        core_commands.twist(self.core, [*(speed * self.line), 0.0, 0.0, 0.0], self.now)
        self.report = self.core.step(self.now, self.period).report
        self.now += self.period
        state = self.core.state
        return float((self.model.jacobian(state.position) @ state.velocity)[:3] @ self.line)

    def rest(self) -> None:
        """Release the keys until the arm rests."""
        for _ in range(round(1.0 / self.period)):
            self.core.step(self.now, self.period)
            self.now += self.period


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('down', [0.0, 0.3])
@pytest.mark.parametrize(('speed', 'hold'), [(0.2, 0.0), (0.3, 1.5)])
def test_an_arm_comes_back_from_the_border_on_the_same_side(
    name: str, down: float, speed: float, hold: float
) -> None:
    """Out to the border, pushing on or not, a rest, and all of the way back."""
    jogger = Jogger(name, 0.01, down)
    place, straight = ELBOW[name]
    side = np.sign(ready(name)[place] - straight)
    while jogger.jog(speed) > STUCK * speed or jogger.now < 0.5:
        if jogger.now > 12.0:
            break  # it slides along the border
    for _ in range(round(hold / jogger.period)):
        jogger.jog(speed)
    jogger.rest()
    out, deadline = jogger.way, jogger.now + 3.0 * jogger.way / speed + 5.0
    while jogger.way > 0.01 and jogger.now < deadline:
        jogger.jog(-speed)
    assert jogger.way <= 0.01, f'{out - jogger.way:.3f} of {out:.3f} m'
    assert side * (jogger.core.state.position[place] - straight) > 0.1


@pytest.mark.parametrize('name', ROBOTS)
def test_what_is_reported_at_the_border_is_what_happens(name: str) -> None:
    """Pushing on, the tool stands still, and the report says that nothing is left of its speed."""
    jogger = Jogger(name, 0.01, 0.0)
    while jogger.jog(0.1) > STUCK * 0.1 or jogger.now < 0.5:
        assert jogger.now < 30.0
    for _ in range(300):
        speed = jogger.jog(0.1)
    assert abs(speed) < 0.01
    lost = [each for each in jogger.report.limiters if each.cause is Cause.SINGULARITY]
    assert lost
    assert max(each.factor for each in lost) < 0.15
    assert jogger.report.factor < 0.15


@pytest.mark.parametrize('elbow', [1.30, 1.37, 1.42])
@pytest.mark.parametrize(
    'twist',
    [[0.04, 0, 0, 0, 0, 0], [0.16, 0, 0, 0, 0, 0], [0.4, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0.3, 0]],
)
def test_pushing_on_at_the_border_the_arm_rests(elbow: float, twist: list[float]) -> None:
    """Beside the straight pose and beyond it: it goes there, and does not hunt about it."""
    core = MotionCore(robot('gp110'))
    core.reset([0.0, 1.2, elbow, 0.0, -0.3, 0.0])
    places, period = [], 0.01
    for cycle in range(round(5.0 / period)):
        core_commands.twist(core, twist, cycle * period)
        core.step(cycle * period, period)
        if cycle * period > 3.5:
            places.append(core.state.position)
    assert np.ptp(np.array(places), axis=0).max() < 2e-3
