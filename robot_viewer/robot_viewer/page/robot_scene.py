# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot in the 3D scene of a page: link shapes, moved by joint positions."""

from __future__ import annotations

from collections.abc import Collection, Mapping
import math
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from urdf_reader import (
    DescriptionError,
    find_mesh,
    Joint,
    joint_position,
    joint_transform,
    KinematicTree,
    mesh_unit,
    MeshFileError,
    parents_first,
    Transform,
    UrdfShape,
)
from viser import FrameHandle, SceneApi, SceneNodeHandle

if TYPE_CHECKING:
    import trimesh

ROOT = '/robot'
Tint: TypeAlias = tuple[float, float, float, float]  # red, green, blue and opacity from 0 to 1
AXES = (0.1, 0.004)  # length and radius of the axes of joints in [m]
SECTION = 0.5  # distance of the grid's thick lines in [m]


FAULTY: Tint = (0.79, 0.16, 0.16, 1.0)  # of the links of joints whose drives report a fault
PLAIN = (0.7, 0.72, 0.75, 1.0)
"""Color of shapes without color in the URDF: red, green, blue and opacity from 0 to 1."""
FOOT = '_foot'  # name suffix of foot links
LEAST_FEET = 3


class Ground:
    """A grid that moves below a walking robot, so that the robot stays in view."""

    def __init__(self, scene: SceneApi) -> None:
        self._grid = scene.add_grid(
            '/ground', cell_size=0.1, section_size=SECTION, width=4, height=4
        )

    def pass_below(self, pose: Transform) -> Transform:
        """Move the grid; return the pose at which to show the root link."""
        x, y, z = pose.translation
        self._grid.position = (-(x % SECTION), -(y % SECTION), 0.0)
        return Transform((0.0, 0.0, z), pose.rotation)


class RobotScene:
    """Nested link frames of a robot in a scene: a joint moves a single frame."""

    def __init__(
        self,
        scene: SceneApi,
        tree: KinematicTree,
        name: str = ROOT,
        seen: tuple[frozenset[str], Tint] | None = None,
        meshes: Meshes | None = None,
    ) -> None:
        """Show the robot, each joint at zero or the limit closest to it.

        ``seen`` restricts the shown links, and gives all of them one color.
        """
        self.notes: list[str] = []  # what cannot be shown
        self._scene, self.tree = scene, tree
        self._tint: Tint | None
        self._links, self._tint = seen or (frozenset(tree.links), None)
        self._meshes = meshes or Meshes()
        self._movable = {joint.name: joint for joint in tree.movable()}
        self._base = scene.add_frame(name, show_axes=False)
        self._frames: dict[str, FrameHandle] = {}
        # nested below the parent link; parents come first
        self._paths = {tree.root: f'{name}/{tree.root}'}
        for joint in parents_first(tree):
            self._paths[joint.child] = f'{self._paths[joint.parent]}/{joint.child}'
        scene.add_frame(self._paths[tree.root], show_axes=False)
        self._shapes: dict[str, list[tuple[str, UrdfShape]]] = {}  # per link, with node paths
        self._marked: frozenset[str] = frozenset()
        self._add_joints()
        self._add_shapes()
        free = (joint for joint in self._movable.values() if joint.mimic is None)
        self.place({joint.name: start_position(joint) for joint in free})
        self.size = self._reach(tree.root)  # how far its links reach from the root in [m]

    def place(self, positions: Mapping[str, float]) -> None:
        """Move joints, with their mimic joints; unknown names are ignored."""
        for name, joint in self._movable.items():
            position = joint_position(joint, positions)
            if position is not None and math.isfinite(position):
                put(self._frames[name], joint_transform(joint, position))

    def place_base(self, pose: Transform) -> None:
        """Move the whole robot."""
        put(self._base, pose)

    def ghost(self, name: str, links: frozenset[str], tint: Tint) -> RobotScene:
        """Return a second copy of the robot on the same base, with independent joints."""
        return RobotScene(self._scene, self.tree, f'{ROOT}/{name}', (links, tint), self._meshes)

    def show(self, *, seen: bool) -> None:
        """Show or hide the robot."""
        self._base.visible = seen

    def show_frames(self, *, seen: bool) -> None:
        """Show or hide the axes of the joints' frames."""
        for frame in self._frames.values():
            frame.show_axes = seen

    def mark(self, joints: Collection[str]) -> None:
        """Show exactly the links of these joints as faulty."""
        links = frozenset(joint.child for joint in self.tree.joints if joint.name in joints)
        for link in links ^ self._marked:
            for name, shape in self._shapes.get(link, ()):
                self._add_shape(name, shape, FAULTY if link in links else self._tint)
        self._marked = links

    def path_of(self, frame: str) -> str:
        """Return the node path of a link frame; that of the world for other frames."""
        return self._paths.get(frame, '')

    def remove(self) -> None:
        """Remove the robot from the scene."""
        self._base.remove()

    def _add_joints(self) -> None:
        joints = {joint.child: joint for joint in self.tree.joints}
        for link, path in self._paths.items():
            if link in joints:
                frame = self._scene.add_frame(
                    path, show_axes=False, axes_length=AXES[0], axes_radius=AXES[1]
                )
                put(frame, joints[link].origin)
                self._frames[joints[link].name] = frame

    def _reach(self, link: str) -> float:
        below = (joint for joint in self.tree.joints if joint.parent == link)
        return max(
            (math.hypot(*j.origin.translation) + self._reach(j.child) for j in below), default=0.1
        )

    def _add_shapes(self) -> None:
        missing: dict[str, list[str]] = {}
        shapes = [each for each in shapes_of(self.tree) if each.link in self._links]
        for number, shape in enumerate(shapes):
            if shape.note:
                missing.setdefault(shape.note, []).append(shape.link)
            name = f'{self._paths[shape.link]}/shape{number}'
            try:
                self._add_shape(name, shape, self._tint)
                self._shapes.setdefault(shape.link, []).append((name, shape))
            except ValueError as error:
                missing.setdefault(str(error), []).append(shape.link)
            except Exception as error:  # noqa: BLE001  # from mesh readers; show the others
                reason = f'{type(error).__name__}: {error}'
                missing.setdefault(reason, []).append(shape.link)
        self.notes += [f'{", ".join(links)}: {reason}' for reason, links in missing.items()]

    def _add_shape(self, name: str, shape: UrdfShape, tint: Tint | None) -> None:
        color = tint or shape.color or PLAIN
        rgb = (round(255 * color[0]), round(255 * color[1]), round(255 * color[2]))
        opacity = None if color[3] >= 1.0 else color[3]
        node: SceneNodeHandle
        match shape.shape:
            case 'box':
                (x, y, z) = shape.lengths('size')
                node = self._scene.add_box(name, rgb, (x, y, z), opacity=opacity)
            case 'cylinder':
                radius, length = shape.lengths('radius', 'length')
                node = self._scene.add_cylinder(name, radius, length, rgb, opacity=opacity)
            case 'sphere':
                (radius,) = shape.lengths('radius')
                node = self._scene.add_icosphere(name, radius, rgb, opacity=opacity)
            case 'mesh':
                mesh, whole = self._meshes.read(shape)
                if not (tint or shape.color) and mesh.visual is not None and mesh.visual.defined:
                    node = self._scene.add_mesh_trimesh(name, mesh, scale=whole)
                else:
                    node = self._scene.add_mesh_simple(
                        name,
                        np.asarray(mesh.vertices),
                        np.asarray(mesh.faces),
                        color=rgb,
                        opacity=opacity,
                        scale=whole,
                    )
            case _:
                raise MeshFileError(f'<{shape.shape}> is no box, cylinder, sphere or mesh')
        put(node, shape.origin)


def travel(joint: Joint) -> tuple[float, float]:
    """Return the limits of a joint in [rad] or [m]; -pi and pi if unlimited."""
    try:
        lower, upper = joint.range.lower, joint.range.upper
    except DescriptionError:
        return -math.pi, math.pi
    ends = math.isfinite(lower) and math.isfinite(upper) and lower < upper
    return (lower, upper) if ends else (-math.pi, math.pi)


def greatest_velocities(tree: KinematicTree) -> dict[str, float]:
    """Return the velocity limits in [rad/s] or [m/s] of joints that have one."""
    found = {}
    for joint in tree.movable():
        try:
            velocity = joint.range.velocity
        except DescriptionError:
            continue
        if 0.0 < velocity < math.inf:
            found[joint.name] = velocity
    return found


def start_position(joint: Joint) -> float:
    """Return the assumed position of a joint in [rad] or [m] until it is known."""
    lower, upper = travel(joint)
    return min(max(0.0, lower), upper)


def put(node: SceneNodeHandle, pose: Transform) -> None:
    """Set the pose of a scene node."""
    x, y, z, w = pose.rotation
    node.wxyz = w, x, y, z
    if tuple(node.position) != pose.translation:  # viser compares in 20 us
        node.position = pose.translation


def pose_of(node: SceneNodeHandle) -> Transform:
    """Return the pose of a scene node."""
    w, x, y, z = map(float, node.wxyz)
    (a, b, c) = map(float, node.position)
    return Transform((a, b, c), (x, y, z, w))


def shapes_of(tree: KinematicTree) -> list[UrdfShape]:
    """Return all visual shapes, and collision shapes of links without visual ones."""
    visuals = list(tree.visuals())
    shown = {each.link for each in visuals}
    return visuals + [each for each in tree.collisions() if each.link not in shown]


class Meshes:
    """Cache of mesh files."""

    def __init__(self) -> None:
        self._read: dict[Path, trimesh.Trimesh] = {}

    def read(self, shape: UrdfShape) -> tuple[trimesh.Trimesh, tuple[float, float, float]]:
        """Return a mesh and the scale factors of its axes to [m].

        Raises:
            OSError: The file cannot be read.
            ValueError: It has no triangles, or is of an unknown format.
        """
        import trimesh  # slow: a third of a page's start; not needed without meshes

        path = find_mesh(shape.attributes.get('filename', ''))
        try:
            mesh = self._read.get(path) or trimesh.load(path, force='mesh')
        except ModuleNotFoundError as error:
            package = {'collada': 'pycollada'}.get(error.name or '', error.name)
            raise MeshFileError(
                f'{path}: it takes the Python package {package} to read it; install that, or '
                'export the mesh as STL or OBJ'
            ) from error
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            raise MeshFileError(f'{path}: no triangles')
        self._read[path] = mesh
        scale = shape.lengths('scale') if 'scale' in shape.attributes else (1.0, 1.0, 1.0)
        unit = mesh_unit(path)  # trimesh does not apply it
        x, y, z = (unit * each for each in scale)
        return mesh, (x, y, z)


def moved(
    tree: KinematicTree, positions: Mapping[str, float], goals: Mapping[str, float]
) -> dict[str, float]:
    """Return positions with goals applied, without their mimic joints, so that these follow."""
    followers = {j.name for j in tree.movable() if j.mimic and j.mimic.source in goals}
    return {name: at for name, at in positions.items() if name not in followers} | dict(goals)


def links_beyond(tree: KinematicTree, joints: frozenset[str]) -> frozenset[str]:
    """Return the links that these joints and their mimic joints move."""
    beyond: set[str] = set()
    for joint in parents_first(tree):
        follows = joint.mimic is not None and joint.mimic.source in joints
        if joint.name in joints or follows or joint.parent in beyond:
            beyond.add(joint.child)
    return frozenset(beyond)


def feet_of(tree: KinematicTree) -> tuple[str, ...]:
    """Return the foot links; empty if there are too few to stand on."""
    feet = tuple(link for link in tree.links if link.endswith(FOOT))
    return feet if len(feet) >= LEAST_FEET else ()
