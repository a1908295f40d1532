# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Octomaps sent to move_group, as a camera's node sends them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from geometry_msgs.msg import Pose as PoseMessage
from isolation import reserve
from move_group_rig import joint_goal, motion_request, MoveGroupRig, panda_parameters, READY
from moveit_msgs.msg import LinkPadding, MoveItErrorCodes, PlanningScene, PlanningSceneComponents
from moveit_msgs.srv import ApplyPlanningScene, GetPlanningScene, GetStateValidity
import pytest
from std_srvs.srv import Empty

from node_runner import LATCHED

MOVED = [0.9, *READY[1:]]
EDGE = 0.08  # of the smallest cells in [m]


def one_block(depth: int = 16) -> bytes:
    """Return a binary stream: the smallest cell on the positive side of the origin."""
    first, others = 0b11 << 14, 0b11  # the last child of the root, then the first one each time
    words = [first, *[others] * (depth - 2), 0b10]
    return b''.join(word.to_bytes(2, 'little') for word in words)


def scene_with_map(x: float, z: float, data: bytes | None = None) -> PlanningScene:
    """Return a change that has an octomap with its one cell from a place on."""
    scene = PlanningScene(is_diff=True)
    scene.robot_state.is_diff = True
    message = scene.world.octomap
    message.header.frame_id = 'panda_link0'
    message.origin = PoseMessage()
    message.origin.position.x, message.origin.position.z = x - EDGE / 2, z - EDGE / 2
    message.origin.position.y = -EDGE / 2
    message.octomap.id, message.octomap.binary = 'OcTree', True
    message.octomap.resolution = EDGE
    message.octomap.data = [each - 256 * (each > 127) for each in data or one_block()]
    return scene


class Cloud:
    """move_group and what is sent to it."""

    def __init__(self, rig: MoveGroupRig) -> None:
        self.rig = rig

    def apply(self, scene: PlanningScene) -> bool:
        """Return whether a change was taken."""
        request = ApplyPlanningScene.Request(scene=scene)
        answer = self.rig.client.call(ApplyPlanningScene, '/apply_planning_scene', request)
        return bool(answer.success)

    def scene(self, components: int = 0) -> Any:
        """Return the scene."""
        request = GetPlanningScene.Request()
        request.components.components = components
        return self.rig.client.call(GetPlanningScene, '/get_planning_scene', request).scene

    def touching(self) -> set[str]:
        """Return what the robot touches where it is."""
        request = GetStateValidity.Request(group_name='panda_arm')
        answer = self.rig.client.call(GetStateValidity, '/check_state_validity', request)
        return {
            body for each in answer.contacts for body in (each.contact_body_1, each.contact_body_2)
        }

    def clear(self) -> None:
        """Call clear_octomap."""
        self.rig.client.call(Empty, '/clear_octomap', Empty.Request())


@pytest.fixture(name='cloud', scope='module')
def make_cloud(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cloud]:
    """Start move_group."""
    path = panda_parameters(tmp_path_factory.mktemp('robot'))
    with (
        reserve() as isolation,
        MoveGroupRig(isolation, '--ros-args', '--params-file', str(path)) as rig,
    ):
        yield Cloud(rig)


def test_a_map_blocks_and_comes_back_as_it_was_sent(cloud: Cloud) -> None:
    """The contact has MoveIt's name of it; only who asks for the octomap gets it."""
    monitored = cloud.rig.client.listen(PlanningScene, '/monitored_planning_scene', LATCHED)
    sent = scene_with_map(0.307, 0.6)  # in the hand
    assert cloud.apply(sent)
    assert '<octomap>' in cloud.touching()
    answer = cloud.rig.plan(motion_request(joint_goal(MOVED)))
    assert answer.error_code.val == MoveItErrorCodes.START_STATE_IN_COLLISION
    assert '<octomap>' in answer.error_code.message
    found = cloud.scene(PlanningSceneComponents.OCTOMAP).world.octomap
    assert found == sent.world.octomap
    assert not cloud.scene(PlanningSceneComponents.WORLD_OBJECT_GEOMETRY).world.octomap.octomap.id
    whole = cloud.scene()
    assert not whole.world.collision_objects
    cloud.rig.client.spin_until(
        lambda: any(each.world.octomap == sent.world.octomap for each in monitored),
        30.0,
        'the map',
    )
    # what was received makes the same scene again
    cloud.clear()
    assert cloud.touching() == set()
    assert not cloud.scene().world.octomap.octomap.id
    assert cloud.apply(whole)
    assert '<octomap>' in cloud.touching()
    cloud.clear()


def test_padding_counts_against_a_map(cloud: Cloud) -> None:
    """Of the links, as in MoveIt."""
    # 0.5 m beside the arm nothing touches; a padding of 0.45 m reaches it
    change = scene_with_map(0.8, 0.6)
    assert cloud.apply(change)
    assert not cloud.touching()
    padded = PlanningScene(is_diff=True)
    padded.robot_state.is_diff = True
    padded.link_padding = [LinkPadding(link_name='panda_link7', padding=0.45)]
    assert cloud.apply(padded)
    assert {'<octomap>', 'panda_link7'} <= cloud.touching()
    padded.link_padding[0].padding = 0.0
    assert cloud.apply(padded)
    assert not cloud.touching()
    cloud.clear()


def test_motions_lead_around_a_map(cloud: Cloud) -> None:
    """A cell on the straight way of the hand."""
    change = scene_with_map(0.307, 0.6)
    assert cloud.rig.plan(motion_request(joint_goal(MOVED))).error_code.val == 1
    try:
        cloud.rig.positions['panda_joint1'] = -0.9
        assert cloud.apply(change)
        cloud.rig.client.spin_until(
            lambda: '<octomap>' not in cloud.touching(), 30.0, 'the arm beside the map'
        )
        answer = cloud.rig.plan(motion_request(joint_goal(MOVED)))
        assert answer.error_code.val == MoveItErrorCodes.SUCCESS, answer.error_code
        # the straight motion would turn joint 1 alone
        rows = [each.positions for each in answer.trajectory.joint_trajectory.points]
        assert max(abs(row[1] - READY[1]) + abs(row[3] - READY[3]) for row in rows) > 0.05
    finally:
        cloud.rig.positions['panda_joint1'] = 0.0
        cloud.clear()


def test_broken_maps_are_refused_and_leave_the_scene(cloud: Cloud) -> None:
    """With the reason in the log."""
    assert cloud.apply(scene_with_map(0.8, 0.6))
    before = cloud.scene().world.octomap
    reason = 'apply_planning_scene refused: .* data end within a node'
    for _ in range(3):  # on a busy machine the line of one refusal was missing
        assert not cloud.apply(scene_with_map(0.8, 0.6, one_block()[:-1]))
        with suppress(AssertionError):
            cloud.rig.process.wait_for(reason, 10.0)
            break
    cloud.rig.process.wait_for(reason, 10.0)
    foreign = scene_with_map(0.8, 0.6)
    foreign.world.octomap.octomap.id = 'MyTree'
    assert not cloud.apply(foreign)
    lost = scene_with_map(0.8, 0.6)
    lost.world.octomap.header.frame_id = 'moon'
    assert not cloud.apply(lost)
    assert cloud.scene().world.octomap == before
    cloud.clear()
