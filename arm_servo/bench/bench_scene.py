# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes on their way to the servo: until they are ready for the cycle, and in the cycle.

One has 100 boxes, the other a mesh of 20,000 vertices and an octomap of 5,000 cells, as move_group
publishes it: what it costs a cycle that runs meanwhile, beside what that is late without.

Run: ``python arm_servo/bench/bench_scene.py`` in the sourced workspace.

Times are those of the processor, so that other programs do not count.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
import gc
import math
import os
import struct
import sys
import threading
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

from geometry_msgs.msg import Point
from geometry_msgs.msg import Pose as PoseMessage
from moveit_msgs.msg import CollisionObject
from moveit_msgs.msg import PlanningScene as PlanningSceneMessage
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from servo_arms import ready, robot
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import SolidPrimitive

from arm_model import Array, Clearances, Mesh, octomap_shapes, Places, PlanningScene
from arm_model.ros import apply_planning_scene, hull_of
from arm_model.ros.planning_scene import MAX_CORNERS
from arm_servo.core.preparation import PreparedScene

BOXES = 100

ROUNDS = 30

CYCLES = 500

STEP = 1e-3  # motion of each joint in a cycle in [rad]

VERTICES, CELLS = 20_000, 5_000

SWITCH_INTERVAL = 0.0005  # time for which Python keeps the interpreter in [s], as in the master
WITHIN = 0.05  # distance that the cycle asks for in [m]


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


def large(root: str) -> bytes:
    """Return the message that move_group publishes of a scene with a large mesh and octomap."""
    draw = np.random.default_rng(0)
    around = draw.normal(size=(VERTICES, 3))
    around *= 0.3 / np.linalg.norm(around, axis=1, keepdims=True)
    hull = Mesh(around, MAX_CORNERS).points
    mesh = MeshMessage(vertices=[Point(x=x, y=y, z=z) for x, y, z in hull.tolist()])
    thing = CollisionObject(id='rock', meshes=[mesh], pose=PoseMessage(position=Point(x=1.2)))
    thing.header.frame_id, thing.pose.orientation.w = root, 1.0
    message = PlanningSceneMessage()
    message.world.collision_objects = [thing]
    octomap = message.world.octomap
    octomap.header.frame_id = root
    octomap.origin.position.y, octomap.origin.orientation.w = 0.5, 1.0
    octomap.octomap.id, octomap.octomap.resolution = 'OcTree', 0.02
    octomap.octomap.data = array('b', full_stream(CELLS))
    return bytes(serialize_message(message))


def full_stream(cells: int) -> bytes:
    """Return a full stream of OctoMap of a random surface with some occupied cells."""
    side = math.ceil(math.sqrt(cells))
    draw = np.random.default_rng(0)
    heights = np.cumsum(draw.integers(-1, 2, (side, side)), axis=0)
    grid = np.column_stack([*np.indices((side, side)).reshape(2, -1), heights.ravel()])
    keys = grid[:cells] + (1 << 15)
    stream = bytearray()

    def write(rows: Places, bit: int) -> None:
        if bit < 0:
            stream.extend(struct.pack('<fB', 1.0, 0))
            return
        child = ((rows >> bit & 1) * [1, 2, 4]).sum(axis=1)
        there = np.unique(child).tolist()
        stream.extend(struct.pack('<fB', 1.0, sum(1 << number for number in there)))
        for number in there:
            write(rows[child == number], bit - 1)

    write(keys, 15)
    return bytes(stream)


def latest(work: Callable[[], object] | None) -> float:
    """Return how late a cycle of 1 ms is at most beside some work in [ms]; None for none."""
    late, ended = [0.0], threading.Event()

    def run() -> None:
        due = time.monotonic()
        while not ended.is_set():
            due += 1e-3
            time.sleep(max(due - time.monotonic(), 0.0))
            late.append(time.monotonic() - due)
            due = max(due, time.monotonic() - 1e-3)

    thread = threading.Thread(target=run)
    thread.start()
    work() if work is not None else time.sleep(0.2)
    ended.set()
    thread.join()
    return 1e3 * max(late)


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
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.freeze()
    gc.disable()  # as the master does beside its cycle
    data = large(model.kinematics.root)
    scenes: list[PlanningScene] = []

    def take() -> None:
        octomap_shapes.cache_clear()
        hull_of.cache_clear()
        message = deserialize_message(data, PlanningSceneMessage)
        scenes.append(apply_planning_scene(model.scene, message, start))
        PreparedScene.of(scenes[-1], 1, near=start, checks_paths=True)

    # the least of several rounds: what others do on the machine only adds
    idle, busy = (min(latest(work) for _ in range(ROUNDS)) for work in (None, take))
    print(
        f'a mesh of {VERTICES} vertices and an octomap of {CELLS} cells: a cycle is {busy:.2f} ms'
        f' late at most while they come, {idle:.2f} ms while nothing does;'
        f' {1e3 * cycle(scenes[-1], start):.0f} us for distances in a cycle among them'
    )


if __name__ == '__main__':
    main()
