# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Planned motions on a page: goal, ghost, path, and the objects of the planning scene."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping, Sequence
from functools import partial
from itertools import pairwise
import time
from typing import Any

import numpy as np
from urdf_reader import KinematicTree, Transform, Vector
from viser import (
    GuiButtonHandle,
    GuiDropdownHandle,
    GuiEvent,
    GuiHtmlHandle,
    LineSegmentsHandle,
    SceneNodeHandle,
    TransformControlsEvent,
    TransformControlsHandle,
    ViserServer,
)

from ..link_poses import links_beyond
from .live import Hold, Live
from .motion_plan import (
    DRAGGED,
    NO_GOAL,
    NO_OBJECT,
    Order,
    PlanActions,
    PlanGroup,
    SceneActions,
    SceneObject,
)
from .robot_scene import put, RobotScene, Tint
from .scene_objects import SceneObjects
from .sliders import Share
from .style import BAD, Color, GOOD, line, NEUTRAL, PLAIN, WANTED

GHOST_TINT: Tint = (0.05, 0.52, 0.6, 0.4)
LINE_COLOR = (24, 100, 171)
LINE_WIDTH = 3.0
"""In [px]."""
GOAL_SIZE, OBJECT_SIZE = 0.22, 0.2
"""Of the arrows by which something is dragged in [m]."""
BOX_SIZE = (0.2, 0.2, 0.2)
"""Of a new box in [m]."""
HOLD_EXECUTE = 'Hold to execute'


class PlanPanel:
    """Orders what people do, and shows what it is given; it decides nothing."""

    def __init__(
        self,
        server: ViserServer,
        robot: RobotScene,
        tree: KinematicTree,
        groups: Sequence[str],
        ways: tuple[PlanActions, SceneActions, Order, Live, Share],
    ) -> None:
        self._server, self._robot, self._tree = server, robot, tree
        plan, scene, self._order, live, speed = ways
        self._plan, self._scene, self._live = plan, scene, live
        self._path = robot.path_of(tree.root)
        self._ghost: RobotScene | None = None
        self._links: frozenset[str] = frozenset()
        self._line: LineSegmentsHandle | None = None
        self._goal_gizmo: TransformControlsHandle | None = None
        self._object_gizmo: TransformControlsHandle | None = None
        self._objects = SceneObjects(server.scene, robot.path_of)
        gui = server.gui
        self._folder = gui.add_folder(None)
        with self._folder:
            self._group = self._dropdown('Group', groups, plan.choose_group)
            self._goal = self._dropdown('Goal', (NO_GOAL, DRAGGED), plan.choose_goal)
            self._button('Plan motion', lambda: plan.plan(speed()), WANTED)
            self._outcome: GuiHtmlHandle = gui.add_html('')
            self._again = self._button('Show motion again', plan.show_again)
            self._hold, html = live.button(
                Hold(
                    HOLD_EXECUTE,
                    lambda: self._order(partial(plan.go_on, time.monotonic())),
                    lambda: self._order(plan.let_go),
                    lambda: self._order(partial(plan.execute, time.monotonic())),
                )
            )
            gui.add_html(f'<div class="rv-one">{html}</div>')
            self._object = self._dropdown('Object', (NO_OBJECT,), scene.choose_object)
            self._remove = self._button('Remove object', scene.remove_object)
            self._size = gui.add_vector3(
                'Size [m]', BOX_SIZE, min=(0.01, 0.01, 0.01), max=(3.0, 3.0, 3.0), step=0.01
            )
            self._button('Add box', self._add_box)
        self.allow(execute=False)
        self.choose_object(NO_OBJECT, None)

    def remove(self) -> None:
        """Remove all of it from the page; what is attached to the robot goes with the robot."""
        self._live.remove(self._hold)
        self._folder.remove()
        self._objects.remove()
        for node in (self._ghost, self._line, self._goal_gizmo, self._object_gizmo):
            if node is not None:
                node.remove()

    # -- what is shown

    def show_group(self, group: PlanGroup) -> None:
        """Show which group is planned for, and its states."""
        _choose(self._group, group.name)
        self._goal.options = (NO_GOAL, DRAGGED, *group.states)
        links = links_beyond(self._tree, frozenset(group.joints))
        if links != self._links and self._ghost is not None:
            self._ghost.remove()
            self._ghost = None
        self._links = links

    def show_goal(self, name: str) -> None:
        """Show which goal is chosen."""
        _choose(self._goal, name)

    def place_goal(self, pose: Transform | None) -> None:
        """Show the goal's handle at a pose."""
        if pose is None:
            if self._goal_gizmo is not None:
                self._goal_gizmo.visible = False
            return
        if self._goal_gizmo is None:
            self._goal_gizmo = self._gizmo(f'{self._path}/goal', GOAL_SIZE, self._goal_dragged)
        put(self._goal_gizmo, pose)
        self._goal_gizmo.visible = True

    def show_ghost(self, positions: Mapping[str, float] | None) -> None:
        """Show the robot where it is not."""
        if positions is None:
            if self._ghost is not None:
                self._ghost.show(seen=False)
            return
        if self._ghost is None:
            self._ghost = self._robot.ghost('ghost', self._links, GHOST_TINT)
        self._ghost.place(positions)
        self._ghost.show(seen=True)

    def show_line(self, points: Sequence[Vector]) -> None:
        """Draw where the tip passes."""
        if self._line is not None:
            self._line.remove()
            self._line = None
        if len(points) > 1:
            ends = np.array([[before, after] for before, after in pairwise(points)])
            self._line = self._server.scene.add_line_segments(
                f'{self._path}/line',
                ends,
                LINE_COLOR,
                thickness=LINE_WIDTH,
                thickness_units='screen',
            )

    def say(self, text: str, *, failed: bool | None = None) -> None:
        """Show what became of the last request."""
        mark = PLAIN if failed is None else BAD if failed else GOOD
        self._outcome.content = line(text, mark) if text else ''

    def allow(self, *, execute: bool) -> None:
        """Enable the buttons that need a plan."""
        self._again.disabled = not execute
        (self._live.off.discard if execute else self._live.off.add)(self._hold)

    def end_hold(self) -> None:
        """Show that the execution has ended: its button has to be let go."""
        self._live.end(self._hold)

    def show_objects(self, objects: Sequence[SceneObject]) -> None:
        """Show what is in the planning scene."""
        self._objects.show(objects)
        free = (NO_OBJECT, *(each.name for each in objects if not each.attached))
        if self._object.options != free:
            self._object.options = free

    def choose_object(self, name: str, thing: SceneObject | None) -> None:
        """Show which object is chosen, and let it be dragged."""
        if name in self._object.options:
            _choose(self._object, name)
        self._remove.disabled = thing is None
        self._remove.label = f'Remove {"object" if thing is None else name}'
        path = '' if thing is None else f'{self._robot.path_of(thing.frame)}/chosen'
        if self._object_gizmo is not None and self._object_gizmo.name != path:
            self._object_gizmo.remove()
            self._object_gizmo = None
        if thing is None:
            return
        if self._object_gizmo is None:
            self._object_gizmo = self._gizmo(path, OBJECT_SIZE, self._object_dragged)
        put(self._object_gizmo, thing.pose)

    def move_object(self, name: str, pose: Transform) -> None:
        """Show an object where it is dragged to."""
        self._objects.move(name, pose)

    # -- what people do, in threads of the page

    async def _goal_dragged(self, event: TransformControlsEvent) -> None:
        self._order(partial(self._plan.drag_goal, _pose_of(event.target)))

    async def _object_dragged(self, event: TransformControlsEvent) -> None:
        if event.phase != 'start':
            pose, is_last = _pose_of(event.target), event.phase == 'end'
            self._order(partial(self._scene.drag_object, pose, is_last=is_last))

    def _add_box(self) -> None:
        x, y, z = self._size.value
        self._scene.add_box((x, y, z))

    def _gizmo(
        self,
        path: str,
        size: float,
        dragged: Callable[[TransformControlsEvent], Coroutine[Any, Any, None]],
    ) -> TransformControlsHandle:
        gizmo = self._server.scene.add_transform_controls(path, size, disable_sliders=True)
        gizmo.on_update(dragged)  # coroutines keep their order
        return gizmo

    def _dropdown(
        self, label: str, options: Sequence[str], choose: Callable[[str], None]
    ) -> GuiDropdownHandle[str]:
        dropdown: GuiDropdownHandle[str] = self._server.gui.add_dropdown(label, tuple(options))
        dropdown.on_update(partial(self._chosen, choose))
        return dropdown

    def _chosen(
        self, choose: Callable[[str], None], event: GuiEvent[GuiDropdownHandle[str]]
    ) -> None:
        if event.client_id is not None:  # or it was set here
            self._order(partial(choose, event.target.value))

    def _button(
        self, label: str, press: Callable[[], None], color: Color = NEUTRAL
    ) -> GuiButtonHandle:
        button = self._server.gui.add_button(label, color=color)
        button.on_click(lambda _: self._order(press))
        return button


def _choose(dropdown: GuiDropdownHandle[str], option: str) -> None:
    if dropdown.value != option:
        dropdown.value = option  # type: ignore[misc]  # it has a setter


def _pose_of(node: SceneNodeHandle) -> Transform:
    w, x, y, z = map(float, node.wxyz)
    (a, b, c) = map(float, node.position)
    return Transform((a, b, c), (x, y, z, w))
