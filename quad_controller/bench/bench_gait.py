#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a step of the quadruped's controller costs: gait, policy, and all of it, per step.

Each figure is the median and the 99th percentile of single steps in one thread, beside a fixed
amount of plain Python in the same run, to compare machines by. All are printed, none is judged.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from time import perf_counter

from quad_controller import (
    Controller,
    find_policy,
    GaitGenerator,
    GaitParameters,
    load_policy,
    PolicyOptions,
    ServoModel,
    StateParameters,
    Velocity,
)
from quad_controller.gait.body import UPRIGHT
from quad_controller.policy.observation import Situation
from quad_description import ImuSample, JointSample, quadruped, robot_urdf, RobotState

STEPS = 5000
PERIOD = 0.02  # [s]
VELOCITY = Velocity(0.2, 0.05, 0.3)
POLICY = find_policy('trot_imitation')
IMU = ImuSample((0.01, 0.0, 0.0, 1.0), (0.1, 0.0, 0.2), (0.0, 0.0, 9.81))


def report(title: str, step: Callable[[], object]) -> None:
    """Time a step many times and print what it costs."""
    for _ in range(200):
        step()
    times = []
    for _ in range(STEPS):
        start = perf_counter()
        step()
        times.append(perf_counter() - start)
    times.sort()
    median, late = times[STEPS // 2] * 1e6, times[STEPS * 99 // 100] * 1e6
    print(f'{title:36} {median:8.1f} us median {late:8.1f} us p99')


def main() -> None:
    """Entry point."""
    robot = quadruped(robot_urdf())
    report('1000 sines, for comparison', lambda: [math.sin(x) for x in range(1000)])
    gait = GaitGenerator(robot, GaitParameters())
    report('gait', lambda: gait.step(VELOCITY, UPRIGHT, (0.01, 0.0, 0.0), PERIOD))
    soft = GaitGenerator(robot, GaitParameters(servo=ServoModel()))
    report('gait, soft servos', lambda: soft.step(VELOCITY, UPRIGHT, (0.01, 0.0, 0.0), PERIOD))
    stand = gait.stand_targets
    joints = JointSample(stand, (0.0,) * len(stand))
    policy = load_policy(POLICY, robot, stand, PolicyOptions(), PERIOD).runner
    policy.reset(stand)
    seen = Situation(joints, IMU, VELOCITY)
    report('policy, 47-128-64-12', lambda: policy.step(seen, PERIOD))
    controller = Controller(robot, GaitParameters(), StateParameters())
    measurement = RobotState(joints, IMU, 0.8)
    controller.step(measurement, PERIOD)
    controller.set_mode('walk')
    for _ in range(100):
        controller.step(measurement, PERIOD)

    def step() -> None:
        controller.set_velocity(VELOCITY)
        controller.step(measurement, PERIOD)

    report('controller in WALK, watchdogs and all', step)


if __name__ == '__main__':
    main()
