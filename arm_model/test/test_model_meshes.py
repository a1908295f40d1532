# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Collision meshes: found, made convex hulls, cached; and what cannot be used is named."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import errno
import io
from itertools import product
import math
from pathlib import Path
import re

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain_texts
import numpy as np
import pytest

import arm_model as am
from arm_model.scene import meshes, pieces

CORNERS = list(product((-0.5, 0.5), repeat=3))
"""Of a cube with edges of one, in the order of their coordinates."""

FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [(a, b, c) for a, b, c, _ in FACES] + [(a, c, d) for a, _, c, d in FACES]

SHAPE = '<geometry><sphere radius="0.03"/></geometry>'  # what :func:`chain_texts` makes links of


def obj(
    corners: Sequence[Sequence[float]] = CORNERS, faces: Sequence[Sequence[int]] = TRIANGLES
) -> str:
    """Return a body as Wavefront OBJ, by default the cube."""
    lines = [f'v {x} {y} {z}' for x, y, z in corners]
    return '\n'.join(lines + [f'f {a + 1} {b + 1} {c + 1}' for a, b, c in faces])


def stl() -> str:
    """Return the cube as STL."""
    facets = ''.join(
        'facet normal 0 0 0\nouter loop\n'
        + ''.join('vertex {} {} {}\n'.format(*CORNERS[corner]) for corner in triangle)
        + 'endloop\nendfacet\n'
        for triangle in TRIANGLES
    )
    return f'solid cube\n{facets}endsolid cube\n'


def dae(meter: str = '1') -> str:
    """Return the cube as COLLADA with a unit of its own."""
    numbers = ' '.join(str(number) for corner in CORNERS for number in corner)
    indices = ' '.join(str(corner) for triangle in TRIANGLES for corner in triangle)
    accessor = ''.join(f'<param name="{axis}" type="float"/>' for axis in 'XYZ')
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"'
        f' version="1.4.1"><asset><unit name="u" meter="{meter}"/><up_axis>Z_UP</up_axis></asset>'
        '<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="24">'
        f'{numbers}</float_array><technique_common><accessor source="#a" count="8" stride="3">'
        f'{accessor}</accessor></technique_common></source><vertices id="v"><input'
        ' semantic="POSITION" source="#p"/></vertices><triangles count="12"><input'
        f' semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles></mesh>'
        '</geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">'
        '<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>'
        '<instance_visual_scene url="#s"/></scene></COLLADA>'
    )


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give each test an empty cache and packages of its own."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path / 'prefix'))
    monkeypatch.setenv('ROS_PACKAGE_PATH', '')
    meshes._hulls.cache_clear()
    return tmp_path / 'cache' / 'arm_model' / 'hulls'


def arm(geometry: str, folder: Path | None = None, srdf: str = '') -> am.RobotModel:
    """Return a chain of four joints with links of a geometry."""
    urdf, semantic, limits = chain_texts('zyyy')
    semantic = semantic.replace('</robot>', f'{srdf}</robot>')
    urdf = urdf.replace(SHAPE, f'<geometry>{geometry}</geometry>')
    return am.RobotModel(urdf, semantic, limits, folder=folder)


@pytest.mark.parametrize(
    ('name', 'text', 'scale'),
    [
        ('cube.obj', obj(), '0.1 0.06 0.04'),
        ('cube.stl', stl(), '0.1 0.06 0.04'),
        ('cube.STL', stl(), '0.1 -0.06 0.04'),
        ('cube.dae', dae(), '0.1 0.06 0.04'),
        ('cube.dae', dae('0.01'), '10 6 4'),
    ],
)
def test_a_mesh_is_the_shape_that_it_shows(
    name: str, text: str, scale: str, tmp_path: Path
) -> None:
    """A cube of each format, scaled and mirrored, has the distances of a box."""
    (tmp_path / name).write_text(text, encoding='utf-8')
    mesh = arm(f'<mesh filename="{name}" scale="{scale}"/>', tmp_path)
    box = arm('<box size="0.1 0.06 0.04"/>')
    assert mesh.pairs == box.pairs != ()
    rng = np.random.default_rng(1)
    for _ in range(20):
        at = rng.uniform(-2.0, 2.0, 4)
        exact = am.Clearances(box.scene).least(at, math.inf)
        assert am.Clearances(mesh.scene).least(at, math.inf) == pytest.approx(exact, abs=1e-5)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=1, max_size=20))
def test_a_hull_is_around_all_points(points: list[tuple[float, float, float]]) -> None:
    """Also where they are flat, in a line, or all at one place: then it is a little thicker."""
    hull = np.array(meshes.convex(np.array(points)).points())
    slack = 1e-9
    assert (hull.min(axis=0) <= np.min(points, axis=0) + slack).all()
    assert (hull.max(axis=0) >= np.max(points, axis=0) - slack).all()
    assert (np.ptp(hull, axis=0) <= np.ptp(points, axis=0) + 2.1 * meshes.MIN_THICKNESS).all()


@pytest.mark.parametrize('length', [0.001, 0.2, 3.0])
def test_a_hull_of_a_finely_rounded_part_is_around_it(length: float) -> None:
    """Coal counts 255 neighbours of a corner at most: a disc of CAD has more on its rim."""
    turns = np.linspace(0.0, 2.0 * math.pi, 1000, endpoint=False)
    rim = 0.1 * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    points = np.array([(x, y, z) for x, y in rim for z in (0.0, length)])
    hull = meshes.convex(points)
    assert hull.num_points <= meshes.MAX_CORNERS
    outside = points @ np.array(hull.normals()).T + np.array(hull.offsets())
    assert outside.max() < 1e-9
    assert np.array(hull.points())[:, 2].max() < 1.02 * length
    assert np.linalg.norm(np.array(hull.points())[:, :2], axis=1).max() < 0.1 * 1.02


def test_a_hull_is_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another start, another name and another folder find it in the cache; a new content not."""
    path, copy = tmp_path / 'cube.obj', tmp_path / 'copy.obj'
    for file in (path, copy):
        file.write_text(obj(), encoding='utf-8')
    made: list[Path] = []
    make = meshes.hulls_of_file
    monkeypatch.setattr(meshes, 'hulls_of_file', lambda file: made.append(file) or make(file))  # type: ignore[func-returns-value]
    first = meshes.load_hulls(path)
    meshes._hulls.cache_clear()
    assert sorted(meshes.load_hulls(copy)[0].points.tolist()) == sorted(first[0].points.tolist())
    assert made == [path]
    path.write_text(obj().replace('0.5', '0.7'), encoding='utf-8')
    meshes.load_hulls(path)
    assert made == [path, path]


def two_cubes(gap: float) -> str:
    """Return two cubes beside each other as Wavefront OBJ, with a gap as a share of their edge."""
    second = [(x + 1.0 + gap, y, z) for x, y, z in CORNERS]
    return obj([*CORNERS, *second], [*TRIANGLES, *np.add(TRIANGLES, 8).tolist()])


def test_bodies_that_lie_apart_have_a_hull_each(tmp_path: Path) -> None:
    """What is between them is free; bodies that touch are one."""
    path = tmp_path / 'cubes.obj'
    for gap, count in ((0.0, 1), (0.5, 2)):
        path.write_text(two_cubes(gap), encoding='utf-8')
        for _ in range(2):  # from the cache, too
            hulls = meshes.load_hulls(path)
            assert len(hulls) == count
            assert sum(len(each.points) for each in hulls) == 8 * count
            assert min(each.fullness for each in hulls) == pytest.approx(1.0)
            meshes._hulls.cache_clear()
    model = arm('<mesh filename="cubes.obj" scale="0.02 0.02 0.02"/>', tmp_path)
    assert [len(each) for each in model.scene.link_shapes.values()] == [2] * 4
    ball, at = am.CollisionObject('ball', am.Sphere(0.003)), np.zeros(4)
    placed = model.scene.link_shapes['link_4'][0].pose
    link = am.combined(model.kinematics.link_pose('link_4', at), placed)
    for x, touches in ((0.015, False), (0.0, True), (0.03, True)):
        middle = am.Pose(link.rotation, link.position + link.rotation @ [x, 0.0, 0.0])
        contacts = am.Clearances(model.scene.with_object(ball.at(middle))).contacts(at)
        assert any('ball' in each.bodies for each in contacts) is touches


def test_a_body_of_several_materials_is_whole(tmp_path: Path) -> None:
    """Each colour counts, as in the files that makers of arms publish."""
    path, lines = tmp_path / 'cube.obj', two_cubes(0.5).splitlines()
    colours = [f'newmtl {name}\nKd {shade} 0 0' for name, shade in (('dark', 0.1), ('bright', 1))]
    path.with_suffix('.mtl').write_text('\n'.join(colours), encoding='utf-8')
    found = []
    for text in (
        [*lines[:16], 'usemtl dark', *lines[16:23], 'usemtl bright', *lines[23:]],
        lines,
    ):
        path.write_text('\n'.join(['mtllib cube.mtl', 'o cube', *text]), encoding='utf-8')
        found.append([each.points for each in meshes.load_hulls(path)])
    coloured, plain = found
    assert [len(each) for each in coloured] == [len(each) for each in plain]
    one, other = (np.sort(np.concatenate(each), axis=0) for each in found)
    assert np.array_equal(one, other)


@pytest.mark.parametrize('lacking', ['a folder to write', 'a home', 'room on the disk'])
def test_without_a_cache_hulls_are_made_all_the_same(
    lacking: str, tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is no reason to leave a shape out; what cannot be written whole is removed.

    A container may run as a user whom it does not know, and who has no home.
    """

    def fail(error: Exception) -> Callable[[int], None]:
        def failing(_: int) -> None:
            raise error

        return failing

    path = tmp_path / 'cube.stl'
    path.write_text(stl(), encoding='utf-8')
    if lacking == 'a folder to write':
        monkeypatch.setenv('XDG_CACHE_HOME', str(path))
    elif lacking == 'a home':
        monkeypatch.delenv('XDG_CACHE_HOME')
        monkeypatch.delenv('HOME', raising=False)
        monkeypatch.setattr('pwd.getpwuid', fail(KeyError()))
    else:
        monkeypatch.setattr('os.fsync', fail(OSError(errno.ENOSPC, 'no space left on device')))
    assert len(meshes.load_hulls(path)[0].points) == len(CORNERS)
    assert not cache.exists() or not list(cache.iterdir())


def npz(points: list[list[float]]) -> bytes:
    """Return a file of the cache."""
    file = io.BytesIO()
    np.savez(file, points=np.array(points), counts=[len(points)], fullness=[1.0])
    return file.getvalue()


@pytest.mark.parametrize(
    'damage',
    [
        lambda _: b'',
        lambda whole: whole[: len(whole) // 2],
        lambda whole: whole[:40] + b'\xff' * 40 + whole[80:],
        lambda whole: bytes(len(whole)),
        lambda _: npz([]),
        lambda _: npz([[math.nan] * 3]),
    ],
)
def test_a_damaged_file_of_the_cache_is_written_again(
    tmp_path: Path, cache: Path, damage: Callable[[bytes], bytes]
) -> None:
    """Such as the empty one that a loss of power leaves."""
    path = tmp_path / 'cube.stl'
    path.write_text(stl(), encoding='utf-8')
    meshes.load_hulls(path)
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    meshes._hulls.cache_clear()
    assert len(meshes.load_hulls(path)[0].points) == len(CORNERS)
    assert len(file.read_bytes()) == len(whole)


@pytest.mark.parametrize(
    ('mesh', 'words'),
    [
        ('package://other_arm/link.stl', 'package other_arm is not installed; install it'),
        ('relative.stl', 'the folder of a relative path is unknown'),
        ('/nowhere/link.stl', 'no file /nowhere/link.stl; correct the name'),
        ('package:///arm/link.stl', 'write package://PACKAGE/FILE'),
        ('http://x/link.stl', 'use package:// or file://'),
        ('', '/link.stl'),
        ('solid', '/link.stl'),
        ('no mesh at all, but words', '/link.stl'),
    ],
)
def test_what_cannot_be_used_is_one_note(mesh: str, words: str, tmp_path: Path) -> None:
    """It names all links that are not checked for this reason, and what to do, or the file."""
    path = tmp_path / 'link.stl'
    if words == '/link.stl':  # whose content is damaged
        path.write_text(mesh, encoding='utf-8')
        mesh, words = f'file://{path}', str(path)
    model = arm(f'<mesh filename="{mesh}"/>')
    (note,) = model.notes
    assert 'self-collision is not checked' in note
    assert words in note
    assert 'link_1, link_2, link_3, link_4: ' in note
    assert model.pairs == ()
    path.write_text(stl(), encoding='utf-8')
    with pytest.raises(am.ModelError, match='scale'):
        arm('<mesh filename="link.stl" scale="1 1"/>', tmp_path)


def test_links_without_a_shape_are_named() -> None:
    """The others are checked all the same."""
    urdf, srdf, limits = chain_texts('zyyyy')
    model = am.RobotModel(urdf.replace(SHAPE, '<geometry/>', 1), srdf, limits)
    checked = {link for pair in model.pairs for link in pair}
    assert checked == {'link_2', 'link_3', 'link_4', 'link_5'}
    assert 'link_1: an empty <geometry>' in model.notes[0]
    bare = am.RobotModel(re.sub('<collision>.*?</collision>', '', urdf), srdf, limits)
    assert bare.notes == ('no link has a <collision>, so self-collision is not checked',)


def _hollow(folder: Path, scales: Sequence[float], name: str) -> None:
    """Write boxes in boxes as OBJ: each fills little of its hull, and is closed."""
    corners, faces = list[tuple[float, float, float]](), list[list[int]]()
    for place, scale in enumerate(scales):
        for each, step in ((scale, 1), (0.9 * scale, -1)):
            faces += [[len(corners) + corner for corner in face[::step]] for face in TRIANGLES]
            corners += [(each * x + 9 * place, each * y, each * z) for x, y, z in CORNERS]
    (folder / name).write_text(obj(corners, faces), encoding='utf-8')


def test_a_body_that_takes_too_long_is_given_up_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Its hull is named as far too large: give convex parts. The next starts do not wait again."""
    monkeypatch.setattr(pieces, 'TIME_LIMIT', 0.01)
    mesh = '<mesh filename="{}" scale="0.1 0.1 0.1"/>'

    def start(name: str) -> Sequence[str]:
        monkeypatch.setattr(pieces, '_watch', pieces.Stopwatch())
        meshes._hulls.cache_clear()
        caplog.clear()
        model = arm(mesh.format(name), tmp_path)
        assert any('link_1 (27 %)' in note and 'convex parts' in note for note in model.notes)
        return [record.getMessage()[:35] for record in caplog.records]

    begins, gives_up = 'cutting meshes into convex pieces, ', 'a body of a mesh was not cut in 0.0'
    _hollow(tmp_path, [1.0], 'one.obj')
    assert start('one.obj') == [begins, gives_up]
    assert start('one.obj') == []
    _hollow(tmp_path, [1.1, 1.2], 'two.obj')
    assert start('two.obj') == [begins, gives_up]
    assert start('two.obj') == [begins, gives_up], 'the first had taken the time of the second'
    assert start('two.obj') == []
    monkeypatch.setattr(pieces, 'TIME_LIMIT', 0.02)
    assert start('one.obj') == [begins, gives_up], 'another limit'


def _extruded(outline: list[tuple[int, int]], flat: list[tuple[int, int, int]]) -> str:
    """Return a prism of height 1 as OBJ; `flat` are the triangles of its outline."""
    count = len(outline)
    walls = [(k, (k + 1) % count) for k in range(count)]
    faces = [each[::-1] for each in flat]
    faces += [(a + count, b + count, c + count) for a, b, c in flat]
    faces += [each for a, b in walls for each in ((a, b, b + count), (a, b + count, a + count))]
    return obj([(x, y, z) for z in (0, 1) for x, y in outline], faces)


def _ring(around: int = 24, across: int = 12) -> str:
    """Return a torus of radii 1 and 0.2 as OBJ."""
    a, b = np.meshgrid(*(2 * math.pi * np.arange(n) / n for n in (around, across)), indexing='ij')
    far = 1 + 0.2 * np.cos(b)
    corners = np.stack((far * np.cos(a), far * np.sin(a), 0.2 * np.sin(b)), axis=-1).reshape(-1, 3)
    faces = []
    for i, j in product(range(around), range(across)):
        steps = ((0, 0), (1, 0), (1, 1), (0, 1))
        at = [(i + di) % around * across + (j + dj) % across for di, dj in steps]
        faces += [at[:3], [at[0], *at[2:]]]
    return obj(corners.tolist(), faces)


FORK = _extruded(
    [(0, 0), (6, 0), (6, 6), (5, 6), (5, 1), (1, 1), (1, 6), (0, 6)],
    [(0, 1, 4), (0, 4, 5), (1, 2, 4), (2, 3, 4), (0, 5, 7), (5, 6, 7)],
)


BOOMERANG = _extruded([(0, 0), (8, 0), (1, 1), (0, 8)], [(0, 1, 2), (0, 2, 3)])


@pytest.mark.parametrize(
    ('mesh', 'free'),
    [(FORK, (3.0, 4.0, 0.5)), (BOOMERANG, (3.0, 3.0, 0.5)), (_ring(), (0.0, 0.0, 0.0))],
    ids=['fork', 'boomerang', 'ring'],
)
def test_pieces_of_a_body_hold_it_and_leave_its_gap_free(
    mesh: str, free: tuple[float, float, float], tmp_path: Path
) -> None:
    """Corners of a body stand out of the pieces of CoACD: no contact may be missed for it."""
    (tmp_path / 'link.obj').write_text(mesh, encoding='utf-8')
    hulls = [meshes.convex(each.points) for each in meshes.load_hulls(tmp_path / 'link.obj')]
    assert 1 < len(hulls) <= 16
    rows = [line.split() for line in mesh.splitlines()]
    corners = np.array([row[1:] for row in rows if row[0] == 'v'], dtype=np.float32)  # assimp's
    faces = np.array([row[1:] for row in rows if row[0] == 'f'], dtype=int) - 1
    weights = np.random.default_rng(1).dirichlet((1.0, 1.0, 1.0), (20, len(faces)))
    surface = np.einsum('stk,tkx->stx', weights, corners[faces]).reshape(-1, 3)

    def outside(points: am.Array) -> am.Array:
        """Return how far each point is outside of the piece that is nearest."""
        walls = ((np.array(hull.normals()), np.array(hull.offsets())) for hull in hulls)
        distances: am.Array = np.min([(points @ n.T + d).max(axis=1) for n, d in walls], axis=0)
        return distances

    assert outside(np.concatenate([corners, surface])).max() < 1e-9
    assert outside(np.array([free]))[0] > 0.1
    model = arm('<mesh filename="link.obj" scale="0.02 0.02 0.02"/>', tmp_path)
    assert not any('convex parts' in note for note in model.notes)


def test_a_body_that_cannot_be_cut_keeps_its_hull_and_is_named(tmp_path: Path) -> None:
    """A fork without one triangle is no body: CoACD would take minutes for it."""
    (tmp_path / 'link.obj').write_text(FORK.rsplit('\n', 1)[0], encoding='utf-8')
    (hull,) = meshes.load_hulls(tmp_path / 'link.obj')
    assert len(hull.points) == 8
    model = arm('<mesh filename="link.obj" scale="0.02 0.02 0.02"/>', tmp_path)
    assert any('link_1 (' in note and 'not closed' in note for note in model.notes)


def test_links_that_always_touch_are_not_checked_and_named() -> None:
    """Adjacent ones where the SRDF has no word about pairs; always touching ones in any case.

    A matrix with any word has the last one, as in MoveIt: the rest of it may be forgotten.
    """
    chained = {('link_1', 'link_2'), ('link_2', 'link_3'), ('link_3', 'link_4')}
    small = arm('<sphere radius="0.03"/>')
    assert set(small.pairs) == {('link_1', 'link_3'), ('link_1', 'link_4'), ('link_2', 'link_4')}
    assert 'link_1 and link_2' in small.notes[0]
    word = '<{}_collisions link1="{}" link2="{}"/>'
    other = word.format('disable', 'base', 'tip')
    assert chained < set(arm('<sphere radius="0.03"/>', srdf=other).pairs)
    large = arm('<sphere radius="0.15"/>', srdf=other)
    assert not chained & set(large.pairs)
    assert len(large.pairs) == len(small.pairs)
    assert 'disable_collisions' in large.notes[0]
    one = word.format('disable', 'link_1', 'link_2')
    notes = arm('<sphere radius="0.03"/>', srdf=one).notes
    (note,) = (note for note in notes if note.startswith('adjacent links'))
    assert 'link_2 and link_3, link_3 and link_4' in note
    assert 'link_1 and link_2' not in note
    # an enable_collisions is explicit; what it brings about is said
    enabled = arm('<sphere radius="0.15"/>', srdf=word.format('enable', 'link_1', 'link_2'))
    assert chained & set(enabled.pairs) == {('link_1', 'link_2')}
    dropped, kept = (note for note in enabled.notes if 'touch wherever' in note)
    assert 'link_1 and link_2' not in dropped
    assert 'link_1 and link_2' in kept
    assert 'enable_collisions' in kept
