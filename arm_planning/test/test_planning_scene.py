# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes, states and paths as messages and back: nothing is lost; what viewers get, and when.

Refusals: test_planning_bad_input.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Point32, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from hypothesis import given, settings
from hypothesis import strategies as st
from move_group_rig import joint_goal, pose_goal
from moveit_msgs import msg
import numpy as np
from planning_messages import (
    box,
    numbers_of,
    objects,
    panda,
    pose_at,
    poses,
    QuietNode,
    tetrahedron,
    texts_of,
)
import pytest
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive

from arm_model import AllowedCollisionMatrix, Clearances, ModelError
from arm_model.ros import allowed_collisions, apply_planning_scene, scene_change, seconds
from arm_planning import JointGoal, Parameterization, PlanningCode, PlanningError
from arm_planning.ros import scene_monitor
from arm_planning.ros.motion_request import RequestReader
from arm_planning.ros.robot_groups import RobotGroups
from arm_planning.ros.scene import (
    collision_message,
    matrix_message,
    scene_message,
    SceneSnapshot,
)
from arm_planning.ros.scene_changes import apply_scene
from arm_planning.ros.scene_monitor import SceneMonitor
from arm_planning.ros.trajectories import check_trajectory, path_of, trajectory_message
from arm_trajectory import lines, Path


def test_a_goal_has_the_tolerance_of_the_nearer_side() -> None:
    """The joints that it leaves out stay; those of which nothing is known are in their range."""
    model = panda().model('panda_arm')
    message = msg.JointConstraint(joint_name=model.joints[0], position=0.5)
    message.tolerance_above, message.tolerance_below = 0.3, 0.01
    reader = RequestReader(model, SceneSnapshot(panda().scene), panda().positions({}))
    goal = reader.goal(msg.Constraints(joint_constraints=[message]))
    assert isinstance(goal, JointGoal)
    assert goal.positions[0] == 0.5
    assert goal.tolerance[0] == pytest.approx(0.01)
    assert (goal.positions >= model.limits.lower).all()
    assert (goal.positions <= model.limits.upper).all()


def test_path_constraints_are_those_that_clients_mean() -> None:
    """In the frames of links; a point beside the link; the sides of a joint's range differ."""
    model, frame = panda().model('panda_arm'), 'panda_link4'
    quarter = Quaternion(x=math.sqrt(0.5), w=math.sqrt(0.5))
    pose = PoseMessage(position=Point(x=0.1, y=0.2, z=0.3), orientation=quarter)
    wanted = pose_goal(pose, TIP, frame)
    (place,), (turn,) = wanted.position_constraints, wanted.orientation_constraints
    place.target_point_offset.z, turn.absolute_x_axis_tolerance = 0.1, 0.3
    place.constraint_region.primitive_poses[0].orientation = quarter
    wanted.joint_constraints = joint_goal(
        [-2.2], [frame.replace('link', 'joint')]
    ).joint_constraints
    wanted.joint_constraints[0].tolerance_above = 0.35
    wanted.joint_constraints[0].tolerance_below = 0.2
    reader, link = RequestReader(model, EMPTY, READY), panda().kinematics.link_pose(frame, READY)
    for kind in Parameterization:
        turn.parameterization = int(kind)
        found = reader.constraints(wanted)
        assert found is not None
        assert found.joints == {'panda_joint4': pytest.approx((-2.4, -1.85))}
        (point,), (held,) = found.positions, found.orientations
        assert (point.link, held.link, held.parameterization) == (TIP, TIP, kind)
        assert point.offset.tolist() == [0.0, 0.0, 0.1]
        there = link.position + link.rotation @ [0.1, 0.2, 0.3]
        assert point.regions[0].pose.position == pytest.approx(there)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
        assert held.rotation == pytest.approx(link.rotation @ about_x)
        assert point.regions[0].pose.rotation == pytest.approx(link.rotation @ about_x)
        assert held.tolerance.tolist() == [0.3, 1e-3, 1e-3]


@given(st.lists(st.one_of(st.floats(1e-12, 1e-8), st.floats(1e-4, 2.0)), min_size=1, max_size=8))
def test_points_of_a_path_have_times_that_increase(durations: list[float]) -> None:
    """A phase of a motion may be shorter than a nanosecond; the ends are where they are."""
    rates = np.random.default_rng(len(durations)).uniform(-1.0, 1.0, (len(durations), 2))
    lasts = np.array(durations)
    ways = np.cumsum(rates * lasts[:, None], axis=0)
    path = Path(lasts, lines(lasts, np.concatenate((np.zeros((1, 2)), ways))))
    trajectory = trajectory_message(['a', 'b'], path, 'base').joint_trajectory
    check_trajectory(trajectory)
    first, last = trajectory.points[0], trajectory.points[-1]
    assert first.positions == pytest.approx([0.0, 0.0], abs=1e-8)
    assert last.positions.tolist() == path.end.position.tolist()
    assert seconds(last.time_from_start) == pytest.approx(path.duration, abs=1e-9)


def test_points_of_a_path_are_near_to_each_other_and_make_it() -> None:
    """Viewers show one after the other; what interpolates them has the path.

    With accelerations exactly; positions alone are met at the points.
    """
    random = np.random.default_rng(0)
    for duration in (0.05, 0.73, 2.0):
        path = Path(np.array([duration]), random.uniform(-1.0, 1.0, (1, 6, 3)))
        trajectory = trajectory_message(['a', 'b', 'c'], path, 'base').joint_trajectory
        times = [seconds(point.time_from_start) for point in trajectory.points]
        assert np.diff(times).max() <= 0.1 + 1e-9
        looks = np.linspace(0.0, path.duration, 500)
        assert path_of(trajectory).positions(looks) == pytest.approx(
            path.positions(looks), abs=1e-6
        )
        for field in ('accelerations', 'velocities'):
            for point in trajectory.points:
                setattr(point, field, [])
            met = path_of(trajectory).positions(np.array(times))
            assert met == pytest.approx(path.positions(np.array(times)), abs=1e-6)


def test_a_robot_without_groups_is_refused() -> None:
    """Nothing could be planned."""
    with pytest.raises(ModelError, match='no group'):
        RobotGroups('<robot name="r"><link name="base"/></robot>', '<robot name="r"/>', {})


JOINT = panda().joints[0]


class TickingNode(QuietNode):
    """A node whose clock, topics and timers are in the hands of the test."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        monkeypatch.setattr(f'{SceneMonitor.__module__}.time.monotonic', lambda: self.now)
        self.published: list[msg.PlanningScene] = []
        self.warnings: list[str] = []
        self.receive: dict[str, Callable[[Any], None]] = {}
        self.tick: Callable[[], None] = lambda: None
        self.get_clock = lambda: SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))
        self.get_logger = lambda: SimpleNamespace(warning=self.warnings.append)
        self.create_timer = lambda _, callback: setattr(self, 'tick', callback)

    def create_publisher(self, _kind: Any, topic: str, _qos: Any) -> Any:
        """Keep what is published for viewers."""
        is_shown = topic == 'monitored_planning_scene'
        return SimpleNamespace(publish=self.published.append if is_shown else lambda _: None)

    def create_subscription(
        self, _kind: Any, topic: str, callback: Any, *_: Any, **__: Any
    ) -> None:
        """Keep who listens."""
        self.receive[topic] = callback

    def at(self, position: float) -> None:
        """Have the first joint somewhere a moment later, and look."""
        self.now += 0.06
        self.receive['joint_states'](JointState(name=[JOINT], position=[position]))
        self.tick()


@pytest.fixture(name='node')
def make_node(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a node."""
    return TickingNode(monkeypatch)


def test_a_robot_that_has_come_to_rest_is_shown_there_once(node: Any) -> None:
    """Not on its way, and not again where it stays; noise is no motion."""
    SceneMonitor(node, panda())
    for position in (0.1, 0.2, 0.3):
        node.at(position)
    assert len(node.published) == 1
    for position in (0.3001, 0.3, 0.2999):
        node.at(position)
    assert len(node.published) == 2
    scene = node.published[-1]
    state = scene.robot_state.joint_state
    assert dict(zip(state.name, state.position, strict=True))[JOINT] == 0.3001
    assert not scene.is_diff


def test_an_arm_moves_until_it_stands_or_nothing_comes_of_it(node: Any) -> None:
    """It may coast; noise is no motion, what is not known yet or is no number is none."""
    monitor, place, moves = SceneMonitor(node, panda()), 0.0, []
    with pytest.raises(PlanningError, match='not received yet') as caught:
        monitor.received([JOINT])
    assert caught.value.code is PlanningCode.ROBOT_STATE_STALE
    for step in (0.0, 0.0005, 0.01, 0.005, 0.0005, -0.0005, 0.0):
        place += step
        node.at(place)
        moves.append(monitor.is_moving('panda_arm'))
    assert moves == [False, False, True, True, False, False, False]
    assert not monitor.is_moving('no group')
    for place in (0.0, math.inf, 0.1, 0.2):
        node.at(place)
    assert monitor.is_moving('panda_arm')
    assert monitor.received([JOINT]) == {JOINT: 0.2}
    node.now += 2.0
    node.receive['joint_states'](JointState(name=['panda_joint2'], position=[0.0]))
    assert not monitor.is_moving('panda_arm')
    with pytest.raises(PlanningError, match=r'2\.0 s old') as caught:
        monitor.received([JOINT])
    assert caught.value.code is PlanningCode.ROBOT_STATE_STALE
    assert 'start state' not in str(caught.value)
    with pytest.raises(PlanningError, match=f"no joint 'foo'; joints: {JOINT}"):
        monitor.received(['foo'])


def test_whatever_a_scene_raises_refuses_that_scene_only(
    node: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An executor would end the program."""
    monitor = SceneMonitor(node, panda())
    before = monitor.snapshot
    with monkeypatch.context() as broken:
        broken.setattr(scene_monitor, 'apply_scene', lambda *_: 1 // 0)
        for _ in range(3):
            node.receive['planning_scene'](msg.PlanningScene())
    assert monitor.snapshot is before
    assert 'planning_scene refused: CRASH: ZeroDivisionError' in node.warnings[0]
    assert len(node.warnings) == 1  # a sensor may go on


READY = panda().positions(
    dict(zip(panda().joints, [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], strict=False))
)
EMPTY = SceneSnapshot(panda().scene)
NAMES = ['table', 'cup', 'panda_link1', 'panda_link5', 'tool']
TIP = 'panda_link8'


def edited(message: msg.PlanningScene, snapshot: SceneSnapshot = EMPTY) -> SceneSnapshot:
    """Return a scene after a message."""
    return apply_scene(snapshot, message, READY)


def sent(snapshot: SceneSnapshot) -> msg.PlanningScene:
    """Return a scene as a message."""
    return scene_message(snapshot, panda().name, msg.RobotState())


def with_objects(*messages: Any, snapshot: SceneSnapshot = EMPTY) -> SceneSnapshot:
    """Return a scene after messages of objects."""
    for message in messages:
        snapshot = apply_scene(snapshot, scene_change(message), READY)
    return snapshot


def test_a_mesh_beside_a_prism_comes_back_as_it_was() -> None:
    """A prism, which counts as its hull, does not take its place."""
    message = box('thing', 0.5, 0.0, 0.2)
    prism = SolidPrimitive(type=SolidPrimitive.PRISM, dimensions=[0.2])
    prism.polygon.points = [Point32(x=x, y=y) for x, y in ((0.0, 0.0), (0.1, 0.0), (0.0, 0.1))]
    message.primitives.append(prism)
    message.primitive_poses.append(pose_at(0.3))
    message.meshes, message.mesh_poses = [tetrahedron(0.1)], [pose_at(0.6)]
    (back,) = sent(with_objects(message)).world.collision_objects
    assert [len(each.vertices) for each in back.meshes] == [6, 4]
    assert back.meshes[1] == message.meshes[0]
    assert back.mesh_poses[1] == message.mesh_poses[0]


@pytest.mark.slow
@settings(deadline=None, max_examples=25)
@given(first=objects('table'), second=objects('cup'), held=objects('tool'), data=st.data())
def test_a_whole_scene_comes_back_as_it_was(
    first: msg.CollisionObject,
    second: msg.CollisionObject,
    held: msg.CollisionObject,
    data: st.DataObject,
) -> None:
    """What get_planning_scene answers makes the same scene elsewhere.

    Objects have shapes, poses, planes, meshes with their triangles, subframes and type.
    """
    message = msg.PlanningScene(
        name='lab', link_padding=[msg.LinkPadding(link_name=TIP, padding=0.0)]
    )
    message.link_padding.append(msg.LinkPadding(link_name='panda_link5', padding=0.01))
    message.link_scale = [msg.LinkScale(link_name='panda_link5', scale=1.1)]
    message.world.collision_objects = [first, second]
    message.object_colors = [msg.ObjectColor(id='cup')]
    message.object_colors[0].color.r = 0.5
    held.pose = data.draw(poses())
    message.robot_state.attached_collision_objects = [
        msg.AttachedCollisionObject(
            link_name=TIP, object=held, touch_links=['panda_hand'], weight=0.5
        )
    ]
    once = edited(message)
    first_sent = sent(once)
    assert not first_sent.is_diff
    by_name = {each.id: each for each in first_sent.world.collision_objects}
    for thing in (first, second):
        assert numbers_of(by_name[thing.id]) == pytest.approx(numbers_of(thing), abs=1e-9)
        assert texts_of(by_name[thing.id]) == texts_of(thing)
    twice = edited(first_sent)
    assert numbers_of(sent(twice)) == pytest.approx(numbers_of(first_sent), abs=1e-9)
    assert texts_of(sent(twice)) == texts_of(first_sent)
    assert list(twice.scene.pairs) == list(once.scene.pairs)


@settings(deadline=None, max_examples=20)
@given(thing=objects('thing'), held=objects('held'))
def test_controllers_make_the_scene_that_the_planner_has(
    thing: msg.CollisionObject, held: msg.CollisionObject
) -> None:
    """Of what is published for them; objects with meshes, attached ones too."""
    message = msg.PlanningScene(link_padding=[msg.LinkPadding(link_name=TIP, padding=0.01)])
    message.world.collision_objects = [thing]
    body = msg.AttachedCollisionObject(link_name=TIP, object=held)
    message.robot_state.attached_collision_objects = [body]
    planned = edited(message)
    received = collision_message(planned, panda().name)
    things = received.world.collision_objects
    assert not any(mesh.triangles for each in things for mesh in each.meshes)
    made = apply_planning_scene(panda().scene, received, READY)
    assert made.pairs == planned.scene.pairs
    one, other = (Clearances(each).least(READY, math.inf) for each in (planned.scene, made))
    apart = one > 1e-3  # of shapes deep in each other, two ways out may be found
    assert one[apart] == pytest.approx(other[apart], abs=1e-4)


@given(
    entries=st.dictionaries(
        st.lists(st.sampled_from(NAMES), min_size=2, max_size=2, unique=True).map(frozenset),
        st.booleans(),
    ),
    defaults=st.dictionaries(st.sampled_from(NAMES), st.booleans()),
)
def test_a_matrix_allows_the_same_after_a_message(
    entries: dict[frozenset[str], bool], defaults: dict[str, bool]
) -> None:
    """For every pair of its names, and for those with a name that it does not have."""
    matrix = AllowedCollisionMatrix(entries, defaults)
    back = allowed_collisions(matrix_message(matrix))
    for first in NAMES:
        for second in (*NAMES, 'new'):
            assert back.allows(first, second) == matrix.allows(first, second)
    assert back.defaults == matrix.defaults
    assert not any(back.entries[pair] for pair in back.entries.keys() - entries.keys())
    assert allowed_collisions(matrix_message(back)) == back


def test_poses_are_in_the_frame_of_the_header() -> None:
    """A link, another object, or a subframe of one, of the same message too."""
    table = box('table', 0.5, 0.0, 0.2)
    table.subframe_names, table.subframe_poses = ['corner'], [pose_at(0.1, 0.2, 0.3)]
    on_corner, on_tip = box('cup', 0.0, 0.0, 0.1), box('cap', 0.0, 0.0, 0.2)
    on_corner.header.frame_id, on_tip.header.frame_id = 'table/corner', TIP
    snapshot = with_objects(box('none', 0.0, 0.9, 0.0), table)
    snapshot = with_objects(on_corner, on_tip, snapshot=snapshot)
    assert snapshot.frame('cup', READY).position == pytest.approx([0.6, 0.2, 0.6])
    tip = panda().kinematics.link_pose(TIP, READY)
    above = tip.position + 0.2 * tip.rotation[:, 2]
    assert snapshot.frame('cap', READY).position == pytest.approx(above)
