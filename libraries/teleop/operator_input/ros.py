# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Common parts of the nodes of keyboard and gamepad programs; needs ROS."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import threading

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import ParameterReader, run_program

from .devices import InputDevices
from .exceptions import OperatorInputError
from .gamepad import AUTO, Deadman, DEADMAN_BUTTONS, Gamepad
from .keyboard import Keyboard
from .keys import AutoRepeat, HeldKeys
from .program import TeleopMapping, TeleopProgram

MAX_DEADMAN_TIMEOUT = 3600.0  # [s]


class TeleopNode(Node):
    """Node of a teleoperation program."""

    source: Keyboard | Gamepad  # what the person's input is read from
    mapping: TeleopMapping  # what it means to the robot


def declare_keyboard(node: Node) -> tuple[Keyboard, HeldKeys]:
    """Declare the parameters for keys and their releases; return their readers.

    Raises:
        ParameterError: A value has the wrong type or is out of range.
    """
    read = ParameterReader(node)
    first = read.number('first_timeout', 0.5, (0.05, 2.0), 'first time-out of a key [s]')
    repeat = read.number('repeat_timeout', 0.15, (0.05, 1.0), 'time-out of its repeats [s]')
    keyboard = Keyboard(
        kitty=read.flag('kitty', 'true key releases from the terminal', default=True),
        evdev=read.flag('evdev', "true key releases from this machine's keyboards", default=True),
    )
    return keyboard, HeldKeys(AutoRepeat(max(first, repeat), repeat))


def declare_gamepad(node: Node, devices: InputDevices | None) -> tuple[Gamepad, Deadman]:
    """Declare which gamepad is read, and which of its buttons allow motion for how long.

    Args:
        node: The node.
        devices: Where to search for gamepads; None for those of this machine.

    Raises:
        ParameterError: A value has the wrong type or is out of range.
        PresetError: There is no preset of that name.
        SettingError: The values conflict.
    """
    read, times = ParameterReader(node), (0.5, MAX_DEADMAN_TIMEOUT)
    deadman = Deadman(
        read.choice('enable_button', 'left_shoulder', DEADMAN_BUTTONS, 'held to move'),
        read.choice('turbo_button', 'right_shoulder', DEADMAN_BUTTONS, 'held to move fast'),
        read.number('deadman_timeout', 3.0, times, 'without any change of the gamepad [s]'),
        read.number(
            'deadman_full_deflection_timeout',
            10.0,
            times,
            'the same, what is deflected at its end [s]',
        ),
    )
    gamepad = Gamepad(
        devices,
        preset=read.text('preset', AUTO, 'auto, xbox, ps or generic'),
        device=read.text('device', '', 'path, or expression for the name; empty for any'),
        dead_zone=read.number('deadzone', 0.08, (0.0, 0.9), 'share of the way that is rest'),
        log=node.get_logger().info,
        warn=node.get_logger().warning,
    )
    return gamepad, deadman


def serve_teleop(node: TeleopNode, stop: threading.Event) -> None:
    """Run the operator's program and spin the node until either ends; destroy the node."""
    with node.source as source:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        program = TeleopProgram(source, node.mapping, stop)
        program.spin = partial(executor.spin_once, timeout_sec=0)
        try:
            program.run()
        finally:
            executor.shutdown()
            node.destroy_node()


def run_teleop(
    name: str, make: Callable[[], TeleopNode], *errors: type[Exception], patient: bool
) -> int:
    """Run a program until the operator quits or Ctrl-C; return the exit code.

    Args:
        name: Logger name.
        make: Creates the node.
        *errors: Exceptions of ``make`` that are logged as one line.
        patient: A second Ctrl-C does not end it at once, as the terminal must be restored.
    """

    def serve(stop: threading.Event) -> None:
        serve_teleop(make(), stop)

    return run_program(name, serve, *errors, OperatorInputError, patient=patient)
