# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Goals and objects in frames of /tf that are none of the robot's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import TransformStamped
from isolation import reserve
from move_group_rig import HAND, motion_request, MoveGroupRig, panda_parameters, pose_goal
from moveit_msgs.msg import MoveItErrorCodes
from planning_messages import box
import pytest
from tf2_msgs.msg import TFMessage

from node_runner import LATCHED

pytestmark = pytest.mark.usefixtures('rig')  # an empty scene


def transform(parent: str, child: str, x: float, z: float = 0.0, *, turned: bool = False) -> Any:
    """Return a transform; a turned one looks back at the robot."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.transform.translation.x, message.transform.translation.z = x, z
    if turned:
        message.transform.rotation.w, message.transform.rotation.z = 0.0, 1.0
    return message


class Camera:
    """A camera in front of the robot, by TF.

    Attributes:
        rig: move_group and its client.
    """

    def __init__(self, rig: MoveGroupRig, prefix: str = '') -> None:
        self.rig = rig
        node = rig.client.node
        self._moving = node.create_publisher(TFMessage, '/tf', 100)
        static = node.create_publisher(TFMessage, '/tf_static', LATCHED)
        rig.client.spin_until(
            lambda: bool(self._moving.get_subscription_count() * static.get_subscription_count()),
            60.0,
            'a listener of TF',
        )
        static.publish(
            TFMessage(
                transforms=[
                    transform('map', f'{prefix}panda_link0', -1.0),
                    transform('map', 'table', 1.0, 0.5),
                    transform(f'{prefix}{HAND}', 'camera_on_hand', 0.0, 0.1),
                ]
            )
        )

    def see(self, age: float = 0.0) -> None:
        """Publish where the camera is: 2 m in front of the robot's root, looking back."""
        message = transform('table', 'camera_link', 0.0, turned=True)
        stamp = self.rig.client.node.get_clock().now().nanoseconds - round(age * 1e9)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        self._moving.publish(TFMessage(transforms=[message]))

    def ik(self, frame: str, x: float, z: float) -> Any:
        """Return the response to compute_ik for a pose in a frame."""
        return self.rig.ik(down(x, z), frame, ik_link_name=HAND)


def down(x: float, z: float) -> PoseMessage:
    """Return a pose that looks down."""
    pose = PoseMessage()
    pose.position.x, pose.position.z = x, z
    pose.orientation.w, pose.orientation.x = 0.0, 1.0
    return pose


@pytest.fixture(name='camera', scope='module')
def make_camera(running_rig: MoveGroupRig) -> Camera:
    """Return the camera."""
    return Camera(running_rig)


def test_poses_are_taken_in_frames_of_tf(camera: Camera) -> None:
    """Through a common ancestor, and turned."""

    def arrived() -> bool:
        camera.see()
        answer = camera.ik('camera_link', 1.5, 0.0)
        if answer.error_code.val != MoveItErrorCodes.SUCCESS:
            assert answer.error_code.val == MoveItErrorCodes.FRAME_TRANSFORM_FAILURE
            return False
        place = camera.rig.fk(HAND, answer.solution).position
        assert (place.x, place.y, place.z) == pytest.approx((0.5, 0.0, 0.5), abs=1e-4)
        return True

    camera.rig.client.spin_until(arrived, 60.0, 'a solution in the frame of the camera')


def test_goals_are_taken_in_frames_of_tf(camera: Camera) -> None:
    """A plan to a pose that the camera sees; a frame on the hand is where the hand is."""
    camera.see()
    for frame, pose in (('camera_link', down(1.5, 0.0)), ('camera_on_hand', PoseMessage())):
        request = motion_request(pose_goal(pose, HAND, frame))
        answer = camera.rig.plan(request)
        assert answer.error_code.val == MoveItErrorCodes.SUCCESS, answer.error_code


def test_objects_are_taken_in_frames_of_tf(camera: Camera) -> None:
    """They come back in the root link."""
    thing = box('cup', 1.4, 0.3, 0.0)
    thing.header.frame_id = 'camera_link'
    camera.see()
    camera.rig.add(thing)
    (found,) = camera.rig.scene().world.collision_objects
    place = found.pose.position
    assert found.header.frame_id == 'panda_link0'
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
    answer = camera.rig.plan(motion_request(pose_goal(down(1.5, 0.0), HAND, 'camera_link')))
    assert answer.error_code.val == MoveItErrorCodes.FRAME_TRANSFORM_FAILURE


def test_links_have_a_prefix_in_tf(tmp_path: Path) -> None:
    """Of a robot in a namespace; a frame that names a link may have it, too."""
    path = str(panda_parameters(tmp_path))
    arguments = ['--ros-args', '--params-file', path, '-p', 'frame_prefix:=left/']
    with reserve() as isolation, MoveGroupRig(isolation, *arguments) as rig:
        camera = Camera(rig, 'left/')

        def place(frame: str, x: float, z: float) -> tuple[float, ...]:
            camera.see()
            answer = camera.ik(frame, x, z)
            if answer.error_code.val != MoveItErrorCodes.SUCCESS:
                return ()
            found = camera.rig.fk(HAND, answer.solution).position
            return found.x, found.y, found.z

        seen = pytest.approx((0.5, 0.0, 0.5), abs=1e-4)
        rig.client.spin_until(lambda: place('camera_link', 1.5, 0.0) == seen, 60.0, 'the camera')
        for frame in ('left/panda_link0', 'panda_link0'):
            assert place(frame, 0.5, 0.5) == seen
        assert place('right/panda_link0', 0.5, 0.5) == ()


def test_a_frame_of_tf_is_no_link_of_a_goal(camera: Camera) -> None:
    """It would be one that stands still."""
    camera.see()
    answer = camera.rig.plan(motion_request(pose_goal(down(0.5, 0.5), 'table', 'panda_link0')))
    assert answer.error_code.val == MoveItErrorCodes.INVALID_LINK_NAME
