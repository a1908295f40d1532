# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What roboplan's Oink answers where a servo must not fail; arm_servo/README.md has the result.

Run: ``python arm_servo/bench/oink_study.py`` in the sourced workspace; it needs
roboplan-core and roboplan-oink.
"""

from __future__ import annotations

from collections import Counter
import time

import numpy as np
import pinocchio as pin
import roboplan.core as rc
import roboplan.optimal_ik as ro
from servo_arms import moved, ready, robot, ROBOTS, texts, TWISTS

from arm_model import Array

PERIOD = 0.005

STRAIGHT = {
    'panda': [0.0, 0.0, 0.0, -0.0698, 0.0, 1.0, 0.0],
    'prbt': [0.0] * 6,
    'gp110': [0.0] * 6,
}

CONTACT = {
    'panda': [-1.49, 1.32, 0.5, -2.3, -0.74, 1.21, 1.08],
    'prbt': [0.19, 1.58, -1.99, -1.55, -1.63, 0.08],
    'gp110': [1.62, 1.63, -1.11, -0.74, -1.63, -1.73],
}


class OinkServo:
    """A servo as one would write it first on Oink: a frame task, limits, a barrier."""

    def __init__(self, name: str) -> None:
        self.model = robot(name)
        urdf, srdf = texts(name)
        self.scene = rc.Scene(name, rc.loadUrdfSceneDescriptionFromXml(urdf))
        self.scene.importSrdf(srdf)
        self.oink = ro.Oink(self.scene, self.model.group)
        limits = self.model.limits
        self.limits = [
            ro.PositionLimit(self.oink, 1.0),
            ro.VelocityLimit(self.oink, PERIOD, np.array(limits.velocity)),
        ]
        options = ro.SelfCollisionBarrierOptions(
            n_collision_pairs=3, gain=4.0, safe_displacement_gain=0.0, d_min=0.01, d_max=0.15
        )
        self.barriers = [ro.SelfCollisionBarrier(self.oink, self.scene, PERIOD, options)]

    def step(self, positions: Array, target: Array) -> Array:
        """Return the change of the joints for a target of the tip (4, 4)."""
        pose = rc.CartesianConfiguration(self.model.base, self.model.tip, target)
        task = ro.FrameTask(self.oink, self.scene, pose, ro.FrameTaskOptions(lm_damping=0.0))
        change = np.zeros(len(self.model))
        self.oink.solveIk(
            positions, [task], self.limits, self.barriers, change, regularization=1e-9
        )
        return change


def jog(
    servo: OinkServo, start: Array, twist: Array, duration: float
) -> tuple[Array, Counter[str]]:
    """Jog open loop, and return where the joints end and what went wrong."""
    positions, troubles = np.array(start), Counter[str]()
    for _ in range(round(duration / PERIOD)):
        pose = servo.model.pose(positions)
        target = np.eye(4)
        target[:3, :3] = pin.exp3(twist[3:] * PERIOD) @ pose.rotation
        target[:3, 3] = pose.position + twist[:3] * PERIOD
        try:
            change = servo.step(positions, target)
        except RuntimeError as error:
            troubles[str(error)[:60]] += 1
            continue
        if np.any(np.abs(change) > servo.model.limits.velocity * PERIOD * 1.01):
            troubles['faster than the limit'] += 1
        positions = positions + change
    limits = servo.model.limits
    if np.any(positions > limits.upper + 1e-4) or np.any(positions < limits.lower - 1e-4):
        troubles['beyond a limit'] += 1
    return positions, troubles


def time_of_a_step(servo: OinkServo, start: Array) -> float:
    """Return the median time of a step in [s]."""
    target = np.eye(4)
    pose = servo.model.pose(start)
    target[:3, :3], target[:3, 3] = pose.rotation, pose.position + 1e-4
    times = []
    for _ in range(1000):
        begin = time.perf_counter()
        servo.step(start, target)
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def main() -> None:
    """Print what happens from each kind of pose."""
    for name in ROBOTS:
        servo = OinkServo(name)
        print(f'{name}: a step takes {1e6 * time_of_a_step(servo, np.array(ready(name))):.0f} us')
        beyond = np.array(ready(name))
        beyond[4] = servo.model.limits.upper[4] + 0.05
        starts = {
            'ready': ready(name),
            'straight': np.array(STRAIGHT[name]),
            'beyond a limit': beyond,
            'contact': np.array(CONTACT[name]),
        }
        for label, start in starts.items():
            along, aside, troubles = [], [], Counter[str]()
            for twist in TWISTS:
                end, trouble = jog(servo, np.array(start), twist, 0.8)
                axis = int(np.argmax(np.abs(twist)))
                by = moved(servo.model, np.array(start), end)
                along.append(by[axis] / (twist[axis] * 0.8))
                by[axis] = 0.0
                aside.append(float(np.abs(by[:3]).max()))
                troubles += trouble
            shares = ' '.join(f'{share:.2f}' for share in along)
            print(
                f'  {label:15} share moved {shares}; aside {1e3 * max(aside):.1f} mm; '
                f'{dict(troubles) or "no trouble"}'
            )


if __name__ == '__main__':
    main()
