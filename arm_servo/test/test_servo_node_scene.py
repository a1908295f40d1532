# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The topic of the scene: what comes on it counts for the arm, and what is wrong is logged."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from geometry_msgs.msg import Point, Pose
from isolation import Isolation
from model_robots import table, texts
from moveit_msgs.msg import CollisionObject, LinkPadding, PlanningScene, PlanningSceneWorld
from moveit_msgs.srv import GetPlanningScene
import pytest
from rclpy.serialization import serialize_message
from ros_client import RosClient
from servo_commands import Drives, held_panda
from servo_nodes import Listener
from shape_msgs.msg import SolidPrimitive

from arm_model import Clearances, RobotModel
from arm_servo.ros.scene_listener import ANSWER_TIMEOUT, SceneListener
from node_runner import LATCHED


def message(name: str, frame: str = '', *, is_diff: bool = False) -> PlanningScene:
    """Return a whole scene with a box, or one that adds it."""
    shape = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.1, 0.1])
    box = CollisionObject(id=name, primitives=[shape], pose=Pose(position=Point(x=2.0)))
    box.header.frame_id = frame
    return PlanningScene(is_diff=is_diff, world=PlanningSceneWorld(collision_objects=[box]))


def arm() -> Drives:
    """Return the drives of an arm with a scene of its own, of which nothing is known yet."""
    return Drives(model=RobotModel(*texts('panda'), table('panda')))


def following() -> tuple[Drives, Listener]:
    """Return an arm whose place is known, and what listens for its scenes."""
    drives = arm().following()
    return drives, Listener(drives)


def objects(drives: Drives) -> set[str]:
    """Return the names of the objects that count for an arm."""
    return set(drives.gateway.model.scene.objects)


def test_scenes_count_once_the_arm_is_known_and_a_wrong_one_does_not() -> None:
    """The last whole scene before the first feedback is enough.

    Nothing is built in the thread that receives it, and one that cannot be built yet waits.
    """
    drives = arm()
    listener = Listener(drives)
    listener.take(message('early'))
    listener.take(message('box'))
    listener.run()
    assert not objects(drives)
    drives.following()
    listener.run()
    assert objects(drives) == {'box'}
    listener.take(message('cup', 'nowhere'))
    drives.run(5)
    assert not listener.errors
    listener.run()
    assert objects(drives) == {'box'}
    assert "'cup': no frame 'nowhere'" in listener.errors[0]
    assert 'the scene before counts' in listener.errors[0]
    listener.take(message('jug'))
    axes = drives.axes
    drives.axes = [replace(axis, position=math.nan, followable=False) for axis in axes]
    drives.run()
    assert drives.gateway.snapshot.reference is None
    listener.run()
    assert objects(drives) == {'box'}
    drives.axes = axes
    drives.run()
    listener.run()
    assert objects(drives) == {'jug'}
    listener.publishers = 1
    listener.made._take_foreign(b'no message')  # beside ours another move_group's is not read
    listener.publishers = 0
    listener.made._take_foreign(serialize_message(message('lid')))
    listener.run()
    assert objects(drives) == {'lid'}


def test_padding_of_a_scene_counts_for_the_arm() -> None:
    """A link is nearer to an object by it, as in the planner; the next scene takes it back."""
    drives, listener = following()
    near = []
    for padding in (0.0, 0.05, 0.0):
        scene = message('box')
        if padding:
            scene.link_padding = [LinkPadding(link_name='panda_link7', padding=padding)]
        listener.take(scene)
        listener.run()
        counted, at = drives.gateway.model.scene, drives.gateway.snapshot.reference
        assert at is not None
        found = Clearances(counted).least(at.position, math.inf)
        near.append(found[counted.pairs.index(('panda_link7', 'box'))])
    assert near[0] == near[2] == pytest.approx(near[1] + 0.05, abs=1e-6)


def test_an_arm_that_nobody_knows_withholds_no_scene_from_others() -> None:
    """It is named once, and gets the scene when it is known at last."""
    known, unknown = arm().following(), arm()
    listener = Listener(known, unknown)
    listener.take(message('box'))
    listener.run()
    assert objects(known) == {'box'}
    assert not listener.warnings
    for _ in range(30):
        listener.run()
    assert len(listener.warnings) == 1
    assert 'panda_arm: its position is not known' in listener.warnings[0]
    unknown.following()
    listener.run()
    assert objects(unknown) == {'box'}


def test_diffs_change_the_scene_before_and_a_whole_scene_replaces_them() -> None:
    """MoveIt's monitor sends a whole scene first, and diffs after that."""
    drives = arm()
    listener = Listener(drives)
    for name in ('box', 'cup', 'jug'):
        listener.take(scene := message(name, is_diff=name != 'box'))
    drives.following()
    for _ in range(3):
        listener.run()
    assert objects(drives) == {'box', 'cup', 'jug'}
    scene.world.collision_objects[0].operation = CollisionObject.REMOVE
    listener.take(scene)
    listener.run()
    assert objects(drives) == {'box', 'cup'}
    listener.take(message('lid'))
    listener.run()
    assert objects(drives) == {'lid'}
    assert not listener.warnings


def test_a_diff_before_any_whole_scene_counts_with_a_warning() -> None:
    """What was there before move_group sent it is not known."""
    drives, listener = following()
    listener.take(message('cup', is_diff=True))
    listener.run()
    assert objects(drives) == {'cup'}
    listener.run(ANSWER_TIMEOUT)
    assert 'start this node before move_group' in listener.warnings[0]


def test_the_scene_of_a_move_group_that_began_before_is_requested() -> None:
    """Diffs that came meanwhile count beyond it; where ours publishes, nothing is requested."""
    drives, listener = following()
    listener.answers, listener.publishers = [], 1
    listener.run(2.0)
    assert listener.answers == []
    listener.publishers = 0
    listener.run()
    listener.take(message('cup', is_diff=True))
    (answer,) = listener.answers
    answer.set_result(GetPlanningScene.Response(scene=message('box', is_diff=True)))
    for _ in range(5):
        listener.run()
    assert objects(drives) == {'box', 'cup'}
    listener.run(2 * ANSWER_TIMEOUT)
    assert len(listener.answers) == 1
    assert not listener.warnings


def test_a_scene_is_requested_until_it_comes() -> None:
    """Where move_group died over the request, or the call failed; diffs before count no more."""
    drives, listener = following()
    listener.answers = []
    listener.run(2.0)
    listener.take(message('cup', is_diff=True))
    listener.run(ANSWER_TIMEOUT)
    lost, failed = listener.answers
    assert lost.cancelled()
    failed.set_exception(RuntimeError('no connection'))
    listener.run(ANSWER_TIMEOUT)
    assert 'no whole scene came' in listener.warnings[0]
    assert objects(drives) == {'cup'}
    listener.answers[-1].set_result(GetPlanningScene.Response(scene=message('box')))
    listener.run()
    assert objects(drives) == {'box'}
    listener.run(2 * ANSWER_TIMEOUT)
    assert len(listener.answers) == 3


def test_objects_in_the_world_of_the_srdf_count() -> None:
    """MoveIt places all of them there, where there is a virtual joint."""
    drives = Drives(model=RobotModel(*held_panda())).following()
    listener = Listener(drives)
    listener.take(message('box', 'world'))
    listener.run()
    assert drives.gateway.model.scene.objects['box'].pose.position.tolist() == [2.0, 0.0, 0.0]
    assert not listener.errors


def test_a_whole_scene_that_is_refused_is_requested_again() -> None:
    """It says so once for each reason, and diffs behind it do not make it whole."""
    drives, listener = following()
    listener.answers = []
    for frame in ('nowhere', 'nowhere', 'nowhere', 'moon'):
        listener.run(ANSWER_TIMEOUT)
        listener.answers[-1].set_result(GetPlanningScene.Response(scene=message('cup', frame)))
        listener.run()
    assert ["'cup': no frame 'nowhere'" in each for each in listener.errors] == [True, False]
    listener.run(ANSWER_TIMEOUT)
    listener.answers[-1].set_result(GetPlanningScene.Response(scene=message('box')))
    listener.run()
    assert objects(drives) == {'box'}
    listener.run(2 * ANSWER_TIMEOUT)
    assert len(listener.answers) == 5


@pytest.mark.scenario
@pytest.mark.parametrize('qos', [LATCHED, 100], ids=['latched', 'volatile'])
def test_a_scene_of_another_move_group_is_received(isolation: Isolation, qos: Any) -> None:
    """MoveIt's monitor does not latch it; what was latched before counts, too."""
    drives = arm().following()
    with RosClient(isolation.domain_id) as client:
        publisher = client.node.create_publisher(PlanningScene, 'monitored_planning_scene', qos)
        if qos is LATCHED:
            publisher.publish(message('box'))
        SceneListener(client.node, [drives.gateway])
        client.spin_until(lambda: publisher.get_subscription_count() > 0, 20.0, 'its listener')
        if qos != LATCHED:
            publisher.publish(message('box'))

        def is_there() -> bool:
            drives.run()
            return objects(drives) == {'box'}

        client.spin_until(is_there, 20.0, 'the scene')


def test_a_scene_equal_to_the_present_one_changes_nothing() -> None:
    """What is under way is not checked again, what is prepared not prepared again."""
    drives, listener = following()
    listener.take(message('box', 'panda_link0'))
    listener.run()
    first = drives.gateway.model.scene
    listener.take(message('box', 'panda_link0'))
    listener.run()
    assert drives.gateway.model.scene is first
    listener.take(message('cup'))
    listener.run()
    assert objects(drives) == {'cup'}
