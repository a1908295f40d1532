# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services about one state of the robot: compute_fk and check_state_validity."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, Vector3
from moveit_msgs.msg import ConstraintEvalResult, ContactInformation
from moveit_msgs.srv import GetPositionFK, GetStateValidity
from rclpy.node import Node
from std_msgs.msg import Header

from arm_model import Array, Clearances, combined, Contact, inverse

from ..constraints import ConstraintCheck, ConstraintResult
from ..exceptions import coded, PlanningCode, PlanningError
from .background import Background, error_code
from .motion_request import RequestReader
from .scene_changes import scene_for
from .scene_messages import point_message, pose_message
from .scene_monitor import SceneMonitor
from .scene_snapshot import SceneSnapshot


class StateServices:
    """Answers in a thread of its own."""

    def __init__(self, node: Node, monitor: SceneMonitor, background: Background) -> None:
        self._node, self._monitor, self._robot = node, monitor, monitor.robot
        background.serve(GetPositionFK, 'compute_fk', self._fk, _refuse_fk)
        background.serve(GetStateValidity, 'check_state_validity', self._validity, lambda *_: None)

    def _fk(self, request: Any) -> Callable[[], Any]:  # noqa: ANN401  # messages have no type
        snapshot, positions = self._monitor.start(request.robot_state)
        stamp = self._node.get_clock().now().to_msg()
        return lambda: fk_response(request, snapshot, positions, stamp)

    def _validity(self, request: Any) -> Callable[[], Any]:  # noqa: ANN401
        if request.group_name:
            self._monitor.robot.model(request.group_name)  # or raises
        elif any(map(len, _constraints(request.constraints))):
            raise PlanningError(
                PlanningCode.INVALID_GROUP_NAME,
                f'constraints are those of a group; groups: {", ".join(self._robot.names)}',
            )
        snapshot, positions = self._monitor.start(request.robot_state)
        return lambda: self._validity_response(request, snapshot, positions)

    def _validity_response(self, request: Any, snapshot: SceneSnapshot, positions: Array) -> Any:  # noqa: ANN401
        group = request.group_name
        contacts = Clearances(snapshot.scene).contacts(positions)
        results: list[ConstraintResult] = []
        if group:
            pairs = set(scene_for(snapshot, self._robot.model(group).scene).pairs)
            contacts = [each for each in contacts if each.bodies in pairs]
            model = self._robot.model_at(group, positions)
            reader = RequestReader(model, snapshot, positions)
            constraints = reader.constraints(request.constraints)
            if constraints is not None:
                results = list(ConstraintCheck(model, constraints).results(reader.start))
        response = GetStateValidity.Response()
        response.valid = not contacts and not any(each.violation for each in results)
        response.contacts = [contact_message(each, snapshot) for each in contacts]
        response.constraint_result = [
            ConstraintEvalResult(result=not each.violation, distance=each.distance)
            for each in results
        ]
        return response


def fk_response(
    request: Any,  # noqa: ANN401
    snapshot: SceneSnapshot,
    positions: Array,
    stamp: Any,  # noqa: ANN401
) -> GetPositionFK.Response:
    """Return poses of links, bodies and subframes in the frame that a request names.

    Args:
        positions: Positions of all joints of the robot in [rad].

    Raises:
        PlanningError: A link or the frame is unknown, or no link is named.
    """
    if not request.fk_link_names:
        raise PlanningError(PlanningCode.INVALID_LINK_NAME, 'fk_link_names is empty; name a link')
    frame = request.header.frame_id or snapshot.root
    outer = inverse(snapshot.frame(frame, positions))
    response = GetPositionFK.Response(error_code=error_code())
    for link in request.fk_link_names:
        with coded(PlanningCode.INVALID_LINK_NAME, 'fk_link_names'):
            snapshot.link_of(link)
        pose = combined(outer, snapshot.frame(link, positions))
        header = Header(frame_id=frame, stamp=stamp)
        response.pose_stamped.append(PoseStamped(header=header, pose=pose_message(pose)))
        response.fk_link_names.append(link)
    return response


def contact_message(contact: Contact, snapshot: SceneSnapshot) -> ContactInformation:
    """Return a contact as a moveit_msgs/ContactInformation."""
    first, second = contact.bodies
    x, y, z = contact.normal.tolist()
    return ContactInformation(
        header=Header(frame_id=snapshot.root),
        position=point_message(contact.position),
        normal=Vector3(x=x, y=y, z=z),
        depth=contact.depth,
        contact_body_1=first,
        body_type_1=_kind(first, snapshot),
        contact_body_2=second,
        body_type_2=_kind(second, snapshot),
    )


def _kind(body: str, snapshot: SceneSnapshot) -> int:
    if body in snapshot.scene.objects:
        return int(ContactInformation.WORLD_OBJECT)
    if body in snapshot.scene.attached_bodies:
        return int(ContactInformation.ROBOT_ATTACHED)
    return int(ContactInformation.ROBOT_LINK)


def _constraints(message: Any) -> tuple[Any, ...]:  # noqa: ANN401
    return (
        message.joint_constraints,
        message.position_constraints,
        message.orientation_constraints,
        message.visibility_constraints,
    )


def _refuse_fk(response: Any, error: PlanningError) -> None:  # noqa: ANN401
    response.error_code = error_code(error.code, str(error))
