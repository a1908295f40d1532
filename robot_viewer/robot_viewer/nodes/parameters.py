# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of robot_state_publisher: declared, checked, and read."""

from __future__ import annotations

from collections.abc import Iterable
import difflib

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..exceptions import DescriptionError, ParameterError
from ..state_publisher import HIGHEST_FREQUENCY, Settings
from ..urdf import read_urdf

DESCRIPTION = 'robot_description'
DEFAULTS = Settings()


def declare(node: Node, description: str = '') -> None:
    """Declare all parameters.

    Args:
        node: The node.
        description: Default of robot_description.

    Raises:
        ParameterError: A value is not usable, or a name is misspelt.
    """
    frequency = ParameterDescriptor(
        description='greatest rate of each transform in [Hz]; 0: one for every message',
        floating_point_range=[FloatingPointRange(from_value=0.0, to_value=HIGHEST_FREQUENCY)],
    )
    prefix = ParameterDescriptor(description='put in front of each frame name, as it is')
    ignore = ParameterDescriptor(description='publish at each message, whatever its stamp is')
    text = ParameterDescriptor(description='URDF as XML text; may be changed while it runs')
    try:
        node.declare_parameter('publish_frequency', DEFAULTS.publish_frequency, frequency)
        node.declare_parameter('frame_prefix', DEFAULTS.frame_prefix, prefix)
        node.declare_parameter('ignore_timestamp', DEFAULTS.ignore_timestamp, ignore)
        node.declare_parameter(DESCRIPTION, description, text)
    except Exception as error:  # rclpy has a class for each way of being wrong
        raise ParameterError(str(error)) from error
    _refuse_misspelt(node)


def _refuse_misspelt(node: Node) -> None:
    """Refuse a name that looks like one of the node's; others may be meant for other nodes."""
    known = list(node.get_parameters_by_prefix(''))
    given = node._parameter_overrides  # noqa: SLF001  # there is no public way to ask
    for name in sorted(given):
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
        if close and name not in known:
            raise ParameterError(f'unknown parameter {name!r}; did you mean {close[0]!r}?')


def read_settings(node: Node) -> Settings:
    """Read all but the description.

    Args:
        node: A node that has declared them.
    """
    return Settings(
        node.get_parameter('publish_frequency').value,
        node.get_parameter('frame_prefix').value,
        node.get_parameter('ignore_timestamp').value,
    )


def check(parameters: Iterable[Parameter]) -> SetParametersResult:
    """Refuse a description that cannot be used; ranges are rclpy's to check.

    Args:
        parameters: About to be set.
    """
    for parameter in parameters:
        if parameter.name == DESCRIPTION:
            try:
                read_urdf(str(parameter.value or ''))
            except DescriptionError as error:
                return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)
