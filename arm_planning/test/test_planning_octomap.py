# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Octomaps sent to move_group, as a camera's node sends them."""

from __future__ import annotations

from contextlib import suppress

from geometry_msgs.msg import Pose as PoseMessage
from move_group_rig import change, joint_goal, motion_request, MoveGroupRig, READY
from moveit_msgs.msg import LinkPadding, MoveItErrorCodes, PlanningScene, PlanningSceneComponents
from moveit_msgs.srv import GetStateValidity
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
    scene = change()
    message = scene.world.octomap
    message.header.frame_id = 'panda_link0'
    message.origin = PoseMessage()
    message.origin.position.x, message.origin.position.z = x - EDGE / 2, z - EDGE / 2
    message.origin.position.y = -EDGE / 2
    message.octomap.id, message.octomap.binary = 'OcTree', True
    message.octomap.resolution = EDGE
    message.octomap.data = [each - 256 * (each > 127) for each in data or one_block()]
    return scene


def touching(rig: MoveGroupRig) -> set[str]:
    """Return what the robot touches where it is."""
    request = GetStateValidity.Request(group_name='panda_arm')
    found = rig.client.call(GetStateValidity, '/check_state_validity', request).contacts
    return {body for each in found for body in (each.contact_body_1, each.contact_body_2)}


def test_a_map_blocks_and_comes_back_as_it_was_sent(rig: MoveGroupRig) -> None:
    """The contact has MoveIt's name of it; only who asks for the octomap gets it."""
    monitored = rig.client.listen(PlanningScene, '/monitored_planning_scene', LATCHED)
    sent = scene_with_map(0.307, 0.6)  # in the hand
    assert rig.apply(sent)
    assert '<octomap>' in touching(rig)
    answer = rig.plan(motion_request(joint_goal(MOVED)))
    assert answer.error_code.val == MoveItErrorCodes.START_STATE_IN_COLLISION
    assert '<octomap>' in answer.error_code.message
    found = rig.scene(PlanningSceneComponents.OCTOMAP).world.octomap
    assert found == sent.world.octomap
    assert not rig.scene(PlanningSceneComponents.WORLD_OBJECT_GEOMETRY).world.octomap.octomap.id
    whole = rig.scene()
    assert not whole.world.collision_objects
    rig.client.spin_until(
        lambda: any(each.world.octomap == sent.world.octomap for each in monitored),
        30.0,
        'the map',
    )
    # what was received makes the same scene again
    rig.client.call(Empty, '/clear_octomap', Empty.Request())
    assert touching(rig) == set()
    assert not rig.scene().world.octomap.octomap.id
    assert rig.apply(whole)
    assert '<octomap>' in touching(rig)


def test_padding_counts_against_a_map(rig: MoveGroupRig) -> None:
    """Of the links, as in MoveIt."""
    # 0.5 m beside the arm nothing touches; a padding of 0.45 m reaches it
    assert rig.apply(scene_with_map(0.8, 0.6))
    assert not touching(rig)
    padded = change(link_padding=[LinkPadding(link_name='panda_link7', padding=0.45)])
    assert rig.apply(padded)
    assert {'<octomap>', 'panda_link7'} <= touching(rig)
    padded.link_padding[0].padding = 0.0
    assert rig.apply(padded)
    assert not touching(rig)


def test_motions_lead_around_a_map(rig: MoveGroupRig) -> None:
    """A cell on the straight way of the hand."""
    assert rig.plan(motion_request(joint_goal(MOVED))).error_code.val == 1
    rig.positions['panda_joint1'] = -0.9
    assert rig.apply(scene_with_map(0.307, 0.6))
    rig.client.spin_until(lambda: '<octomap>' not in touching(rig), 30.0, 'the arm beside the map')
    answer = rig.plan(motion_request(joint_goal(MOVED)))
    assert answer.error_code.val == MoveItErrorCodes.SUCCESS, answer.error_code
    # the straight motion would turn joint 1 alone
    rows = [each.positions for each in answer.trajectory.joint_trajectory.points]
    assert max(abs(row[1] - READY[1]) + abs(row[3] - READY[3]) for row in rows) > 0.05


def test_broken_maps_are_refused_and_leave_the_scene(rig: MoveGroupRig) -> None:
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
    foreign = scene_with_map(0.8, 0.6)
    foreign.world.octomap.octomap.id = 'MyTree'
    assert not rig.apply(foreign)
    lost = scene_with_map(0.8, 0.6)
    lost.world.octomap.header.frame_id = 'moon'
    assert not rig.apply(lost)
    assert rig.scene().world.octomap == before
