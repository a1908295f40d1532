# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The planning scene on the page: what is in it, and boxes that come, move and go."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from urdf_reader import Transform

from node_runner import LATCHED

from ..page.motion_plan import free_name, NO_OBJECT, SceneObject
from ..page.plan_panel import PlanPanel
from .planning_messages import box_message, changed, Message, moved_message, removed_message

WORLD_AND_ATTACHED = 16 | 4
"""Of moveit_msgs/PlanningSceneComponents."""
AHEAD = 0.6
"""How far before the root link a new box comes, in [m]."""


class SceneEditor:
    """What move_group has in its scene; everything in the thread of the node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._apply: Client | None = None
        self._whole: Client | None = None
        self._panel: PlanPanel | None = None
        self._root = ''
        self._objects: dict[str, SceneObject] = {}
        self._chosen = NO_OBJECT
        self._grips = False  # the object is being dragged
        self._changed_since = False  # the whole scene was asked for

    def connect(self) -> None:
        """Subscribe to the scene of a move_group."""
        services = import_module('moveit_msgs.srv')
        scene = import_module('moveit_msgs.msg').PlanningScene
        node = self._node
        self._apply = node.create_client(services.ApplyPlanningScene, 'apply_planning_scene')
        self._whole = node.create_client(services.GetPlanningScene, 'get_planning_scene')
        node.create_subscription(scene, 'monitored_planning_scene', self._take, LATCHED)

    def show_on(self, panel: PlanPanel, root: str) -> None:
        """Show the scene on a panel."""
        self._panel, self._root = panel, root
        self._show()
        self._ask()

    def choose_object(self, name: str) -> None:
        """Choose an object, to be dragged or removed."""
        self._chosen, self._grips = name, False
        self._show()

    def _ask(self) -> None:
        """Request the whole scene: MoveIt's topic may have carried a change only."""
        if self._whole is not None and self._whole.service_is_ready():
            self._changed_since = False
            request = import_module('moveit_msgs.srv').GetPlanningScene.Request()
            request.components.components = WORLD_AND_ATTACHED
            self._whole.call_async(request).add_done_callback(self._answered)

    def _answered(self, future: Future) -> None:
        if future.exception() is not None:
            return
        if self._changed_since:  # the answer may be from before that
            self._ask()
            return
        answer: Any = future.result()
        answer.scene.is_diff = answer.scene.robot_state.is_diff = False
        self._take(answer.scene)

    def _take(self, message: Message) -> None:
        self._objects = changed(self._objects, message)
        self._changed_since = True
        self._show()

    def _show(self) -> None:
        if self._panel is None or self._grips:
            return
        self._panel.show_objects(list(self._objects.values()))
        thing = self._objects.get(self._chosen)
        self._panel.choose_object(self._chosen, None if thing and thing.attached else thing)

    def drag_object(self, pose: Transform, *, is_last: bool) -> None:
        """Move the object that is chosen; the last of several says so."""
        thing = self._objects.get(self._chosen)
        if thing is None or self._panel is None:
            return
        self._grips = not is_last
        self._panel.move_object(thing.name, pose)
        if is_last:
            self._change(moved_message(thing, pose), f'{thing.name} is moved')

    def add_box(self, size: tuple[float, float, float]) -> None:
        """Add a box of a size in [m]."""
        name = free_name(list(self._objects))
        self._chosen = name  # to be dragged as soon as it is there
        place = Transform((AHEAD, 0.0, size[2] / 2.0))
        self._change(box_message(name, size, place, self._root), f'{name} is added')

    def remove_object(self) -> None:
        """Remove the object that is chosen."""
        thing = self._objects.get(self._chosen)
        if thing is not None:
            self._chosen = NO_OBJECT
            self._change(removed_message(thing), f'{thing.name} is removed')

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
        elif self._panel is not None:
            self._panel.say(what, failed=False)

    def _refused(self, reason: str) -> None:
        self._show()  # where it still is
        if self._panel is not None:
            self._panel.say(reason, failed=True)
