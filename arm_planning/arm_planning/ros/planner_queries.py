# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which planners there are and what can be set of them, as RViz' panel asks."""

from __future__ import annotations

from typing import Any

from moveit_msgs.msg import PlannerInterfaceDescription, PlannerParams
from moveit_msgs.srv import GetPlannerParams, QueryPlannerInterfaces, SetPlannerParams
from rclpy.node import Node

from ..industrial.planner import PLANNER_IDS
from ..moveit_config.settings import PlannerConfigs
from ..planner import FREE_MOTION
from .motion_request import OMPL, PILZ

SEARCH = 'geometric::RRTConnect'


class PlannerQueries:
    """Answers about planners; none has anything to set."""

    def __init__(self, node: Node, planners: PlannerConfigs) -> None:
        self._log, self._planners = node.get_logger(), planners
        node.create_service(QueryPlannerInterfaces, 'query_planner_interface', self._interfaces)
        node.create_service(GetPlannerParams, 'get_planner_params', self._get)
        node.create_service(SetPlannerParams, 'set_planner_params', self._set)

    def _set(self, request: Any, response: Any) -> Any:  # noqa: ANN401  # rclpy has no types here
        """Log that it has no effect: the response has no field for that."""
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
