# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the servo node knows of the arm: asked for parameter by parameter."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import math
from typing import Any

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from arm_model import ArmNames, ModelError, names_of

from .jog import Scales, UNITLESS

DESCRIPTION = ('robot_description', 'robot_description_semantic', 'group', 'tip_link')
MOVEIT = ('move_group_name', 'command_in_type', 'scale.linear', 'scale.rotational', 'scale.joint')
PREFIX = 'moveit_servo.'
NAMES = (*DESCRIPTION, *(PREFIX + name for name in MOVEIT))
"""Parameters that are asked for; MoveIt's node has some of them, that of arm_servo others."""

RETRY_PERIOD = 3.0  # [s]


class ServoSettings:
    """Asks the servo, again and again until it has answered."""

    def __init__(self, node: Node, servo: str, changed: Callable[[], None]) -> None:
        """Prepare.

        Args:
            node: The node that asks.
            servo: Full name of the servo's node.
            changed: Called when all answers are there.
        """
        self._client = node.create_client(GetParameters, f'{servo}/get_parameters')
        self._changed = changed
        self._values: dict[str, Any] = {}
        self._unanswered = set(NAMES)
        self._asked = -math.inf

    def serve(self, now: float) -> None:
        """Send a pending request when its time in [s] has come."""
        is_due = self._unanswered and now >= self._asked + RETRY_PERIOD
        if not is_due or not self._client.service_is_ready():
            return
        self._asked = now
        for name in self._unanswered:  # one by one: an unknown one empties the answer
            future = self._client.call_async(GetParameters.Request(names=[name]))
            future.add_done_callback(partial(self._take, name))

    def scales(self) -> Scales:
        """Return its full speeds; those that it did not answer are moveit_servo's defaults."""
        default = Scales()
        return Scales(
            self._positive('scale.linear', default.linear),
            self._positive('scale.rotational', default.rotational),
            self._positive('scale.joint', default.joint),
            self._values.get(PREFIX + 'command_in_type', UNITLESS) == UNITLESS,
        )

    def names(self, urdf: str) -> ArmNames:
        """Return the names of the arm's parts; the description is for a servo that has none.

        Raises:
            ModelError: The texts make no arm.
        """
        if self._unanswered:
            values = {}
        else:
            values = {
                name: value for name, value in self._values.items() if isinstance(value, str)
            }
        description = values.get('robot_description') or urdf
        if not description:
            raise ModelError('no robot description yet')
        group = values.get('group') or values.get(PREFIX + 'move_group_name', '')
        semantic = values.get('robot_description_semantic', '')
        return names_of(description, semantic, group, values.get('tip_link', ''))

    def _take(self, name: str, future: Any) -> None:  # noqa: ANN401  # rclpy's Future
        values = future.result().values
        if values and values[0].type != ParameterType.PARAMETER_NOT_SET:
            self._values[name] = parameter_value_to_python(values[0])
        if name in self._unanswered:
            self._unanswered.remove(name)
            if not self._unanswered:
                self._changed()

    def _positive(self, name: str, default: float) -> float:
        value = self._values.get(PREFIX + name, default)
        return value if isinstance(value, float) and 0.0 < value < math.inf else default
