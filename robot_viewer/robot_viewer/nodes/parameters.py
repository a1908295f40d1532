# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of robot_state_publisher: declared, checked, and read."""

from __future__ import annotations

from collections.abc import Iterable

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from urdf_reader import DescriptionError, read_urdf

from node_runner import ParameterReader, refuse_misspelt

from ..state_publisher import HIGHEST_FREQUENCY, Settings

DESCRIPTION = 'robot_description'
DEFAULTS = Settings()


def declare(node: Node, description: str = '') -> None:
    """Declare all parameters.

    Raises:
        ParameterError: A value is not usable, or a name is misspelt.
    """
    read = ParameterReader(node, fixed=False)
    read.number(
        'publish_frequency',
        DEFAULTS.publish_frequency,
        (0.0, HIGHEST_FREQUENCY),
        'greatest rate of each transform in [Hz]; 0: one for every message',
    )
    read.text('frame_prefix', DEFAULTS.frame_prefix, 'put in front of each frame name, as it is')
    read.flag(
        'ignore_timestamp',
        'publish at each message, whatever its stamp is',
        default=DEFAULTS.ignore_timestamp,
    )
    read.text(DESCRIPTION, description, 'URDF as XML text; may be changed while it runs')
    refuse_misspelt(node)


def read_settings(node: Node) -> Settings:
    """Read all but the description."""
    return Settings(
        node.get_parameter('publish_frequency').value,
        node.get_parameter('frame_prefix').value,
        node.get_parameter('ignore_timestamp').value,
    )


def check(parameters: Iterable[Parameter]) -> SetParametersResult:
    """Refuse a description that cannot be used; ranges are rclpy's to check."""
    for parameter in parameters:
        if parameter.name == DESCRIPTION:
            try:
                read_urdf(str(parameter.value or ''))
            except DescriptionError as error:
                return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)
