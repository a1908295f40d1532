# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The one way into ROS for programs of this workspace."""

from __future__ import annotations

from collections.abc import Sequence
import os

import rclpy
from rclpy.context import Context
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from dds_network import restrict_dds
from message_definitions import load_type_support


def init_ros(args: Sequence[str] | None = None, context: Context | None = None) -> None:
    """Initialise rclpy without its signal handlers, with DDS on the networks that are open.

    A process that can be reached from outside this host logs so, or that it cannot, though asked.

    Args:
        args: Command line; None for the process's own.
        context: What to initialise; None for the default one.

    Raises:
        NetworkChoiceError: ``DDS_NETWORK`` names what does not exist, or would be ignored.
        RuntimeError: ROS does not accept the arguments, or its environment variables.
    """
    reach = restrict_dds(os.environ)
    load_type_support()
    rclpy.init(  # noqa: TID251  # the one place
        args=None if args is None else list(args),
        context=context,
        signal_handler_options=SignalHandlerOptions.NO,
    )
    if reach.without_link or not reach.is_this_host:
        get_logger('dds_network').warning(reach.describe())
