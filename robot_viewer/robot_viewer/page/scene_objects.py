# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The objects of a planning scene in the 3D scene of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import trimesh
from urdf_reader import Transform
from viser import FrameHandle, SceneApi, SceneNodeHandle

from .motion_plan import SceneObject, ScenePart
from .robot_scene import put

COLOR, ATTACHED_COLOR = (47, 158, 68), (112, 72, 232)
OPACITY = 0.6


class SceneObjects:
    """Draws what has changed, and leaves the rest as it is."""

    def __init__(self, scene: SceneApi, path_of: Callable[[str], str]) -> None:
        """Draw nothing yet."""
        self._scene, self._path_of = scene, path_of
        self._drawn: dict[str, tuple[SceneObject, FrameHandle]] = {}
        self._count = 0

    def show(self, objects: Iterable[SceneObject]) -> None:
        """Draw these objects, and no others."""
        wanted = {each.name: each for each in objects}
        for name in set(self._drawn) - set(wanted):
            self._drawn.pop(name)[1].remove()
        for name, each in wanted.items():
            if name in self._drawn:
                before, frame = self._drawn[name]
                if before == each:
                    put(frame, each.pose)  # it may have been dragged, in vain
                    continue
                frame.remove()
            self._drawn[name] = each, self._draw(each)

    def move(self, name: str, pose: Transform) -> None:
        """Move an object in the view, before the planning scene says so.

        Args:
            name: Which.
            pose: In its frame.
        """
        if name in self._drawn:
            put(self._drawn[name][1], pose)

    def remove(self) -> None:
        """Draw none any more."""
        self.show(())

    def _draw(self, thing: SceneObject) -> FrameHandle:
        self._count += 1  # names of objects may have what paths of nodes may not
        path = f'{self._path_of(thing.frame)}/object{self._count}'
        frame = self._scene.add_frame(path, show_axes=False)
        put(frame, thing.pose)
        color = ATTACHED_COLOR if thing.attached else COLOR
        for number, part in enumerate(thing.parts):
            put(self._draw_part(f'{path}/part{number}', part, color), part.pose)
        return frame

    def _draw_part(
        self, path: str, part: ScenePart, color: tuple[int, int, int]
    ) -> SceneNodeHandle:
        match part.shape, part.size:
            case 'box', (x, y, z):
                return self._scene.add_box(path, color, (x, y, z), opacity=OPACITY)
            case 'sphere', (radius, *_):
                return self._scene.add_icosphere(path, radius, color, opacity=OPACITY)
            case 'cylinder', (height, radius):
                return self._scene.add_cylinder(path, radius, height, color, opacity=OPACITY)
            case 'cone', (height, radius):
                cone = trimesh.creation.cone(radius, height)
                vertices = np.asarray(cone.vertices) - (0.0, 0.0, height / 2.0)  # as MoveIt has it
                faces = np.asarray(cone.faces)
            case _:
                vertices = np.array(part.vertices, float).reshape(-1, 3)
                faces = np.array(part.triangles, int).reshape(-1, 3)
        return self._scene.add_mesh_simple(path, vertices, faces, color=color, opacity=OPACITY)
