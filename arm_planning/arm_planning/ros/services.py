# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services: state validity, forward and inverse kinematics, Cartesian paths, list of planners."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

from geometry_msgs.msg import PoseStamped, Vector3
from moveit_msgs.msg import (
    ConstraintEvalResult,
    ContactInformation,
    PlannerInterfaceDescription,
    PlannerParams,
)
from moveit_msgs.srv import (
    GetCartesianPath,
    GetPlannerParams,
    GetPositionFK,
    GetPositionIK,
    GetStateValidity,
    QueryPlannerInterfaces,
    SetPlannerParams,
)
import numpy as np
from rclpy.node import Node
from std_msgs.msg import Header

from arm_model import Array, Clearances, combined, Contact, inverse, PlanningScene, RobotModel
from arm_model.ros import seconds
from arm_trajectory import Path

from ..cartesian import cartesian_path, JumpThresholds
from ..constraints import ConstraintCheck, ConstraintResult
from ..exceptions import coded, PlanningCode, PlanningError
from ..ik import DEFAULT_TIMEOUT, IkSolver
from ..moveit_settings import MoveItSettings, PlannerConfigs
from ..pilz_planner import PLANNER_IDS
from ..planner import FREE_MOTION
from ..retime import speed_limited, timed_rows
from ..validity import ValidityCheck
from .background import Background, error_code
from .motion_request import OMPL, PILZ, RequestReader, scaling_factor
from .scene import point_message, pose_message, SceneSnapshot
from .scene_changes import scene_for
from .scene_monitor import SceneMonitor
from .trajectories import state_message, trajectory_message

CANDIDATES = 8
"""Number of IK solutions among which to search for one that satisfies the constraints."""

MAX_SOLVERS = 16  # links of groups, with the joints beside them in one place, that are kept


class RobotServices:
    """Serves kinematics, state validity and Cartesian paths, in a thread of its own."""

    def __init__(
        self,
        node: Node,
        monitor: SceneMonitor,
        background: Background,
        settings: MoveItSettings | None = None,
    ) -> None:
        self._node, self._monitor, self._robot = node, monitor, monitor.robot
        self._settings = settings or MoveItSettings()
        self._solver = lru_cache(maxsize=MAX_SOLVERS)(IkSolver)
        background.serve(GetPositionFK, 'compute_fk', self._fk, _refuse)
        background.serve(GetStateValidity, 'check_state_validity', self._validity, lambda *_: None)
        background.serve(
            GetPositionIK,
            'compute_ik',
            lambda asked: self._prepared(self._ik, asked.ik_request, asked.ik_request.robot_state),
            _refuse,
        )
        background.serve(
            GetCartesianPath,
            'compute_cartesian_path',
            lambda asked: self._prepared(self._cartesian_path, asked, asked.start_state),
            _refuse_path,
        )

    def _fk(self, request: Any) -> Callable[[], Any]:  # noqa: ANN401  # messages have no type
        """Prepare the poses of links, bodies and subframes in the frame of the request."""
        snapshot, positions = self._monitor.start(request.robot_state)
        stamp = self._node.get_clock().now().to_msg()
        frame = request.header.frame_id or snapshot.root

        def answer() -> GetPositionFK.Response:
            names = request.fk_link_names
            if not names:
                raise PlanningError(
                    PlanningCode.INVALID_LINK_NAME, 'fk_link_names is empty; name a link'
                )
            outer = inverse(snapshot.frame(frame, positions))
            response = GetPositionFK.Response(error_code=error_code(), fk_link_names=names)
            for link in names:
                with coded(PlanningCode.INVALID_LINK_NAME, 'fk_link_names'):
                    snapshot.link_of(link)
                pose = pose_message(combined(outer, snapshot.frame(link, positions)))
                header = Header(frame_id=frame, stamp=stamp)
                response.pose_stamped.append(PoseStamped(header=header, pose=pose))
            return response

        return answer

    def _validity(self, request: Any) -> Callable[[], Any]:  # noqa: ANN401
        group, asked = request.group_name, request.constraints
        if group:
            self._robot.model(group)  # or raises
        elif any(
            (
                *(asked.joint_constraints, asked.position_constraints),
                *(asked.orientation_constraints, asked.visibility_constraints),
            )
        ):
            raise PlanningError(
                PlanningCode.INVALID_GROUP_NAME,
                f'constraints are those of a group; groups: {", ".join(self._robot.names)}',
            )
        snapshot, positions = self._monitor.start(request.robot_state)
        return lambda: self._checked(group, asked, snapshot, positions)

    def _checked(
        self,
        group: str,
        asked: Any,  # noqa: ANN401
        snapshot: SceneSnapshot,
        positions: Array,
    ) -> GetStateValidity.Response:
        """Return the contacts of a state, and the results of constraints of a group."""
        contacts = Clearances(snapshot.scene).contacts(positions)
        results: list[ConstraintResult] = []
        if group:
            pairs = set(scene_for(snapshot, self._robot.model(group).scene).pairs)
            contacts = [each for each in contacts if each.bodies in pairs]
            model = self._robot.model_at(group, positions)
            reader = RequestReader(model, snapshot, positions)
            constraints = reader.constraints(asked)
            if constraints is not None:
                results = list(ConstraintCheck(model, constraints).results(reader.start))
        return GetStateValidity.Response(
            valid=not contacts and not any(each.violation for each in results),
            contacts=[_contact(each, snapshot) for each in contacts],
            constraint_result=[
                ConstraintEvalResult(result=not each.violation, distance=each.distance)
                for each in results
            ],
        )

    def _prepared(self, answer: Any, request: Any, state: Any) -> Callable[[], Any]:  # noqa: ANN401
        """Return a function that responds from the present scene and joint positions."""
        snapshot, positions = self._monitor.start(state, request.group_name)
        stamp = self._node.get_clock().now().to_msg()

        def stamped() -> Any:  # noqa: ANN401
            response, message = answer(request, snapshot, positions)
            message.joint_state.header.stamp = stamp
            return response

        return stamped

    def _ik(self, request: Any, snapshot: SceneSnapshot, positions: Array) -> tuple[Any, Any]:  # noqa: ANN401
        """Return the GetPositionIK.Response to a moveit_msgs/PositionIKRequest, and its state."""
        model = self._robot.model_at(request.group_name, positions)
        reader = RequestReader(model, snapshot, positions)
        name, stamped = _one_pose(request)
        pose = reader.pose(stamped.pose, stamped.header.frame_id, 'pose_stamped')
        link, pose = reader.on_link(pose, name)
        constraints = reader.constraints(request.constraints)
        scene = scene_for(snapshot, model.scene) if request.avoid_collisions else None
        timeout = seconds(request.timeout) or max(
            # a shorter one is meant for solvers in C++
            self._settings.ik_timeouts.get(request.group_name, 0.0),
            DEFAULT_TIMEOUT,
        )
        solver = self._solver(model, link)
        count = 1 if constraints is None else CANDIDATES
        found = solver.solve(pose, reader.start, scene, timeout, count)
        if constraints is not None:
            check = ConstraintCheck(model, constraints)
            violations = [check.violated(each) for each in found]
            if all(violations):
                raise PlanningError(
                    PlanningCode.NO_IK_SOLUTION,
                    f'{len(found)} solutions violate the constraints; in the nearest'
                    f' {violations[0]}',
                )
            found = [found[violations.index('')]]
        everywhere = {
            **dict(zip(self._robot.joints, positions.tolist(), strict=True)),
            **dict(zip(model.joints, found[0].tolist(), strict=True)),
        }
        solution = state_message(
            self._robot.joints, self._robot.positions(everywhere), snapshot.root
        )
        return GetPositionIK.Response(solution=solution, error_code=error_code()), solution

    def _cartesian_path(
        self,
        request: Any,  # noqa: ANN401
        snapshot: SceneSnapshot,
        positions: Array,
    ) -> tuple[Any, Any]:
        """Return the GetCartesianPath.Response to a request, and its start state.

        A path that ends early has the code SUCCESS, its fraction, and the reason as message.
        """
        model = self._robot.model_at(request.group_name, positions)
        reader = RequestReader(model, snapshot, positions)
        frame = request.header.frame_id
        on_links = [
            reader.on_link(reader.pose(each, frame, f'way-point {number}'), request.link_name)
            for number, each in enumerate(request.waypoints)
        ]
        link = on_links[0][0] if on_links else ''
        constraints = reader.constraints(request.path_constraints)
        check = None if constraints is None else ConstraintCheck(model, constraints)
        scene = scene_for(snapshot, model.scene) if request.avoid_collisions else None
        found = cartesian_path(
            model,
            reader.start,
            [pose for _, pose in on_links],
            request.max_step,
            link=link,
            jumps=JumpThresholds(
                request.jump_threshold,
                request.revolute_jump_threshold,
                request.prismatic_jump_threshold,
            ),
            scene=scene,
            is_valid=None if check is None else lambda state: not check.violated(state),
        )
        path, rows, reason = self._timed(request, model, found.positions, scene)
        steps = len(found.positions) - 1
        fraction = found.fraction * ((rows - 1) / steps if steps else 1.0)
        start = state_message(self._robot.joints, positions, snapshot.root)
        response = GetCartesianPath.Response(
            start_state=start,
            solution=trajectory_message(model.joints, path, snapshot.root),
            fraction=fraction,
            error_code=error_code(
                reason=f'the path ends at {fraction:.1%}: {reason}' if reason else found.reason
            ),
        )
        return response, start

    def _timed(
        self,
        request: Any,  # noqa: ANN401
        model: RobotModel,
        rows: Array,
        scene: PlanningScene | None,
    ) -> tuple[Path, int, str]:
        """Return the path through joint positions, how many it reaches, and why no more.

        It is as fast as the request allows, and ends before the first motion that is not valid.
        """
        limits = model.limits.scaled(
            scaling_factor(
                'velocity', request.max_velocity_scaling_factor, self._settings.velocity_scaling
            ),
            scaling_factor(
                'acceleration',
                request.max_acceleration_scaling_factor,
                self._settings.acceleration_scaling,
            ),
        )
        path, reason = timed_rows(rows, limits), ''
        check = None if scene is None else ValidityCheck(limits, scene)
        while check is not None and len(rows) > 1 and (near := check.path(path)) is not None:
            nearest = int(np.abs(rows - near.positions).max(axis=1).argmin())
            rows = rows[: max(min(nearest, len(rows) - 1), 1)]
            path, reason = timed_rows(rows, limits), f'between two places {near.reason}'
        most, link = max(request.max_cartesian_speed, 0.0), request.cartesian_speed_limited_link
        path, _ = speed_limited(path, most, link, partial(self._solver, model))
        return path, len(rows), reason


def _contact(contact: Contact, snapshot: SceneSnapshot) -> ContactInformation:
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


def _one_pose(request: Any) -> tuple[str, PoseStamped]:  # noqa: ANN401
    """Return link and pose of a moveit_msgs/PositionIKRequest."""
    names, poses = request.ik_link_names, request.pose_stamped_vector
    if not names and not poses:
        return request.ik_link_name, request.pose_stamped
    if len(names) != 1 or len(poses) != 1:
        raise PlanningError(
            PlanningCode.INVALID_LINK_NAME,
            f'{len(names)} ik_link_names and {len(poses)} poses; the pose of one link of a group'
            ' is solved, others in a request of their own',
        )
    return names[0], poses[0]


def _refuse(response: Any, error: PlanningError) -> None:  # noqa: ANN401
    response.error_code = error_code(error.code, str(error))


def _refuse_path(response: Any, error: PlanningError) -> None:  # noqa: ANN401
    _refuse(response, error)
    response.fraction = -1.0


SEARCH = 'geometric::RRTConnect'


class PlannerQueries:
    """Serves queries about planners, which have no settings."""

    def __init__(self, node: Node, planners: PlannerConfigs) -> None:
        self._log, self._planners = node.get_logger(), planners
        node.create_service(QueryPlannerInterfaces, 'query_planner_interface', self._interfaces)
        node.create_service(GetPlannerParams, 'get_planner_params', self._get)
        node.create_service(SetPlannerParams, 'set_planner_params', self._set)

    def _set(self, request: Any, response: Any) -> Any:  # noqa: ANN401  # rclpy has no types here
        """Log that setting parameters has no effect: the response has no field for that."""
        self._log.warning(
            f'set_planner_params: {request.planner_config or "the planners"} of group'
            f' {request.group!r} cannot be set; {", ".join(request.params.keys) or "nothing"}'
            ' was refused'
        )
        return response

    def _interfaces(self, _request: Any, response: Any) -> Any:  # noqa: ANN401
        response.planner_interfaces = [
            PlannerInterfaceDescription(
                name='RRT-Connect',
                pipeline_id=OMPL,
                planner_ids=list(self._planners.ids or FREE_MOTION),
            ),
            PlannerInterfaceDescription(
                name='PTP, LIN, CIRC', pipeline_id=PILZ, planner_ids=list(PLANNER_IDS)
            ),
        ]
        return response

    def _get(self, request: Any, response: Any) -> Any:  # noqa: ANN401
        name = self._planners.name(request.planner_config, request.group)
        entries = dict(self._planners.configs.get(name, {}))
        if not entries and name in FREE_MOTION:
            entries = {'type': SEARCH}
        words = 'RRT-Connect searches; nothing of it can be set'
        response.params = PlannerParams(
            keys=list(entries),
            values=[str(value) for value in entries.values()],
            descriptions=[words] * len(entries),
        )
        return response
