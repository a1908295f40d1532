# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A scene of 100 boxes on its way to the servo: until it is ready for the cycle, and in the cycle.

Run: ``python arm_servo/bench/bench_scene.py`` in the sourced workspace.

Times are those of the processor, so that other programs do not count.
"""

from __future__ import annotations

from collections.abc import Callable
import os
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

from geometry_msgs.msg import Pose as PoseMessage
from moveit_msgs.msg import CollisionObject
from moveit_msgs.msg import PlanningScene as PlanningSceneMessage
import numpy as np
from servo_arms import ready, robot
from shape_msgs.msg import SolidPrimitive

from arm_model import Array, Clearances, PlanningScene
from arm_model.ros import apply_planning_scene
from arm_servo.core.prepared_scene import PreparedScene

BOXES = 100

ROUNDS = 30

CYCLES = 500

STEP = 1e-3
"""Motion of each joint in a cycle in [rad]."""

WITHIN = 0.05
"""Distance that the cycle asks for in [m]."""


def boxes(root: str) -> PlanningSceneMessage:
    """Return the message of a scene with boxes all around the arm."""
    draw, message = np.random.default_rng(0), PlanningSceneMessage(is_diff=True)
    for number in range(BOXES):
        angle, radius, height = draw.uniform((-np.pi, 0.6, 0.0), (np.pi, 1.2, 1.2)).tolist()
        place = PoseMessage()
        place.position.x, place.position.y = radius * np.cos(angle), radius * np.sin(angle)
        place.position.z = height
        shape = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.05, 0.05, 0.05])
        thing = CollisionObject(id=f'box_{number}', primitives=[shape], primitive_poses=[place])
        thing.header.frame_id, thing.pose.orientation.w = root, 1.0
        message.world.collision_objects.append(thing)
    return message


def median(call: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Return the median time of a call in [ms]."""
    took = []
    for _ in range(rounds):
        began = time.process_time()
        call()
        took.append(1e3 * (time.process_time() - began))
    return float(np.median(took))


def cycle(scene: PlanningScene, start: Array) -> float:
    """Return the median time of the distances of a cycle of a moving arm in [ms]."""
    clearances, place = Clearances(scene), start.copy()
    clearances.least(place, WITHIN)

    def step() -> None:
        place[:] += STEP * np.cos(len(took))
        took.append(clearances.least(place, WITHIN))

    took: list[Array] = []
    return median(step, CYCLES)


def main() -> None:
    """Print the figures."""
    model, start = robot('panda'), ready('panda')
    message = boxes(model.kinematics.root)
    scene = apply_planning_scene(model.scene, message, start)
    built = median(lambda: apply_planning_scene(model.scene, message, start))
    measured = median(lambda: PreparedScene.of(scene, 1, near=start, checks_paths=True))
    print(f'scene of {BOXES} boxes: from the message {built:.1f} ms, measured {measured:.1f} ms')
    alone, among = cycle(model.scene, start), cycle(scene, start)
    print(f'distances in a cycle: {1e3 * alone:.0f} us alone, {1e3 * among:.0f} us among them')


if __name__ == '__main__':
    main()
