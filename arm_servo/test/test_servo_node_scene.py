# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The topic of the scene: what comes on it counts for the arm, and what is wrong is logged."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import Point, Pose
from model_robots import table, texts
from moveit_msgs.msg import CollisionObject, PlanningScene, PlanningSceneWorld
from servo_drives import Drives
from shape_msgs.msg import SolidPrimitive

from arm_model import RobotModel
from arm_servo.ros.scene_listener import SceneListener


def message(name: str, frame: str = '') -> PlanningScene:
    """Return a whole scene with a box."""
    shape = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.1, 0.1])
    box = CollisionObject(id=name, primitives=[shape], pose=Pose(position=Point(x=2.0)))
    box.header.frame_id = frame
    return PlanningScene(world=PlanningSceneWorld(collision_objects=[box]))


def test_scenes_count_once_the_arm_is_known_and_a_wrong_one_does_not() -> None:
    """The last whole scene before the first feedback is enough."""
    drives = Drives(model=RobotModel(*texts('panda'), table('panda')))
    logged: list[str] = []
    node: Any = SimpleNamespace(
        get_logger=lambda: SimpleNamespace(error=logged.append),
        create_subscription=lambda *_: None,
        create_timer=lambda *_: None,
    )
    listener = SceneListener(node, [drives.gateway])
    listener._take(message('early'))
    listener._take(message('box'))
    assert not drives.gateway.model.scene.objects
    drives.attach()
    drives.run(2)
    listener._apply_waiting()
    drives.run()
    assert set(drives.gateway.model.scene.objects) == {'box'}
    listener._take(message('cup', 'nowhere'))
    drives.run()
    assert set(drives.gateway.model.scene.objects) == {'box'}
    assert "'cup': no frame 'nowhere'" in logged[0]
    assert 'the scene before counts' in logged[0]
