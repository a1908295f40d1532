# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the servo node knows of the arm: asked for parameter by parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
import math
from typing import Any

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from arm_model import ArmNames, ModelError, names_of

from .scales import Scales, UNITLESS

PREFIX = 'moveit_servo.'
NAMES = (
    'robot_description',
    'robot_description_semantic',
    'group',
    'tip_link',
    *(
        PREFIX + name
        for name in (
            'move_group_name',
            'command_in_type',
            'scale.linear',
            'scale.rotational',
            'scale.joint',
        )
    ),
)
"""Parameters that are asked for; MoveIt's node has some of them, that of arm_servo others."""

RETRY_PERIOD = 3.0  # [s]


@dataclass(slots=True)
class ServoSettings:
    """Answers so far.

    Attributes:
        values: Parameters of the servo that were answered.
        unanswered: Those that were not.
    """

    values: dict[str, Any] = field(default_factory=dict)
    unanswered: set[str] = field(default_factory=lambda: set(NAMES))

    @property
    def complete(self) -> bool:
        """Whether all was answered."""
        return not self.unanswered

    def scales(self) -> Scales:
        """Return its full speeds; those that it did not answer are moveit_servo's defaults."""
        default = Scales()
        return Scales(
            _positive(self.values, 'scale.linear', default.linear),
            _positive(self.values, 'scale.rotational', default.rotational),
            _positive(self.values, 'scale.joint', default.joint),
            self.values.get(PREFIX + 'command_in_type', UNITLESS) == UNITLESS,
        )

    def names(self, urdf: str) -> ArmNames:
        """Return the names of the arm's parts.

        Args:
            urdf: The description from /robot_description, for a servo that has none.

        Raises:
            ModelError: The texts make no arm.
        """
        values = {name: value for name, value in self.values.items() if isinstance(value, str)}
        description = values.get('robot_description') or urdf
        if not description:
            raise ModelError('no robot description yet')
        group = values.get('group') or values.get(PREFIX + 'move_group_name', '')
        semantic = values.get('robot_description_semantic', '')
        return names_of(description, semantic, group, values.get('tip_link', ''))


class SettingsClient:
    """Asks the servo, again and again until it has answered."""

    def __init__(self, node: Node, servo: str, changed: Callable[[ServoSettings], None]) -> None:
        """Prepare.

        Args:
            node: The node that asks.
            servo: Full name of the servo's node.
            changed: Called with the answers when all are there.
        """
        self._client: Client = node.create_client(GetParameters, f'{servo}/get_parameters')
        self._changed = changed
        self._settings = ServoSettings()
        self._asked = -math.inf

    def serve(self, now: float) -> None:
        """Ask if there is something to ask.

        Args:
            now: Time [s].
        """
        if self._settings.complete or now < self._asked + RETRY_PERIOD:
            return
        if not self._client.service_is_ready():
            return
        self._asked = now
        for name in self._settings.unanswered:  # one by one: an unknown one empties the answer
            future = self._client.call_async(GetParameters.Request(names=[name]))
            future.add_done_callback(partial(self._take, name))

    def _take(self, name: str, future: Any) -> None:  # noqa: ANN401  # rclpy's Future
        values = future.result().values
        if values and values[0].type != ParameterType.PARAMETER_NOT_SET:
            self._settings.values[name] = parameter_value_to_python(values[0])
        if name in self._settings.unanswered:
            self._settings.unanswered.remove(name)
            if self._settings.complete:
                self._changed(self._settings)


def _positive(values: Mapping[str, Any], name: str, default: float) -> float:
    value = values.get(PREFIX + name, default)
    return value if isinstance(value, float) and 0.0 < value < math.inf else default
