# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plans and the scene on the page: in messages, and over DDS beside a fake move_group."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
import math
import time
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point
from hypothesis import given
from hypothesis import strategies as st
from isolation import Isolation
from moveit_msgs.action import ExecuteTrajectory, MoveGroup
from moveit_msgs.msg import (
    AttachedCollisionObject,
    CollisionObject,
    MoveItErrorCodes,
    PlanningScene,
)
from moveit_msgs.srv import ApplyPlanningScene, GetPlanningScene, GetPositionIK
import numpy as np
import pytest
from rclpy.node import Node
from sensor_msgs.msg import JointState
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive
from std_msgs.msg import String
from test_state_publisher import pose_in_root, published
from trajectory_msgs.msg import JointTrajectoryPoint
from urdf_reader import about, DescriptionError, link_poses, read_urdf, Transform
from urdf_robots import ARM, POSITIONS, random_urdfs
from viewer_rig import in_domain, ViewerRig

from node_runner import LATCHED
from node_runner.action_goals import Ending, GoalServer, ServedGoal
from robot_viewer.nodes.motion_plan import (
    LINE_POINTS,
    PAUSE,
    plan_groups,
    PlannedMotion,
    pose_message,
    refusal,
    SHOWINGS,
    tip_line,
)
from robot_viewer.nodes.motion_planning import ANSWER_TIME, DRAGGED, MotionPlanning, NO_GOAL
from robot_viewer.nodes.planning_scene import draw_object, SceneObject
from robot_viewer.page.robot_page import RobotPage
from robot_viewer.page.robot_scene import links_beyond, moved

TREE = read_urdf(ARM)
SRDF = """
<robot name="arm">
  <group name="hand"><joint name="finger_joint"/></group>
  <group name="whole"><chain base_link="base" tip_link="wheel"/></group>
  <group name="broken"><joint name="cart_joint"/></group>
  <group_state name="up" group="whole">
    <joint name="shoulder" value="0.5"/><joint name="elsewhere" value="1"/>
  </group_state>
  <end_effector name="tool" group="hand" parent_link="wheel" parent_group="whole"/>
</robot>
"""
TURNED = Transform((0.1, 0.2, 0.3), about((0.0, 0.0, 1.0), 0.5))


class Drawn:
    """A scene of the page that keeps what is drawn in it.

    Attributes:
        nodes: Kind of each, and what it is made of.
    """

    def __init__(self) -> None:
        self.nodes: list[tuple[str, Any]] = []

    def __getattr__(self, name: str) -> Any:
        """Return what adds a node of a kind."""

        def add(_path: str, *shape: object, **_options: object) -> Any:
            self.nodes.append(
                (name.removeprefix('add_'), SimpleNamespace(shape=shape, position=()))
            )
            return self.nodes[-1][1]

        return add


@given(random_urdfs(), st.floats(-3.0, 3.0))
def test_links_are_where_tf_has_them(urdf: str, position: float) -> None:
    """Of random robots, each joint at the same place."""
    tree = read_urdf(urdf)
    positions = {joint.name: position for joint in tree.movable() if joint.mimic is None}
    frames = published(tree, positions)
    for link in tree.links:
        pose = link_poses(tree, positions)[link]
        expected = pose_in_root(link, tree.root, frames)
        assert np.allclose(pose.translation, expected[:3, 3], atol=1e-9)


def test_a_joint_that_follows_moves_what_hangs_on_it() -> None:
    """Where it was measured, for the page as for tf; it goes along with a goal of its source."""
    followers = {joint.name: 0.3 for joint in TREE.movable() if joint.mimic}
    goal = moved(TREE, POSITIONS | followers, {'finger_joint': 0.1})
    for positions in (POSITIONS, POSITIONS | followers, goal):
        expected = pose_in_root('thumb', 'base', published(TREE, positions))
        pose = link_poses(TREE, positions)['thumb']
        assert np.allclose(pose.translation, expected[:3, 3], atol=1e-9)
    assert not goal.keys() & followers.keys()
    assert links_beyond(TREE, frozenset({'finger_joint'})) == {'finger', 'thumb'}
    assert links_beyond(TREE, frozenset({'roll'})) == {'wheel', 'finger', 'thumb'}


def test_groups_with_their_states_arms_first() -> None:
    """Of groups that can move; a state has the joints of its group."""
    groups = plan_groups(TREE, SRDF)
    assert list(groups) == ['whole', 'hand']
    assert groups['whole'].joints == ('shoulder', 'lift', 'roll')
    assert groups['whole'].tip == 'wheel'
    assert groups['whole'].states == {'up': {'shoulder': 0.5}}
    with pytest.raises(DescriptionError, match='no groups'):
        plan_groups(TREE, '<robot name="arm"/>')
    with pytest.raises(DescriptionError, match='cart_joint'):
        plan_groups(
            TREE, '<robot name="arm"><group name="g"><joint name="cart_joint"/></group></robot>'
        )


def test_a_motion_is_shown_a_few_times() -> None:
    """It goes through its points, rests at its ends, and pauses in between."""
    motion = PlannedMotion(('a',), (0.0, 1.0, 3.0), ((0.0,), (2.0,), (-2.0,)))
    assert motion.duration == 3.0
    places = [motion.at(time)['a'] for time in (-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0)]
    assert places == [0.0, 0.0, 1.0, 2.0, 0.0, -2.0, -2.0]
    cycle = motion.duration + PAUSE
    assert motion.shown(cycle + 0.5) == pytest.approx({'a': 1.0})
    assert motion.shown(cycle - 0.1) == {'a': -2.0}
    assert motion.shown(SHOWINGS * cycle + 0.1) is None
    assert PlannedMotion((), (), ()).at(1.0) == {}


def test_the_line_of_the_tip_goes_from_start_to_goal() -> None:
    """Joints beside the motion stand where they are."""
    motion = PlannedMotion(('shoulder',), (0.0, 2.0), ((-0.5,), (0.5,)))
    line = tip_line(TREE, 'wheel', {'lift': 0.3, 'shoulder': 9.0}, motion)
    assert len(line) == LINE_POINTS
    for place, angle in ((line[0], -0.5), (line[-1], 0.5)):
        expected = link_poses(TREE, {'lift': 0.3, 'shoulder': angle})['wheel'].translation
        assert place == pytest.approx(expected)


def test_all_shapes_are_drawn() -> None:
    """Shapes that are none are left out."""
    thing, kind = CollisionObject(id='part'), SolidPrimitive
    for shape, lengths in (
        (kind.SPHERE, [0.1]),
        (kind.CYLINDER, [0.2, 0.1]),
        (kind.CONE, [1.0, 0.5]),
        (99, [1.0, 1.0, 1.0]),
        (kind.BOX, [1.0, 1.0, 1.0]),
    ):
        thing.primitives.append(kind(type=shape, dimensions=lengths))
        thing.primitive_poses.append(pose_message(TURNED))
    corners = [Point(), Point(x=1.0), Point(y=1.0)]
    triangle = MeshTriangle(vertex_indices=[0, 1, 2])
    thing.meshes.append(Mesh(vertices=corners, triangles=[triangle]))
    thing.mesh_poses.append(pose_message(Transform()))
    drawn = Drawn()
    draw_object(drawn, 'part', SceneObject(thing))  # type: ignore[arg-type]
    assert [kind for kind, _ in drawn.nodes] == [
        'frame',
        'icosphere',
        'cylinder',
        'mesh_simple',
        'box',
        'mesh_simple',
    ]
    assert drawn.nodes[1][1].position == TURNED.translation
    vertices, faces = drawn.nodes[-1][1].shape
    assert vertices[1].tolist() == [1.0, 0.0, 0.0]
    assert faces.tolist() == [[0, 1, 2]]


def test_refusals_have_the_words_of_move_group() -> None:
    """With the code by its name."""
    code = MoveItErrorCodes(val=MoveItErrorCodes.GOAL_IN_COLLISION, message='a touches b')
    assert refusal(code) == 'GOAL_IN_COLLISION: a touches b'
    assert refusal(MoveItErrorCodes(val=MoveItErrorCodes.PREEMPTED)) == 'PREEMPTED'
    assert refusal(MoveItErrorCodes(val=-4711)) == 'code -4711'
    assert not refusal(MoveItErrorCodes(val=MoveItErrorCodes.SUCCESS))


@dataclass(slots=True, eq=False)
class Goal(ServedGoal):
    """A goal and its result."""

    result: Any = None
    is_good: bool = False


class Server:
    """An action whose goals end when the test says so, or when they are canceled."""

    def __init__(self, node: Node, action: Any, name: str) -> None:
        self.action = action
        self.goals: list[Goal] = []
        self.canceled: list[Goal] = []
        self._server = GoalServer(
            node,
            action,
            name,
            accept=Goal,
            start=self.goals.append,
            cancel=self._cancel,
            conclude=lambda goal: (
                Ending.SUCCEEDED if goal.is_good else Ending.CANCELED,
                goal.result,
            ),
            fail=lambda _, error: pytest.fail(str(error)),
        )

    def answer(self, code: int, message: str = '', **others: object) -> None:
        """End the last goal."""
        self._end(self.goals[-1], code, message, **others)

    def _end(self, goal: Goal, code: int, message: str, **others: object) -> None:
        error = MoveItErrorCodes(val=code, message=message)
        goal.result = self.action.Result(error_code=error, **others)
        goal.is_good = code == MoveItErrorCodes.SUCCESS
        self._server.end(goal)

    def _cancel(self, goal: Goal) -> None:
        self.canceled.append(goal)
        self._end(goal, MoveItErrorCodes.PREEMPTED, 'canceled')


class Planner(ViewerRig):
    """What the page takes for a move_group, and a robot."""

    def __init__(self) -> None:
        node = Node('move_group')
        super().__init__(node)
        self.objects: dict[str, SceneObject] = {}
        self.asked: list[Any] = []
        self.events: list[String] = []
        self.ik_code, self.held = MoveItErrorCodes.SUCCESS, ''
        self.move = Server(node, MoveGroup, 'move_action')
        self.execute = Server(node, ExecuteTrajectory, 'execute_trajectory')
        node.create_service(GetPositionIK, 'compute_ik', self._solve)
        node.create_service(ApplyPlanningScene, 'apply_planning_scene', self._apply)
        node.create_service(GetPlanningScene, 'get_planning_scene', self._whole)
        node.create_subscription(String, 'trajectory_execution_event', self.events.append, 10)
        self._scene = node.create_publisher(PlanningScene, 'monitored_planning_scene', LATCHED)
        self._texts = [
            node.create_publisher(String, name, LATCHED)
            for name in ('robot_description', 'robot_description_semantic')
        ]
        for publisher, text in zip(self._texts, (ARM, SRDF), strict=True):
            publisher.publish(String(data=text))
        states = node.create_publisher(JointState, 'joint_states', 10)
        state = JointState(name=['shoulder', 'lift', 'roll'], position=[0.1, 0.2, 0.3])
        node.create_timer(0.05, lambda: states.publish(state))

    @property
    def panel(self) -> MotionPlanning:
        """That of the page."""
        return self.viewer._planning

    @property
    def said(self) -> str:
        """What the panel says."""
        return self.panel.outcome.content if self.panel.offered else ''

    def do(self, action: str, *arguments: Any, **options: Any) -> None:
        """Do it as a button of the page does."""
        plan = self.panel
        actor = plan if hasattr(plan, action) else plan.scene
        if action in {'execute', 'go_on'} and not arguments:
            arguments = (time.monotonic(),)
        plan.order(partial(getattr(actor, action), *arguments, **options))
        if action == 'execute':  # its button is held until the test lets it go
            plan.order(lambda: setattr(plan, '_held_at', math.inf))

    def plan(self) -> None:
        """Have a motion to the state 'up' planned."""
        count = len(self.move.goals)
        self.do('choose_goal', 'up')
        self.do('plan')
        self.spin_until(lambda: len(self.move.goals) > count, 'a goal')
        self.move.answer(MoveItErrorCodes.SUCCESS, planned_trajectory=_trajectory())
        self.spin_until(lambda: 'takes 2.0 s' in self.said, 'a plan')

    def _solve(self, request: Any, answer: Any) -> Any:
        self.asked.append(request.ik_request)
        answer.error_code = MoveItErrorCodes(val=self.ik_code, message='out of reach')
        answer.solution.joint_state = JointState(name=['shoulder', 'lift'], position=[0.7, 0.8])
        return answer

    def _apply(self, request: Any, answer: Any) -> Any:
        answer.success = True
        for each in request.scene.world.collision_objects:
            known = self.objects.pop(each.id, None)
            if each.operation == CollisionObject.MOVE and known is not None:
                known.message.pose = each.pose
                self.objects[each.id] = known
            elif each.operation == CollisionObject.ADD:
                self.objects[each.id] = SceneObject(each)
        self._scene.publish(request.scene)
        return answer

    def _whole(self, _: Any, answer: Any) -> Any:
        answer.scene.world.collision_objects = [each.message for each in self.objects.values()]
        if self.held:
            body = AttachedCollisionObject(object=CollisionObject(id=self.held))
            answer.scene.robot_state.attached_collision_objects = [body]
        return answer

    def grasp(self, name: str) -> None:
        """Let the robot hold an object, or none, as any client of move_group does."""
        self.held = name
        change = PlanningScene(is_diff=True)
        change.robot_state.is_diff = bool(name)
        change.robot_state.attached_collision_objects = [AttachedCollisionObject()] * bool(name)
        self._scene.publish(change)


def _trajectory() -> Any:
    trajectory = MoveGroup.Result().planned_trajectory
    joints = trajectory.joint_trajectory
    joints.joint_names = ['shoulder', 'lift', 'roll']
    for seconds, place in ((0, 0.1), (2, 0.5)):
        point = JointTrajectoryPoint(positions=[place, 0.2, 0.3])
        point.time_from_start = Duration(sec=seconds)
        joints.points.append(point)
    return trajectory


@pytest.fixture
def planner(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> Iterator[Planner]:
    """Start the page beside a move_group, as if it were open, and wait for the panel."""
    monkeypatch.setattr(RobotPage, 'watched', True)
    with in_domain(isolation, 'port:=8600'), closing(Planner()) as made:
        made.spin_until(lambda: made.panel.offered, 'the panel')
        made.spin_until(lambda: made.node.count_subscribers('joint_states') > 0, 'the page')
        made.spin_until(lambda: len(made.viewer._positions) > 2, 'joint states')
        yield made


@pytest.mark.scenario
def test_what_is_planned_is_executed_once(planner: Planner) -> None:
    """The goal is the state of the SRDF; nothing is executed before somebody says so."""
    planner.plan()
    goal = planner.move.goals[-1].handle.request
    assert goal.planning_options.plan_only
    assert goal.request.group_name == 'whole'
    assert goal.request.max_velocity_scaling_factor == 0.2
    (constraints,) = goal.request.goal_constraints
    wanted = {each.joint_name: each.position for each in constraints.joint_constraints}
    assert wanted == {'shoulder': 0.5, 'lift': 0.2, 'roll': 0.3}
    assert not planner.execute.goals
    planner.do('execute')
    planner.do('execute')
    planner.spin_until(lambda: bool(planner.execute.goals), 'an execution')
    assert planner.execute.goals[-1].handle.request.trajectory == _trajectory()
    planner.do('plan')
    planner.spin_until(lambda: 'still executing' in planner.said, 'a refusal')
    planner.execute.answer(MoveItErrorCodes.SUCCESS)
    planner.spin_until(lambda: 'executed' in planner.said, 'the end')
    planner.do('execute')
    planner.spin_until(lambda: 'nothing is planned' in planner.said, 'a refusal')
    assert len(planner.execute.goals) == len(planner.move.goals) == 1
    planner.plan()
    planner.viewer.page._command('cancel', '')  # by Esc
    planner.do('execute')
    planner.spin_until(lambda: 'nothing is planned' in planner.said, 'no plan any more')


@pytest.mark.scenario
def test_a_goal_that_is_chosen_meanwhile_stays(planner: Planner) -> None:
    """The end of an execution takes its own goal away, and no other."""
    planner.plan()
    planner.do('execute')
    planner.spin_until(lambda: bool(planner.execute.goals), 'an execution')
    planner.do('choose_goal', DRAGGED)
    planner.spin_until(lambda: planner.panel.goal.value == DRAGGED, 'another goal')
    planner.execute.answer(MoveItErrorCodes.SUCCESS)
    planner.spin_until(lambda: 'executed' in planner.said, 'the end')
    assert planner.panel.goal.value == DRAGGED
    planner.plan()
    planner.do('execute')
    planner.spin_until(lambda: len(planner.execute.goals) == 2, 'an execution')
    planner.execute.answer(MoveItErrorCodes.SUCCESS)
    planner.spin_until(lambda: planner.panel.goal.value == NO_GOAL, 'no goal')


@pytest.mark.scenario
def test_a_refusal_is_shown_in_its_words(planner: Planner) -> None:
    """And nothing can be executed."""
    planner.do('plan')
    planner.spin_until(lambda: 'choose a goal' in planner.said, 'a refusal')
    planner.do('choose_goal', 'up')
    planner.do('plan')
    planner.spin_until(lambda: bool(planner.move.goals), 'a goal')
    planner.move.answer(MoveItErrorCodes.GOAL_IN_COLLISION, 'wheel touches <box>')
    words = 'GOAL_IN_COLLISION: wheel touches &lt;box&gt;'
    planner.spin_until(lambda: words in planner.said, 'the words')
    planner.do('execute')
    planner.spin_until(lambda: 'nothing is planned' in planner.said, 'a refusal')
    assert not planner.execute.goals


@pytest.mark.scenario
def test_stop_cancels_and_forgets(planner: Planner) -> None:
    """An execution, at once or before it was accepted; a plan; one that is being made."""
    planner.plan()
    planner.do('execute')
    planner.spin_until(lambda: bool(planner.execute.goals), 'an execution')
    planner.viewer.actions.stop()
    planner.spin_until(lambda: bool(planner.execute.canceled), 'a cancel')
    planner.spin_until(lambda: [each.data for each in planner.events] == ['stop'], 'the event')
    planner.spin_until(lambda: 'PREEMPTED: canceled' in planner.said, 'the end')
    planner.plan()
    planner.do('execute')
    planner.viewer.actions.stop()  # in the same turn
    planner.spin_until(lambda: len(planner.execute.canceled) == 2, 'a cancel')
    planner.spin_until(lambda: not planner.panel.busy, 'its end')
    planner.plan()
    planner.viewer.actions.stop()
    planner.do('execute')  # it came late
    planner.spin_until(lambda: 'nothing is planned' in planner.said, 'a refusal')
    planner.do('choose_goal', 'up')
    planner.do('plan')
    planner.spin_until(lambda: len(planner.move.goals) == 4, 'a goal')
    planner.viewer.actions.stop()
    planner.spin_until(lambda: bool(planner.move.canceled), 'a cancel')
    planner.spin_until(lambda: not planner.viewer._orders, 'the end')
    assert planner.panel.hold in planner.viewer.page.live.off
    assert len(planner.execute.goals) == 2


@pytest.mark.scenario
@pytest.mark.parametrize('how', ['let go', 'lost'])
def test_an_execution_goes_on_as_long_as_its_button_is_held(planner: Planner, how: str) -> None:
    """It is canceled when that is let go, or when its heartbeats do not come any more."""
    planner.plan()
    planner.do('execute')
    planner.spin_until(lambda: bool(planner.execute.goals), 'an execution')
    planner.spin_times(20)
    assert not planner.execute.canceled
    live, hold = planner.viewer.page.live, planner.panel.hold
    assert live._deadman.beat(1, hold, time.monotonic())
    planner.do('let_go' if how == 'let go' else 'go_on')
    planner.spin_until(lambda: bool(planner.execute.canceled), 'a cancel')
    why = 'its button was let go' if how == 'let go' else 'heartbeats of its held button came late'
    planner.spin_until(lambda: f'ended, as {why} (PREEMPTED' in planner.said, 'the reason')
    assert not live._deadman.beat(1, hold, time.monotonic()), 'it has to be let go'
    assert not live.held


@pytest.mark.scenario
def test_a_move_group_that_has_gone_ends_the_press_and_its_reasons(planner: Planner) -> None:
    """Why its execution was canceled is no reason of the next one's failure."""
    plan, live = planner.panel, planner.viewer.page.live
    planner.plan()
    planner.do('execute')
    planner.spin_until(lambda: bool(planner.execute.goals), 'an execution')
    assert live._deadman.beat(1, planner.panel.hold, time.monotonic())
    plan.order(plan.let_go)
    plan.order(partial(plan.look, {}))  # in the same turn
    planner.spin_until(lambda: 'move_group is gone' in planner.said, 'its end')
    assert not live._deadman.beat(1, planner.panel.hold, time.monotonic() + 1.0)
    planner.plan()
    planner.do('execute')
    planner.spin_until(lambda: len(planner.execute.goals) == 2, 'an execution')
    planner.execute.answer(MoveItErrorCodes.CONTROL_FAILED)
    planner.spin_until(lambda: 'CONTROL_FAILED' in planner.said, 'a failure')
    assert 'ended, as' not in planner.said


@pytest.mark.scenario
def test_a_press_that_waited_too_long_executes_nothing(planner: Planner) -> None:
    """A node that was held up learns of it when the button may be up already."""
    planner.plan()
    planner.do('execute', time.monotonic() - 1.0)
    planner.spin_times(20)
    assert not planner.execute.goals
    planner.do('execute')
    planner.spin_until(lambda: bool(planner.execute.goals), 'an execution')


@pytest.mark.scenario
def test_a_goal_is_dragged(planner: Planner) -> None:
    """Joints with which the tip is there are the goal; without any, nothing is planned."""
    planner.do('choose_goal', DRAGGED)
    for x in (0.3, 0.4, 0.5):
        planner.do('drag_goal', Transform((x, 0.0, 0.5)))
    planner.spin_until(lambda: len(planner.asked) >= 2, 'inverse kinematics')
    assert len(planner.asked) == 2, 'those in between are left out'
    last = planner.asked[-1]
    assert (last.ik_link_name, last.pose_stamped.header.frame_id) == ('wheel', 'base')
    assert last.pose_stamped.pose.position.x == 0.5
    planning = planner.panel
    planner.spin_until(lambda: planning._pose is None, 'a solution')
    planner.do('plan')
    planner.spin_until(lambda: len(planner.move.goals) == 1, 'a goal')
    (joints,) = planner.move.goals[-1].handle.request.request.goal_constraints
    places = {each.joint_name: each.position for each in joints.joint_constraints}
    assert places == {'shoulder': 0.7, 'lift': 0.8}
    planning._asked = time.monotonic() - ANSWER_TIME  # its answer was lost
    planner.ik_code = MoveItErrorCodes.NO_IK_SOLUTION
    planner.do('drag_goal', Transform((9.0, 0.0, 0.5)))
    planner.spin_until(lambda: 'NO_IK_SOLUTION: out of reach' in planner.said, 'the words')
    planner.do('plan')
    planner.spin_until(lambda: 'no joints are known' in planner.said, 'a refusal')
    assert len(planner.move.goals) == 1


@pytest.mark.scenario
def test_boxes_come_move_and_go(planner: Planner) -> None:
    """As move_group has them; one that was added can be dragged at once."""
    planner.do('add_box', (0.1, 0.2, 0.4))
    planner.spin_until(lambda: 'box1' in planner.objects, 'a box')
    assert planner.objects['box1'].pose.translation[2] == pytest.approx(0.2), 'on the ground'
    planner.spin_until(lambda: planner.panel.scene.chosen.value == 'box1', 'the choice')
    assert planner.panel.scene.gizmo is not None
    planner.do('drag', Transform((1.0, 0.0, 0.0)), is_last=False)
    planner.do('drag', Transform((2.0, 0.0, 0.0)), is_last=True)
    planner.spin_until(lambda: 'is moved' in planner.said, 'a move')
    assert planner.objects['box1'].pose.translation[0] == 2.0
    planner.do('add_box', (0.1, 0.2, 0.4))
    planner.spin_until(lambda: planner.panel.scene.chosen.value == 'box2', 'the choice')
    planner.do('show_objects', False)
    drawn = planner.panel.scene._drawn
    planner.spin_until(lambda: not any(each.visible for _, each in drawn.values()), 'no object')
    planner.do('choose', 'box1')
    planner.do('remove_chosen')
    planner.spin_until(lambda: set(planner.objects) == {'box2'}, 'the end of it')
    scene = planner.panel.scene
    planner.spin_until(lambda: scene.chosen.options == ('none', 'box2'), 'the list')
    assert scene.gizmo is None
    planner.grasp('part')
    planner.spin_until(lambda: 'part' in scene._objects, 'what it holds')
    attached = {name: each.attached for name, each in scene._objects.items()}
    assert attached == {'box2': False, 'part': True}
    planner.grasp('')
    planner.spin_until(lambda: 'part' not in scene._objects, 'it let that go')
