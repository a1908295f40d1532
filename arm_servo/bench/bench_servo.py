# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of the servo, and beside them those of moveit_servo's documented algorithm.

Run: ``python arm_servo/bench/bench_servo.py [COMMANDS]`` in the sourced workspace.

For each robot: time of a cycle (twist to set-point, with limits, the three nearest pairs, jerk
limit and stop check), the tool's speed against the asked one, and the share of commands that got
stuck (less than a twentieth of the asked way in 1 s) on a random walk and from random poses.
"""

from __future__ import annotations

from dataclasses import dataclass, field
import os
import sys
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

from collections import deque
from functools import cache
import re

import numpy as np
import pinocchio as pin

from arm_bringup.robots import expand_xacro, installed_robots_folder
from arm_model import Array, frozen, load_limits, RobotModel
from arm_servo import CoreSettings, Execution, JogRequest, MotionCore, TwistCommand
from arm_servo.core.safety_filter import MovingArms
from arm_trajectory import GoalError, GoalPoint, PathCheck, TrajectoryGoal

ROBOTS = ('panda', 'prbt', 'gp110')

SPEED = frozen([0.1] * 3 + [0.3] * 3)  # speed of a command along each axis in [m/s] and [rad/s]


@cache
def texts(name: str) -> tuple[str, str]:
    """Return URDF and SRDF of a robot."""
    folder = installed_robots_folder() / name
    urdf = expand_xacro(folder / f'{name}.urdf.xacro')
    return urdf, (folder / f'{name}.srdf').read_text(encoding='utf-8')


@cache
def robot(name: str) -> RobotModel:
    """Build the main group of an installed robot folder, once for all."""
    return RobotModel(*texts(name), load_limits(installed_robots_folder() / name / 'limits.yaml'))


def two_pandas() -> list[RobotModel]:
    """Return two Pandas of one robot side by side, 0.8 m apart, which move by themselves."""
    table = load_limits(installed_robots_folder() / 'panda' / 'limits.yaml')
    descriptions, semantics, limits = [], [], dict[str, dict[str, float]]()
    for side, place in (('left', 0.4), ('right', -0.4)):
        urdf, srdf = (
            re.sub(r'"panda_', f'"{side}_', text.partition('<robot ')[2].partition('>')[2])
            .removesuffix('\n')
            .removesuffix('</robot>')
            for text in texts('panda')
        )
        descriptions.append(
            f'{urdf}<joint name="{side}_base" type="fixed"><origin xyz="0 {place} 0"/>'
            f'<parent link="base"/><child link="{side}_link0"/></joint>'
        )
        semantics.append(srdf)
        limits |= {name.replace('panda_', f'{side}_'): entry for name, entry in table.items()}
    whole = f'<robot name="two"><link name="base"/>{"".join(descriptions)}</robot>'
    groups = f'<robot name="two">{"".join(semantics)}</robot>'
    joints = {side: [f'{side}_joint{n}' for n in range(1, 8)] for side in ('left', 'right')}
    return [
        RobotModel(whole, groups, limits, f'{side}_arm', moved_by_others={other: joints[other]})
        for side, other in (('left', 'right'), ('right', 'left'))
    ]


def ready(name: str) -> Array:
    """Return the pose of a robot from which it can move in every direction."""
    return robot(name).poses['ready']


def moved_by(model: RobotModel, start: Array, end: Array) -> Array:
    """Return the twist of the tip from one place to another in unit time (6)."""
    before, after = model.pose(start), model.pose(end)
    angular = pin.log3(after.rotation @ before.rotation.T)
    return np.concatenate((after.position - before.position, angular))


LOWER, HARD_STOP, LEAVING = 17.0, 30.0, 2.0
PROBE = 0.01
PROXIMITY = 0.01  # [m]
MARGIN = 0.1  # [rad]
LATENCY = 0.1  # [s]


class MoveitServoModel:
    """Positions for twists by moveit_servo's documented algorithm (Jazzy); not its code.

    Modelled: the pseudo-inverse of the Jacobian, the scaling by its condition number with metres
    and radians mixed (slower from 17 on, half as strict when leaving, a halt at 30 both ways), the
    common factor for joint speeds, the exponential slowing near a collision and the halt in one,
    the margin at joint limits that halts all joints, and the latency of 100 ms. Parameters are the
    defaults.
    """

    def __init__(self, model: RobotModel, start: Array, period: float) -> None:
        self._model = model
        self._period = period
        self.position: Array = np.array(start)
        waiting = round(LATENCY / period)
        self._queue: deque[Array] = deque([self.position] * waiting, maxlen=waiting)

    def step(self, twist: Array) -> Array:
        """Advance by a cycle, and return the positions that are commanded now."""
        late = self._queue[0]
        self._queue.append(self._next(twist))
        return late

    def _next(self, twist: Array) -> Array:
        model, limits = self._model, self._model.limits
        jacobian = model.jacobian(self.position)
        change = np.linalg.pinv(jacobian) @ twist * self._period
        change *= self._singularity(jacobian, twist)
        excess = np.abs(change) / (limits.velocity * self._period)
        change /= max(1.0, float(excess.max()))
        distance = model.clearance(self.position)
        if distance <= 0.0:
            return self.position
        if distance < PROXIMITY:
            change *= np.exp(np.log(0.001) / PROXIMITY * (PROXIMITY - distance))
        after = self.position + change
        outward = ((after > limits.upper - MARGIN) & (change > 0)) | (
            (after < limits.lower + MARGIN) & (change < 0)
        )
        if not outward.any():
            self.position = after
        return self.position

    def _singularity(self, jacobian: Array, twist: Array) -> float:
        tool, values, joints = np.linalg.svd(jacobian)
        condition = values[0] / max(values[-1], 1e-12)
        if condition < LOWER:
            return 1.0
        if condition >= HARD_STOP:
            return 0.0
        direction = tool[:, len(values) - 1]
        probe = self.position + PROBE * joints[len(values) - 1]
        probed = np.linalg.svd(self._model.jacobian(probe))[1]
        if probed[0] / max(probed[-1], 1e-12) < condition:
            direction = -direction
        toward = float(direction @ twist) > 0
        upper = HARD_STOP if toward else LOWER + (HARD_STOP - LOWER) * LEAVING
        return max(0.0, 1.0 - float(condition - LOWER) / (upper - LOWER))


PERIOD = 0.01
STUCK = 0.05
CHECKS = 15


@dataclass
class Tally:
    """What became of commands."""

    commands: int = 0
    stuck: int = 0
    named: int = 0
    factors: list[float] = field(default_factory=list)

    def __str__(self) -> str:
        """Describe it in a few words."""
        share = 100.0 * self.stuck / max(self.commands, 1)
        return f'{self.stuck} of {self.commands} stuck ({share:.0f} %)'


def time_of_cycles(model: RobotModel) -> tuple[float, float]:
    """Return median and 99th percentile of the time of a jogging cycle in [us]."""
    core = MotionCore(model)
    core.reset(ready(model.name))
    times = []
    for cycle in range(4000):
        now = cycle * 0.002
        sense = (-1) ** (cycle // 250)
        jog(core, sense * np.array([0.05, 0.03, 0.0, 0.0, 0.0, 0.1]), now, 0.1)
        begin = time.perf_counter()
        core.step(now, 0.002)
        times.append(time.perf_counter() - begin)
    median, late = np.percentile(times, [50, 99])
    return 1e6 * float(median), 1e6 * float(late)


def time_of_two_arms(turn: float, *, apart: bool) -> tuple[float, float]:
    """Return median and 99th percentile of the time of a cycle of one of two arms in [us].

    Both are jogged, back and forth, each tool along and across the line between them.
    """
    models = two_pandas()
    cores, times = [MotionCore(model) for model in models], []
    moving = MovingArms(models)
    for core, model, sense in zip(cores, models, (-1.0, 1.0), strict=True):
        if apart:
            core.keep_apart(moving.neighbours(model.joints))
        start = np.array(model.poses['ready'])
        start[0] += sense * turn
        core.reset(start)
    for cycle in range(2000):
        now = cycle * 0.002
        sense = (-1) ** (cycle // 250)
        for core, side in zip(cores, (-1.0, 1.0), strict=True):
            jog(core, sense * side * np.array([0.02, 0.1, 0.0, 0.0, 0.0, 0.1]), now, 0.1)
            begin = time.perf_counter()
            core.step(now, 0.002)
            times.append(time.perf_counter() - begin)
    median, late = np.percentile(times, [50, 99])
    return 1e6 * float(median), 1e6 * float(late)


def jog(core: MotionCore, twist: Array, now: float, duration: float) -> None:
    """Move the tool at a speed for a time."""
    core.apply(JogRequest(TwistCommand(twist), now + duration), now)


def ours(core: MotionCore, twist: Array) -> tuple[float, bool]:
    """Carry out a command for 1 s: the share of the asked way, and whether a cause was named."""
    model, start = core.model, core.state.position
    jog(core, twist, 0.0, 1.0)
    named = False
    for cycle in range(round(1.0 / PERIOD)):
        named |= bool(core.step(cycle * PERIOD, PERIOD).report.limiters)
    return share(model, start, core.state.position, twist), named


def theirs(model: RobotModel, start: Array, twist: Array) -> tuple[float, Array]:
    """Carry out a command for 1 s with the model of moveit_servo, after its latency."""
    servo = MoveitServoModel(model, start, PERIOD)
    end = start
    for _ in range(round(1.1 / PERIOD)):
        end = servo.step(twist)
    return share(model, start, end, twist), end


def share(model: RobotModel, start: Array, end: Array, twist: Array) -> float:
    """Return the share of the asked way that was moved."""
    scale = 1.0 / SPEED
    moved = moved_by(model, start, end) * scale
    asked = twist * scale
    return float(moved @ asked / (asked @ asked))


def count(tally: Tally, moved: float, named: bool = False) -> None:
    """Count a command."""
    tally.commands += 1
    tally.stuck += moved < STUCK
    tally.named += moved < STUCK and named


def random_twist(rng: np.random.Generator) -> Array:
    """Return a twist along an axis, or across three."""
    if rng.random() < 0.5:
        sense = 1.0 if rng.random() < 0.5 else -1.0
        one: Array = sense * SPEED * np.eye(6)[rng.integers(6)]
        return one
    across: Array = SPEED * rng.normal(size=6)
    return across


def walk(model: RobotModel, commands: int) -> tuple[Tally, Tally]:
    """Give both the same commands one after the other, each going on from where it is."""
    rng, here, there = np.random.default_rng(1), Tally(), Tally()
    core = MotionCore(model)
    core.reset(ready(model.name))
    position = np.array(ready(model.name))
    for _ in range(commands):
        twist = random_twist(rng)
        count(here, *ours(core, twist))
        moved, position = theirs(model, position, twist)
        count(there, moved)
    return here, there


def from_random_poses(model: RobotModel, commands: int) -> tuple[Tally, Tally]:
    """Give both the same command from the same random pose that is free of contact."""
    rng, here, there = np.random.default_rng(2), Tally(), Tally()
    lower = np.maximum(model.limits.lower, -np.pi)
    upper = np.minimum(model.limits.upper, np.pi)
    core = MotionCore(model)
    while here.commands < commands:
        start = rng.uniform(lower, upper)
        if model.clearance(start) < 0.01:
            continue
        twist = random_twist(rng)
        core.reset(start)
        count(here, *ours(core, twist))
        count(there, theirs(model, start, twist)[0])
    return here, there


def speed_error(model: RobotModel) -> tuple[float, int]:
    """Return how far the tool's speed is off at most, as a share, and on how many axes.

    It is looked at where nothing limits the motion.
    """
    worst, counted = 0.0, 0
    for axis in range(6):
        core = MotionCore(model)
        core.reset(ready(model.name))
        twist = 0.3 * SPEED * np.eye(6)[axis]
        jog(core, twist, 0.0, 1.0)
        point = core.step(0.0, PERIOD)
        for cycle in range(1, 60):
            point = core.step(cycle * PERIOD, PERIOD)
        if point.report.limiters:
            continue
        counted += 1
        achieved = model.jacobian(point.state.position) @ point.state.velocity
        worst = max(worst, float(np.abs(achieved - twist).max() / np.abs(twist).max()))
    return worst, counted


def time_of_check(model: RobotModel) -> tuple[float, int]:
    """Return the median time of the search for collisions on 10 s of motion in [ms].

    The trajectories go from random point to random point, at half of the joints' speed. Beside it
    is the number of those that are free to their end.
    """
    rng, free = np.random.default_rng(4), 0
    times: list[float] = []
    check, limits = PathCheck(model.scene), model.limits
    lower, upper = np.maximum(limits.lower, -2.5), np.minimum(limits.upper, 2.5)
    while len(times) < CHECKS:
        at, time_of, points = np.array(ready(model.name)), 0.0, []
        while time_of < 10.0:
            to = np.clip(at + rng.uniform(-0.8, 0.8, len(at)), lower, upper)
            time_of += max(1.0, 2.0 * float(np.max(np.abs(to - at) / limits.velocity)))
            points.append(GoalPoint(time_of, to.tolist(), [0.0] * len(at)))
            at = to
        core = MotionCore(model, CoreSettings(check_self_collision=False))
        core.reset(ready(model.name))
        try:
            motion = core.plan(TrajectoryGoal(model.joints, points), core.basis)
        except GoalError:
            continue  # too fast somewhere
        assert isinstance(motion, Execution)
        path = motion.path
        begin = time.perf_counter()
        found = check.contact(path.positions, path.duration)
        times.append((time.perf_counter() - begin) * 10.0 / (found.time if found else 10.0))
        free += found is None
    return 1e3 * float(np.median(times)), free


def main() -> None:
    """Print the figures."""
    commands = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    for name in ROBOTS:
        model = robot(name)
        median, late = time_of_cycles(model)
        print(f'{name} ({len(model)} joints)')
        print(f'  cycle                p50 {median:.0f} us, p99 {late:.0f} us (goal: p50 200 us)')
        error, axes = speed_error(model)
        print(
            f'  speed of the tool    off by {100 * error:.2f} % at most (goal: 1 %)'
            f' on the {axes} of 6 axes that nothing limits'
        )
        check, free = time_of_check(model)
        print(
            f'  collisions on 10 s   {check:.0f} ms beside the cycle; {free} of {CHECKS} ways free'
        )
        for label, run in (('random walk', walk), ('random poses', from_random_poses)):
            here, there = run(model, commands)
            print(f'  {label:20} {here}, {here.named} of them named; moveit_servo: {there}')
    places = {'far apart': 0.0, 'near each other': 0.75, 'held up by each other': 0.9}
    for label, turn in places.items():
        alone, late_alone = time_of_two_arms(turn, apart=False)
        median, late = time_of_two_arms(turn, apart=True)
        print(f'two Pandas that jog, {label}')
        print(
            f'  cycle of one         p50 {median:.0f} us, p99 {late:.0f} us;'
            f' without heed of the other {alone:.0f} us, {late_alone:.0f} us'
        )


if __name__ == '__main__':
    main()
