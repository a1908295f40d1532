# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the nodes of keyboard and gamepad programs have in common; needs ROS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import threading
from typing import Any, TypeVar

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import ParameterReader, run_program

from .auto_repeat import AutoRepeat
from .devices import InputDevices, KernelDevices
from .exceptions import OperatorInputError
from .gamepad import AUTO, Deadman, DEADMAN_BUTTONS, Gamepad
from .held_keys import HeldKeys
from .keyboard import Keyboard
from .session import Session


@dataclass(frozen=True, slots=True)
class KeyboardSettings:
    """Parameters of the keyboard.

    Attributes:
        auto_repeat: Time-outs of keys whose release is not reported.
        kitty: Use the releases that the terminal reports.
        evdev: Use those of this machine's keyboards.
    """

    auto_repeat: AutoRepeat
    kitty: bool
    evdev: bool

    def held_keys(self) -> HeldKeys:
        """Make what knows which keys are held."""
        return HeldKeys(self.auto_repeat)


def declare_keyboard(node: Node) -> KeyboardSettings:
    """Declare how keys and their releases are read.

    Args:
        node: The node.

    Raises:
        ParameterError: A value is of another kind or out of its range.
    """
    read = ParameterReader(node)
    first = read.number('first_timeout', 0.5, (0.05, 2.0), 'first time-out of a key [s]')
    repeat = read.number('repeat_timeout', 0.15, (0.05, 1.0), 'time-out of its repeats [s]')
    return KeyboardSettings(
        AutoRepeat(max(first, repeat), repeat),
        kitty=read.flag('kitty', 'true key releases from the terminal', default=True),
        evdev=read.flag('evdev', "true key releases from this machine's keyboards", default=True),
    )


def declare_deadman(node: Node) -> Deadman:
    """Declare which buttons allow motion, and for how long without any change.

    Args:
        node: The node.

    Raises:
        ParameterError: A value is of another kind or out of its range.
        SettingError: The values make no sense together.
    """
    read, longest = ParameterReader(node), 3600.0
    return Deadman(
        enable=read.choice('enable_button', 'left_shoulder', DEADMAN_BUTTONS, 'held to move'),
        turbo=read.choice('turbo_button', 'right_shoulder', DEADMAN_BUTTONS, 'held to move fast'),
        timeout=read.number(
            'deadman_timeout', 3.0, (0.5, longest), 'without any change of the gamepad [s]'
        ),
        full_deflection_timeout=read.number(
            'deadman_full_deflection_timeout',
            10.0,
            (0.5, longest),
            'the same, what is deflected at its end [s]',
        ),
    )


def declare_gamepad(node: Node, devices: InputDevices | None = None) -> Gamepad:
    """Declare which gamepad is read, and how.

    Args:
        node: The node.
        devices: Where gamepads are; those of this machine when it is None.

    Raises:
        ParameterError: A value is of another kind or out of its range.
        PresetError: There is no preset of that name.
    """
    read = ParameterReader(node)
    return Gamepad(
        devices or KernelDevices(),
        preset=read.text('preset', AUTO, 'auto, xbox, ps or generic'),
        device=read.text('device', '', 'path, or expression for the name; empty for any'),
        dead_zone=read.number('deadzone', 0.08, (0.0, 0.9), 'share of the way that is rest'),
        log=node.get_logger().info,
    )


class KeyboardNode(Node):
    """The node of a program with a keyboard.

    Attributes:
        keyboard: How keys and their releases are read.
    """

    def __init__(self, name: str) -> None:
        """Declare the parameters of the keyboard.

        Raises:
            ParameterError: A value is of another kind or out of its range.
        """
        super().__init__(name)
        self.keyboard = declare_keyboard(self)


class GamepadNode(Node):
    """The node of a program with a gamepad.

    Attributes:
        deadman: Which buttons allow motion.
        gamepad: What is read.
    """

    def __init__(self, name: str, devices: InputDevices | None = None) -> None:
        """Declare the parameters of the gamepad.

        Args:
            name: Name of the node.
            devices: Where gamepads are; those of this machine when it is None.

        Raises:
            ParameterError: A value is of another kind or out of its range.
            PresetError: There is no preset of that name.
            SettingError: The values make no sense together.
        """
        super().__init__(name)
        self.deadman = declare_deadman(self)
        self.gamepad = declare_gamepad(self, devices)


KeyboardNodeT = TypeVar('KeyboardNodeT', bound=KeyboardNode)
GamepadNodeT = TypeVar('GamepadNodeT', bound=GamepadNode)


def run_session(session: Session[Any], node: Node) -> None:
    """Serve a session and its node until the session ends; the node is gone then."""
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    session.spin = partial(executor.spin_once, timeout_sec=0)
    try:
        session.run()
    finally:
        executor.shutdown()
        node.destroy_node()


def run_keyboard(
    name: str,
    make_node: Callable[[], KeyboardNodeT],
    make_session: Callable[[KeyboardNodeT, Keyboard, threading.Event], Session[Any]],
    *errors: type[Exception],
) -> int:
    """Run a node with the keyboard of this terminal until Ctrl-C; return the exit code.

    Args:
        name: Name for the log.
        make_node: Makes the node.
        make_session: Makes what reads the keyboard and publishes.
        *errors: What is logged as one line when it cannot be made.
    """

    def serve(stop: threading.Event) -> None:
        node = make_node()
        settings = node.keyboard
        with Keyboard(kitty=settings.kitty, evdev=settings.evdev) as keyboard:
            run_session(make_session(node, keyboard, stop), node)

    # a second Ctrl-C must not leave the terminal as the program has it
    return run_program(name, serve, *errors, OperatorInputError, patient=True)


def run_gamepad(
    name: str,
    make_node: Callable[[], GamepadNodeT],
    make_session: Callable[[GamepadNodeT, threading.Event], Session[Any]],
    *errors: type[Exception],
) -> int:
    """Run a node with a gamepad until Ctrl-C; return the exit code.

    Args:
        name: Name for the log.
        make_node: Makes the node.
        make_session: Makes what reads the gamepad and publishes.
        *errors: What is logged as one line when it cannot be made.
    """

    def serve(stop: threading.Event) -> None:
        node = make_node()
        run_session(make_session(node, stop), node)

    return run_program(name, serve, *errors, OperatorInputError)
