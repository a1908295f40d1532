# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in the scene of a page, targets and plots, drive reports, and whose drives it has."""

from __future__ import annotations

from collections.abc import Iterator
import math
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
import trimesh
from urdf_reader import read_urdf, Transform
from viser import ViserServer

from robot_viewer.nodes.interfaces import of_robot
from robot_viewer.page.jog_panel import (
    GREATEST_ACCELERATION,
    History,
    KEPT,
    motion_time,
    SHORTEST,
    STEP,
)
from robot_viewer.page.robot_scene import (
    Ground,
    Meshes,
    RobotScene,
    shapes_of,
    start_position,
    travel,
)
from robot_viewer.page.style import add_speed, drive_html


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.1, 3.0), st.floats(0.05, 1.0))
def test_a_motion_keeps_within_its_share(
    start: float, target: float, greatest: float, share: float
) -> None:
    """The quintic from rest to rest that a controller makes of one point, by its samples."""
    duration = motion_time({'a': start}, {'a': target}, {'a': greatest}, share)
    assert duration >= SHORTEST
    s = np.linspace(0.0, 1.0, 501)
    way = abs(target - start)
    velocity = way * (30 * s**2 - 60 * s**3 + 30 * s**4) / duration
    acceleration = way * (60 * s - 180 * s**2 + 120 * s**3) / duration**2
    assert velocity.max() <= share * greatest + 1e-9
    assert acceleration.max() <= share * GREATEST_ACCELERATION + 1e-9


def test_the_slowest_joint_says_how_long() -> None:
    """And one whose place is not known says nothing."""
    velocities = {'a': 1.0, 'b': 0.5}
    alone = motion_time({'b': 0.0}, {'b': 2.0}, velocities, 1.0)
    both = motion_time({'a': 0.0, 'b': 0.0}, {'a': 2.0, 'b': 2.0}, velocities, 1.0)
    assert both == alone > motion_time({'a': 0.0}, {'a': 2.0}, velocities, 1.0)
    assert motion_time({}, {'a': 9.0}, velocities, 1.0) == SHORTEST


def test_the_past_is_kept_for_half_a_minute() -> None:
    """With samples that are not nearer than needed, and of joints that have both."""
    history = History()
    for number in range(5000):
        now = 0.02 * number
        history.add({'a': now, 'b': 0.0}, {'a': now - 0.1, 'c': 0.0}, now)
    assert history.joints == ('a',)
    times, targets, positions = history.of('a')
    assert times[-1] - times[0] == pytest.approx(KEPT, abs=2 * STEP)
    assert min(np.diff(times)) >= STEP - 1e-9
    assert targets[-1] - positions[-1] == pytest.approx(0.1)
    assert not history.of('b').size


def test_a_drive_is_shown_with_what_it_reports() -> None:
    """What is empty has no row; what a device names itself is text and no markup."""
    values = {'state': 'Fault', 'emergency': '', 'emergencies': '<b>0x2310</b>', 'mode': 'CSP'}
    html = drive_html('over current', values, {'bus_load': '27.1'})
    for words in ('over current', '<td>Fault</td>', '<td>CSP</td>', '<td>27.1</td>'):
        assert words in html
    assert '&lt;b&gt;0x2310' in html
    assert '<td>EMCY</td>' not in html.replace(' style="vertical-align:top;padding-right:1em"', '')


TOPICS = ['/robot_description', '/left/robot_description', '/tf', '/left/joint_states']
NODES = ['/joint1', '/left/joint1', '/left/wrist/joint2', '/leftover/joint1']


@pytest.mark.parametrize(
    ('namespace', 'nodes'),
    [
        ('', ['/joint1', '/leftover/joint1']),
        ('/left', ['/left/joint1', '/left/wrist/joint2']),
        ('/left/wrist', ['/left/wrist/joint2']),
        ('/right', []),
    ],
)
def test_a_node_is_of_the_robot_that_is_nearest(namespace: str, nodes: list[str]) -> None:
    """Also where that robot's description has not been seen yet."""
    assert of_robot(f'{namespace}/robot_description', TOPICS, NODES) == nodes


URDF = """
<robot name="small">
  <material name="red"><color rgba="1 0 0 0.5"/></material>
  <link name="base">
    <visual><geometry><box size="1 2 3"/></geometry><material name="red"/></visual>
  </link>
  <link name="arm">
    <visual>
      <origin xyz="0 0 0.5"/><geometry><cylinder radius="0.1" length="1"/></geometry>
    </visual>
  </link>
  <link name="hand"><collision><geometry><sphere radius="0.2"/></geometry></collision></link>
  <link name="finger">
    <visual><geometry><mesh filename="{mesh}" scale="2 2 2"/></geometry></visual>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="hand"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0.1" upper="0.2" velocity="1" effort="1"/>
  </joint>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/>
  </joint>
  <joint name="follow" type="continuous">
    <parent link="arm"/><child link="hand"/><axis xyz="0 1 0"/>
    <mimic joint="turn" multiplier="-2" offset="0.1"/>
  </joint>
</robot>
"""

SHAPES = ('/shape0', '/arm/shape1', '/arm/hand/shape3')  # of base, arm and hand, below the base


@pytest.fixture
def server() -> Iterator[ViserServer]:
    """Serve a scene."""
    made = ViserServer('127.0.0.1', 8400, verbose=False)
    yield made
    made.stop()


def test_joints_move_what_hangs_on_them(server: ViserServer, tmp_path: Path) -> None:
    """A joint may stand before the one that it hangs on; one that follows moves along."""
    trimesh.creation.box().export(tmp_path / 'cube.stl')
    scene = RobotScene(server.scene, read_urdf(URDF.format(mesh=tmp_path / 'cube.stl')))
    assert scene.notes == []
    frames = scene._frames
    assert frames['slide'].name == '/robot/base/arm/hand/finger'
    assert frames['slide'].position.tolist() == pytest.approx([0.1, 0.0, 0.0]), 'next to zero'
    scene.place({'turn': 0.4, 'slide': 0.15, 'another': 3.0})
    assert frames['turn'].position.tolist() == [0.0, 0.0, 1.0]
    turn = [math.cos(0.2), 0.0, 0.0, math.sin(0.2)]
    assert frames['turn'].wxyz.tolist() == pytest.approx(turn)
    follow = [math.cos(-0.35), 0.0, math.sin(-0.35), 0.0]
    assert frames['follow'].wxyz.tolist() == pytest.approx(follow)
    assert frames['slide'].position.tolist() == pytest.approx([0.15, 0.0, 0.0])
    scene.place({'turn': 0.4, 'follow': 0.6})  # measured, as tf has it
    follow = [math.cos(0.3), 0.0, math.sin(0.3), 0.0]
    assert frames['follow'].wxyz.tolist() == pytest.approx(follow)
    scene.place({'turn': math.nan})
    assert frames['turn'].wxyz.tolist() == pytest.approx(turn)
    scene.place_base(Transform((1.0, 2.0, 3.0)))
    assert scene._base.position.tolist() == [1.0, 2.0, 3.0]


def test_links_of_faulty_joints_are_red_until_they_are_well(server: ViserServer) -> None:
    """Those of the page alone, not those of a ghost."""
    scene = RobotScene(server.scene, read_urdf(URDF.format(mesh='')))

    def colors() -> list[tuple[int, ...]]:
        nodes = (server.scene.get_handle_by_name(f'/robot/base{path}') for path in SHAPES)
        return [tuple(getattr(node, 'color', ())) for node in nodes]

    before = colors()
    scene.ghost('ghost', frozenset(scene.tree.links), (0.4, 0.3, 0.9, 0.3))
    scene.mark(['turn', 'another'])
    assert colors() == [before[0], (201, 41, 41), before[2]]
    scene.mark(['follow'])
    assert colors() == [*before[:2], (201, 41, 41)]
    scene.mark([])
    assert colors() == before


def test_a_robot_that_walks_away_stays_in_view(server: ViserServer) -> None:
    """The ground passes below it instead, by less than a section."""
    ground, turned = Ground(server.scene), (0.0, 0.0, 0.6, 0.8)
    assert ground.pass_below(Transform((5.3, -2.2, 0.1), turned)) == Transform(
        (0.0, 0.0, 0.1), turned
    )
    assert ground._grid.position.tolist() == pytest.approx([-0.3, -0.3, 0.0])
    ground.pass_below(Transform((math.inf, 0.0, 0.1)))  # of /tf, too


def test_what_cannot_be_shown_is_named_and_the_rest_is_there(server: ViserServer) -> None:
    """A mesh of a package that is not here."""
    scene = RobotScene(server.scene, read_urdf(URDF.format(mesh='package://nobody/cube.stl')))
    (note,) = scene.notes
    assert note.startswith('finger: package nobody is not installed')
    assert set(scene._frames) == {'turn', 'follow', 'slide'}


@pytest.mark.parametrize(
    ('mesh', 'content'),
    [('a.stl', 'solid nothing'), ('a.obj', 'f 1 2 3'), ('a.dae', '<COLLADA'), ('a.xyz123', '')],
)
def test_a_mesh_that_no_reader_takes_is_named(
    server: ViserServer, tmp_path: Path, mesh: str, content: str
) -> None:
    """Whatever its reader raises: the rest of the robot is there."""
    (tmp_path / mesh).write_text(content)
    scene = RobotScene(server.scene, read_urdf(URDF.format(mesh=tmp_path / mesh)))
    (found,) = scene.notes
    assert found.startswith('finger: ')


COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2026-01-01T00:00:00</created><modified>2026-01-01T00:00:00</modified>
<unit name="millimeter" meter="0.001"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="link"><mesh>
<source id="points"><float_array id="numbers" count="12">0 0 0 9 0 0 0 8 0 0 0 7</float_array>
<technique_common><accessor source="#numbers" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="corners"><input semantic="POSITION" source="#points"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#corners" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node id="node"><instance_geometry url="#link"/>
</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>"""


def test_a_mesh_is_shown_in_its_own_unit(tmp_path: Path) -> None:
    """A COLLADA file in millimetres, once; the reader leaves the unit to us."""
    (tmp_path / 'a.dae').write_text(COLLADA)
    shapes = shapes_of(read_urdf(URDF.format(mesh=tmp_path / 'a.dae')))
    mesh, scale = Meshes().read(next(each for each in shapes if each.shape == 'mesh'))
    assert scale == pytest.approx((0.002, 0.002, 0.002))
    assert mesh.extents == pytest.approx((9.0, 8.0, 7.0))


def test_a_color_that_is_none_is_named_and_its_shape_is_there(server: ViserServer) -> None:
    """Three numbers instead of four; in grey."""
    urdf = URDF.format(mesh='package://nobody/cube.stl').replace('1 0 0 0.5', '1 0 0')
    notes = RobotScene(server.scene, read_urdf(urdf)).notes
    assert notes[0] == 'base: <color rgba="1 0 0"> needs four numbers from 0 to 1; shown grey'


@pytest.mark.parametrize(
    ('kind', 'limit', 'ends'),
    [
        ('revolute', '<limit lower="0.1" upper="2" velocity="1" effort="1"/>', (0.1, 2.0)),
        ('continuous', '', (-math.pi, math.pi)),
        ('revolute', '', (-math.pi, math.pi)),
        ('revolute', '<limit lower="0" upper="0" velocity="1" effort="1"/>', (-math.pi, math.pi)),
    ],
)
def test_a_slider_has_two_ends(kind: str, limit: str, ends: tuple[float, float]) -> None:
    """Also that of a joint which a description gives none, or two that are equal."""
    links = '<link name="a"/><link name="b"/>'
    joint = f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>{limit}</joint>'
    (found,) = read_urdf(f'<robot name="r">{links}{joint}</robot>').movable()
    assert travel(found) == ends
    assert ends[0] <= start_position(found) <= ends[1]


@pytest.mark.parametrize(('typed', 'share'), [(40.0, 0.4), (500.0, 1.0), (-3.0, 0.05)])
def test_a_speed_that_is_typed_stays_in_the_range_of_its_slider(
    server: ViserServer, typed: float, share: float
) -> None:
    """A number box takes any number until it is left."""
    speed = add_speed(server.gui)
    (slider,) = server.gui._gui_input_handle_from_uuid.values()
    slider._impl.value = typed
    assert speed() == share
