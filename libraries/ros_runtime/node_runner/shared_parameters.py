# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters that many programs share: of a black box, and of a thread that owns a cycle."""

from __future__ import annotations

from pathlib import Path

from rclpy.node import Node

from black_box import BlackBoxSettings, default_folder, WINDOW, WINDOW_MAX
from realtime_loop import PRIORITY_MAX, raise_priority, settle_memory

from .parameter_reader import ParameterReader


def declare_black_box(read: ParameterReader) -> BlackBoxSettings | None:
    """Declare ``black_box_window`` and ``black_box_folder``; return None where it is off."""
    window = read.number(
        'black_box_window',
        WINDOW,
        (0.0, WINDOW_MAX),
        'how much is written when a fault happens [s]; 0 for nothing',
    )
    folder = read.text(
        'black_box_folder',
        '',
        'where that goes; by default black_box beside the logs of ROS (~/.ros/log/black_box)',
    )
    if window == 0.0:
        return None
    return BlackBoxSettings(Path(folder).expanduser() if folder else default_folder(), window)


def declare_thread_priority(read: ParameterReader, default: int) -> int:
    """Declare ``thread_priority`` as ros2_control has it; return its value."""
    return read.whole(
        'thread_priority',
        default,
        (0, PRIORITY_MAX),
        'SCHED_FIFO priority of the thread of the cycle; 0 for none',
    )


def raise_thread_priority(node: Node, priority: int, what: str) -> None:
    """Raise the priority of the calling thread; a refusal is a warning with the remedy."""
    outcome = raise_priority(priority, what)
    if outcome.granted:
        node.get_logger().info(outcome.text)
    elif outcome.text:
        node.get_logger().warning(outcome.text)


def settle_process_memory(node: Node) -> None:
    """Freeze the garbage collector and lock the memory, before the cycle starts."""
    node.get_logger().info(settle_memory().text)
