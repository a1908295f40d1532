# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What sensors send: octomaps, and goals and objects in frames of /tf that are no links."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import TransformStamped
from isolation import reserve
import move_group_rig as mg
from moveit_msgs.msg import LinkPadding, MoveItErrorCodes, PlanningScene, PlanningSceneComponents
from moveit_msgs.srv import GetStateValidity
from planning_messages import box, pose_at
import pytest
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from node_runner import LATCHED

MOVED = [0.9, *mg.READY[1:]]
EDGE = 0.08  # of the smallest cells in [m]


def one_block(depth: int = 16) -> bytes:
    """Return a binary stream: the smallest cell on the positive side of the origin."""
    first, others = 0b11 << 14, 0b11  # the last child of the root, then the first one each time
    words = [first, *[others] * (depth - 2), 0b10]
    return b''.join(word.to_bytes(2, 'little') for word in words)


def scene_with_map(x: float, z: float, data: bytes | None = None) -> PlanningScene:
    """Return a change that has an octomap with its one cell from a place on."""
    scene = mg.change()
    message = scene.world.octomap
    message.header.frame_id = 'panda_link0'
    message.origin = PoseMessage()
    message.origin.position.x, message.origin.position.z = x - EDGE / 2, z - EDGE / 2
    message.origin.position.y = -EDGE / 2
    message.octomap.id, message.octomap.binary = 'OcTree', True
    message.octomap.resolution = EDGE
    message.octomap.data = [each - 256 * (each > 127) for each in data or one_block()]
    return scene


def touching(rig: mg.MoveGroupRig) -> set[str]:
    """Return what the robot touches where it is."""
    request = GetStateValidity.Request(group_name='panda_arm')
    found = rig.client.call(GetStateValidity, '/check_state_validity', request).contacts
    return {body for each in found for body in (each.contact_body_1, each.contact_body_2)}


def test_a_map_blocks_and_comes_back_as_it_was_sent(rig: mg.MoveGroupRig) -> None:
    """The contact has MoveIt's name of it; only who asks for the octomap gets it."""
    monitored = rig.client.listen(PlanningScene, '/monitored_planning_scene', LATCHED)
    sent = scene_with_map(0.307, 0.6)  # in the hand
    assert rig.apply(sent)
    assert '<octomap>' in touching(rig)
    answer = rig.plan(mg.motion_request(mg.joint_goal(MOVED)))
    assert answer.error_code.val == MoveItErrorCodes.START_STATE_IN_COLLISION
    assert '<octomap>' in answer.error_code.message
    found = rig.scene(PlanningSceneComponents.OCTOMAP).world.octomap
    assert found == sent.world.octomap
    assert not rig.scene(PlanningSceneComponents.WORLD_OBJECT_GEOMETRY).world.octomap.octomap.id
    whole = rig.scene()
    assert not whole.world.collision_objects
    rig.client.spin_until(
        lambda: sent.world.octomap in [each.world.octomap for each in monitored], 30.0, 'the map'
    )
    # what was received makes the same scene again
    rig.client.call(Empty, '/clear_octomap', Empty.Request())
    assert touching(rig) == set()
    assert not rig.scene().world.octomap.octomap.id
    assert rig.apply(whole)
    assert '<octomap>' in touching(rig)


def test_motions_lead_around_a_map(rig: mg.MoveGroupRig) -> None:
    """A cell on the straight way of the hand; padding of the links counts, as in MoveIt."""
    # 0.5 m beside the arm nothing touches; a padding of 0.45 m reaches it
    assert rig.apply(scene_with_map(0.8, 0.6))
    padded = mg.change(link_padding=[LinkPadding(link_name='panda_link7')])
    for padding, touched in ((0.45, {'<octomap>', 'panda_link7'}), (0.0, set[str]())):
        padded.link_padding[0].padding = padding
        assert rig.apply(padded)
        assert touched <= touching(rig)
        assert bool(touching(rig)) == bool(touched)
    assert rig.plan(mg.motion_request(mg.joint_goal(MOVED))).error_code.val == 1
    rig.positions['panda_joint1'] = -0.9
    assert rig.apply(scene_with_map(0.307, 0.6))
    rig.client.spin_until(lambda: '<octomap>' not in touching(rig), 30.0, 'the arm beside the map')
    answer = rig.plan(mg.motion_request(mg.joint_goal(MOVED)))
    assert answer.error_code.val == MoveItErrorCodes.SUCCESS, answer.error_code
    # the straight motion would turn joint 1 alone
    rows = [each.positions for each in answer.trajectory.joint_trajectory.points]
    assert max(abs(row[1] - mg.READY[1]) + abs(row[3] - mg.READY[3]) for row in rows) > 0.05


def test_broken_maps_are_refused_and_leave_the_scene(rig: mg.MoveGroupRig) -> None:
    """With the reason in the log."""
    assert rig.apply(scene_with_map(0.8, 0.6))
    before = rig.scene().world.octomap
    reason = 'apply_planning_scene refused: .* data end within a node'
    for _ in range(3):  # on a busy machine the line of one refusal was missing
        assert not rig.apply(scene_with_map(0.8, 0.6, one_block()[:-1]))
        with suppress(AssertionError):
            rig.process.wait_for(reason, 10.0)
            break
    rig.process.wait_for(reason, 10.0)
    foreign, lost = scene_with_map(0.8, 0.6), scene_with_map(0.8, 0.6)
    foreign.world.octomap.octomap.id, lost.world.octomap.header.frame_id = 'MyTree', 'moon'
    assert not rig.apply(foreign)
    assert not rig.apply(lost)
    assert rig.scene().world.octomap == before


def transform(parent: str, child: str, x: float, z: float = 0.0, *, turned: bool = False) -> Any:
    """Return a transform; a turned one looks back at the robot."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.transform.translation.x, message.transform.translation.z = x, z
    if turned:
        message.transform.rotation.w, message.transform.rotation.z = 0.0, 1.0
    return message


def down(x: float, z: float) -> PoseMessage:
    """Return a pose that looks down."""
    pose = pose_at(x, 0.0, z)
    pose.orientation.w, pose.orientation.x = 0.0, 1.0
    return pose


SEEN = pytest.approx((0.5, 0.0, 0.5), abs=1e-4)
"""What the camera sees at 1.5 m, in the root link in [m]."""


class Camera:
    """A camera in front of the robot, by TF.

    Attributes:
        rig: move_group and its client.
    """

    def __init__(self, rig: mg.MoveGroupRig, prefix: str = '') -> None:
        self.rig = rig
        node = rig.client.node
        self._moving = node.create_publisher(TFMessage, '/tf', 100)
        static = node.create_publisher(TFMessage, '/tf_static', LATCHED)
        rig.client.spin_until(
            lambda: bool(self._moving.get_subscription_count() * static.get_subscription_count()),
            60.0,
            'a listener of TF',
        )
        transforms = [
            transform('map', f'{prefix}panda_link0', -1.0),
            transform('map', 'table', 1.0, 0.5),
            transform(f'{prefix}{mg.HAND}', 'camera_on_hand', 0.0, 0.1),
        ]
        static.publish(TFMessage(transforms=transforms))

    def see(self, age: float = 0.0) -> None:
        """Publish where the camera is: 2 m in front of the robot's root, looking back."""
        message = transform('table', 'camera_link', 0.0, turned=True)
        stamp = self.rig.client.node.get_clock().now().nanoseconds - round(age * 1e9)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        self._moving.publish(TFMessage(transforms=[message]))

    def ik(self, frame: str, x: float, z: float) -> Any:
        """Return the response to compute_ik for a pose in a frame."""
        return self.rig.ik(down(x, z), frame, ik_link_name=mg.HAND)

    def hand(self, frame: str, x: float, z: float) -> tuple[float, ...]:
        """Return where the hand is in the solution for a pose in a frame; () if it is unknown."""
        self.see()
        answer = self.ik(frame, x, z)
        if answer.error_code.val != MoveItErrorCodes.SUCCESS:
            assert answer.error_code.val == MoveItErrorCodes.FRAME_TRANSFORM_FAILURE
            return ()
        place = self.rig.fk(mg.HAND, answer.solution).position
        return place.x, place.y, place.z


@pytest.fixture(name='one_camera', scope='module')
def make_camera(running_rig: mg.MoveGroupRig) -> Camera:
    """Return the camera."""
    return Camera(running_rig)


@pytest.fixture(name='camera')
def in_empty_scene(one_camera: Camera, rig: mg.MoveGroupRig) -> Camera:
    """Return the camera, in an empty scene."""
    assert one_camera.rig is rig
    return one_camera


def test_poses_are_taken_in_frames_of_tf(camera: Camera) -> None:
    """Through a common ancestor, and turned: of compute_ik, of goals, and of objects."""
    rig = camera.rig
    rig.client.spin_until(
        lambda: camera.hand('camera_link', 1.5, 0.0) == SEEN, 60.0, 'a solution for the camera'
    )
    for frame, pose, link, code in (
        ('camera_link', down(1.5, 0.0), mg.HAND, MoveItErrorCodes.SUCCESS),
        ('camera_on_hand', PoseMessage(), mg.HAND, MoveItErrorCodes.SUCCESS),
        # a frame of TF is no link of a goal: it would be one that stands still
        ('panda_link0', down(0.5, 0.5), 'table', MoveItErrorCodes.INVALID_LINK_NAME),
    ):
        camera.see()
        answer = rig.plan(mg.motion_request(mg.pose_goal(pose, link, frame)))
        assert answer.error_code.val == code, answer.error_code
    thing = box('cup', 1.4, 0.3, 0.0)
    thing.header.frame_id = 'camera_link'
    camera.see()
    rig.add(thing)
    (found,) = rig.scene().world.collision_objects
    place = found.pose.position
    assert found.header.frame_id == 'panda_link0'  # the root link
    assert (place.x, place.y, place.z) == pytest.approx((0.6, -0.3, 0.5), abs=1e-9)


def test_old_and_unknown_frames_are_refused(camera: Camera) -> None:
    """With MoveIt's code, and how old it is."""
    unknown = camera.ik('moon', 0.3, 0.5).error_code
    assert unknown.val == MoveItErrorCodes.FRAME_TRANSFORM_FAILURE
    assert "Unknown frame: 'moon'" in unknown.message
    assert unknown.source == 'move_group'
    camera.see(age=3.0)

    def is_old() -> bool:
        code = camera.ik('camera_link', 1.5, 0.0).error_code
        return bool(
            code.val == MoveItErrorCodes.FRAME_TRANSFORM_FAILURE and 's old' in code.message
        )

    camera.rig.client.spin_until(is_old, 60.0, 'refusal of an old frame')
    answer = camera.rig.plan(
        mg.motion_request(mg.pose_goal(down(1.5, 0.0), mg.HAND, 'camera_link'))
    )
    assert answer.error_code.val == MoveItErrorCodes.FRAME_TRANSFORM_FAILURE


def test_links_have_a_prefix_in_tf(tmp_path: Path) -> None:
    """Of a robot in a namespace; a frame that names a link may have it, too."""
    path = str(mg.panda_parameters(tmp_path))
    arguments = ['--ros-args', '--params-file', path, '-p', 'frame_prefix:=left/']
    with reserve() as isolation, mg.MoveGroupRig(isolation, *arguments) as rig:
        camera = Camera(rig, 'left/')
        rig.client.spin_until(
            lambda: camera.hand('camera_link', 1.5, 0.0) == SEEN, 60.0, 'the camera'
        )
        for frame in ('left/panda_link0', 'panda_link0'):
            assert camera.hand(frame, 0.5, 0.5) == SEEN
        assert camera.hand('right/panda_link0', 0.5, 0.5) == ()
