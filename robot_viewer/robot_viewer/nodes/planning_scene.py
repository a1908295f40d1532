# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The planning scene on the page: shows its objects; adds, moves and removes boxes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
import math
import time
from typing import Any

import numpy as np
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from urdf_reader import Transform
from viser import (
    FrameHandle,
    GuiButtonHandle,
    GuiDropdownHandle,
    SceneApi,
    SceneNodeHandle,
    TransformControlsEvent,
    TransformControlsHandle,
)

from node_runner import LATCHED

from ..page.robot_page import RobotPage
from ..page.robot_scene import pose_of, put, RobotScene
from ..page.style import add_button, add_choice
from .interfaces import Report
from .motion_plan import box_message, Message, pose_message, scene_change, transform_of

WORLD_AND_ATTACHED = 16 | 4  # bits of moveit_msgs/PlanningSceneComponents
AHEAD = 0.6  # distance of a new box in front of the root link in [m]
ANSWER_TIME = 2.0  # service timeout in [s]
NO_OBJECT = 'none'
COLOR, ATTACHED_COLOR = (73, 80, 87), (12, 133, 153)
OPACITY = 0.6
GIZMO_SIZE = 0.2  # of an object's drag handles in [m]
BOX_SIZE = (0.2, 0.2, 0.2)  # of a new box in [m]


Ordered = Callable[[Callable[..., object]], Callable[..., None]]
"""Wraps a function to run in the node's thread, while this robot is shown."""


@dataclass(frozen=True, slots=True)
class SceneObject:
    """An obstacle, or an object attached to the robot."""

    message: Message  # a moveit_msgs/CollisionObject
    attached: bool = False  # to the robot

    @property
    def pose(self) -> Transform:
        """Pose of the object in :attr:`frame`."""
        return transform_of(self.message.pose)

    @property
    def frame(self) -> str:
        """Frame id of the object."""
        return str(self.message.header.frame_id)


class PlanningScene:
    """Shows and changes move_group's planning scene. Call in the node's thread."""

    def __init__(self, node: Node, page: RobotPage, ordered: Ordered, say: Report) -> None:
        self._node, self._page, self._ordered, self._say = node, page, ordered, say
        self._apply: Client | None = None
        self._whole: Client | None = None
        self._robot: RobotScene | None = None  # the robot beside which the scene is shown
        self._objects: dict[str, SceneObject] = {}
        self._drawn: dict[str, tuple[SceneObject, FrameHandle]] = {}
        self._count = 0
        self._name = NO_OBJECT
        self._grips = False  # whether an object is being dragged
        self._asked = -math.inf  # time of the pending request for the whole scene
        self._stale = False  # changed since it was last shown
        self._seen = True
        self.gizmo: TransformControlsHandle | None = None

    def connect(self) -> None:
        """Connect to a move_group: create its service clients, and subscribe to its scene."""
        services = import_module('moveit_msgs.srv')
        scene = import_module('moveit_msgs.msg').PlanningScene
        node = self._node
        self._apply = node.create_client(services.ApplyPlanningScene, 'apply_planning_scene')
        self._whole = node.create_client(services.GetPlanningScene, 'get_planning_scene')
        node.create_subscription(scene, 'monitored_planning_scene', self._take, LATCHED)

    def offer(self, robot: RobotScene) -> None:
        """Show the scene beside a robot, and add the controls that change it."""
        self._robot, self._seen = robot, True
        gui, do = self._page.server.gui, self._ordered
        self.chosen: GuiDropdownHandle[str] = add_choice(
            gui, 'Object', (NO_OBJECT,), do(self.choose)
        )
        self._remove: GuiButtonHandle = add_button(gui, 'Remove object', do(self.remove_chosen))
        size = gui.add_vector3(
            'Size [m]', BOX_SIZE, min=(0.01, 0.01, 0.01), max=(3.0, 3.0, 3.0), step=0.01
        )
        add_button(gui, 'Add box', lambda: do(self.add_box)(size.value))
        self._page.offer_to_see('objects', do(self.show_objects))
        self._show()
        self._stale = True
        self.look()

    def show_objects(self, seen: bool) -> None:
        """Show or hide all objects."""
        self._seen = seen
        for _, frame in self._drawn.values():
            frame.visible = seen

    def remove(self) -> None:
        """Hide the scene, and remove the drag handles."""
        self._draw({})
        self._robot = None
        if self.gizmo is not None:
            self.gizmo.remove()
            self.gizmo = None

    def choose(self, name: str) -> None:
        """Select an object to drag or remove."""
        self._name, self._grips = name, False
        self._show()

    def _take(self, message: Message) -> None:
        """Request the whole scene when objects change: the message may be only a diff."""
        held = message.robot_state.attached_collision_objects
        whole = not (message.is_diff and message.robot_state.is_diff)
        if whole or held or message.world.collision_objects:
            self._stale = True
            self.look()

    def look(self) -> None:
        """Request the whole scene if it has changed; one request at a time."""
        now = time.monotonic()
        if not self._stale or self._whole is None or now - self._asked < ANSWER_TIME:
            return
        if self._whole.service_is_ready():
            self._stale, self._asked = False, now
            request = import_module('moveit_msgs.srv').GetPlanningScene.Request()
            request.components.components = WORLD_AND_ATTACHED
            self._whole.call_async(request).add_done_callback(self._answered)

    def _answered(self, future: Future) -> None:
        self._asked = -math.inf
        if future.exception() is None:
            scene: Message = future.result().scene  # type: ignore[attr-defined, unused-ignore]
            held = [each.object for each in scene.robot_state.attached_collision_objects]
            self._objects = {each.id: SceneObject(each) for each in scene.world.collision_objects}
            self._objects |= {each.id: SceneObject(each, attached=True) for each in held}
            self._show()
        self.look()

    # -- what is shown

    def _show(self) -> None:
        if self._robot is None or self._grips:
            return
        self._draw(self._objects)
        free = (NO_OBJECT, *(n for n, each in self._objects.items() if not each.attached))
        if self.chosen.options != free:
            self.chosen.options = free
        thing = self._objects.get(self._name)
        thing = None if thing is not None and thing.attached else thing
        if self._name in free:
            self.chosen.value = self._name  # type: ignore[misc]  # it has a setter
        self._remove.disabled = thing is None
        self._remove.label = f'Remove {"object" if thing is None else self._name}'
        path = '' if thing is None else f'{self._robot.path_of(thing.frame)}/chosen'
        if self.gizmo is not None and self.gizmo.name != path:
            self.gizmo.remove()
            self.gizmo = None
        if thing is None:
            return
        if self.gizmo is None:
            self.gizmo = self._page.server.scene.add_transform_controls(
                path, GIZMO_SIZE, disable_sliders=True
            )
            self.gizmo.on_update(self._dragged)
        put(self.gizmo, thing.pose)

    def _draw(self, objects: Mapping[str, SceneObject]) -> None:
        """Draw exactly these objects; keep unchanged ones."""
        if self._robot is None:
            return
        for name in self._drawn.keys() - objects.keys():
            self._drawn.pop(name)[1].remove()
        for name, each in objects.items():
            if name in self._drawn:
                before, frame = self._drawn[name]
                if before == each:
                    put(frame, each.pose)  # undo a drag that was refused
                    continue
                frame.remove()
            self._count += 1  # object names may contain characters that node paths may not
            path = f'{self._robot.path_of(each.frame)}/object{self._count}'
            frame = draw_object(self._page.server.scene, path, each)
            frame.visible = self._seen
            self._drawn[name] = each, frame

    async def _dragged(self, event: TransformControlsEvent) -> None:
        # coroutines keep their order
        if event.phase != 'start':
            pose, is_last = pose_of(event.target), event.phase == 'end'
            self._ordered(partial(self.drag, is_last=is_last))(pose)

    # -- what people do

    def drag(self, pose: Transform, *, is_last: bool) -> None:
        """Move the selected object; ``is_last`` marks the end of a drag."""
        thing = self._objects.get(self._name)
        if thing is None:
            return
        self._grips = not is_last
        if self._name in self._drawn:
            put(self._drawn[self._name][1], pose)
        if is_last:
            header, place = thing.message.header, pose_message(pose)
            change = scene_change('MOVE', self._name, header, pose=place)
            self._change(change, f'{self._name} is moved')

    def add_box(self, size: tuple[float, float, float]) -> None:
        """Add a box with edges ``size`` in [m]."""
        if self._robot is None:
            return
        number = 1
        while f'box{number}' in self._objects:
            number += 1
        self._name = name = f'box{number}'  # selected for dragging once it exists
        place = Transform((AHEAD, 0.0, size[2] / 2.0))
        self._change(box_message(name, size, place, self._robot.tree.root), f'{name} is added')

    def remove_chosen(self) -> None:
        """Remove the selected object."""
        thing = self._objects.get(self._name)
        if thing is not None:
            what, self._name = f'{self._name} is removed', NO_OBJECT
            change = scene_change('REMOVE', thing.message.id, thing.message.header)
            self._change(change, what)

    def _change(self, scene: Message, what: str) -> None:
        if self._apply is None or not self._apply.service_is_ready():
            self._refused('apply_planning_scene is not there')
            return
        request = import_module('moveit_msgs.srv').ApplyPlanningScene.Request(scene=scene)
        self._apply.call_async(request).add_done_callback(lambda done: self._changed(done, what))

    def _changed(self, future: Future, what: str) -> None:
        if future.exception() is not None:
            self._refused(f'apply_planning_scene: no answer: {future.exception()}')
            return
        answer: Any = future.result()
        if not answer.success:
            self._refused(f'refused: {what}; /rosout has the reason of move_group')
        else:
            self._say(what, failed=False)

    def _refused(self, reason: str) -> None:
        self._show()  # at its unchanged pose
        self._say(reason, failed=True)


def draw_object(scene: SceneApi, path: str, thing: SceneObject) -> FrameHandle:
    """Draw a moveit_msgs/CollisionObject; invalid shapes are left out."""
    frame = scene.add_frame(path, show_axes=False)
    put(frame, thing.pose)
    color = ATTACHED_COLOR if thing.attached else COLOR
    message = thing.message
    shapes = [
        *zip(message.primitives, message.primitive_poses, strict=False),
        *zip(message.meshes, message.mesh_poses, strict=False),
    ]
    for number, (shape, pose) in enumerate(shapes):
        node = _draw_shape(scene, f'{path}/part{number}', shape, color)
        if node is not None:
            put(node, transform_of(pose))
    return frame


def _draw_shape(
    scene: SceneApi, path: str, shape: Message, color: tuple[int, int, int]
) -> SceneNodeHandle | None:
    """Draw a shape_msgs/SolidPrimitive or Mesh."""
    if hasattr(shape, 'triangles'):
        vertices = np.array([(p.x, p.y, p.z) for p in shape.vertices], float).reshape(-1, 3)
        faces = np.array([each.vertex_indices for each in shape.triangles], int).reshape(-1, 3)
        return scene.add_mesh_simple(path, vertices, faces, color=color, opacity=OPACITY)
    match shape.type, tuple(map(float, shape.dimensions)):
        case shape.BOX, (x, y, z):
            return scene.add_box(path, color, (x, y, z), opacity=OPACITY)
        case shape.SPHERE, (radius, *_):
            return scene.add_icosphere(path, radius, color, opacity=OPACITY)
        case shape.CYLINDER, (height, radius):
            return scene.add_cylinder(path, radius, height, color, opacity=OPACITY)
        case shape.CONE, (height, radius):
            from trimesh.creation import cone as cone_of  # slow: a third of a page's start

            cone = cone_of(radius, height)
            vertices = np.asarray(cone.vertices) - (0.0, 0.0, height / 2.0)  # MoveIt's origin
            faces = np.asarray(cone.faces)
            return scene.add_mesh_simple(path, vertices, faces, color=color, opacity=OPACITY)
    return None
