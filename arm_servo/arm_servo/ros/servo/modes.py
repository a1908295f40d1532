# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Pause and command type of the servo: Jazzy's services, and Humble's that have other names."""

from __future__ import annotations

from collections.abc import Callable

from moveit_msgs.srv import ServoCommandType
from rclpy.node import Node
from std_srvs.srv import Empty, SetBool, Trigger

from arm_model import CommandError

from ...core.requests import CommandType


class ServoModes:
    """Says which commands are admitted.

    Until somebody chooses a type every command is taken for what it is.

    Attributes:
        paused: Why the servo takes no commands; empty when it does.
    """

    def __init__(self, node: Node, stop: Callable[[str], None], renew: Callable[[], None]) -> None:
        """Offer the services.

        Args:
            stop: Brings jogging to rest, for a reason.
            renew: Takes what comes from now on for a new jog.
        """
        self.paused = ''
        self._stop_jogging, self._renew = stop, renew
        self._kind: CommandType | None = None
        node.create_service(ServoCommandType, '~/switch_command_type', self._switch)
        node.create_service(SetBool, '~/pause_servo', self._pause)
        node.create_service(Trigger, '~/start_servo', self._start)
        node.create_service(Trigger, '~/stop_servo', self._stop)
        node.create_service(Trigger, '~/unpause_servo', self._start)
        node.create_service(Empty, '~/reset_servo_status', self._reset)

    def admit(self, kind: CommandType) -> None:
        """Check whether a command is taken.

        Raises:
            CommandError: The servo is paused, or another type was chosen.
        """
        if self.paused:
            raise CommandError(self.paused)
        if self._kind not in {None, kind}:
            chosen = self._kind.name if self._kind is not None else ''
            raise CommandError(
                f'a {kind.name} command, but {chosen} was chosen; call ~/switch_command_type with'
                f' command_type {int(kind)}'
            )

    def _switch(
        self, request: ServoCommandType.Request, response: ServoCommandType.Response
    ) -> ServoCommandType.Response:
        try:
            self._kind = CommandType(request.command_type)
        except ValueError:
            return response  # success is false
        self._renew()
        response.success = True
        return response

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = True
        response.message = self._hold() if request.data else self._resume()
        return response

    def _start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, self._resume()
        return response

    def _stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, self._hold()
        return response

    def _reset(self, _: Empty.Request, response: Empty.Response) -> Empty.Response:
        self._kind = None
        return response

    def _hold(self) -> str:
        self.paused = 'the servo is paused; call ~/pause_servo with data: false'
        self._stop_jogging('the servo was paused')
        return 'paused; jogging comes to rest, trajectories go on'

    def _resume(self) -> str:
        self.paused = ''
        self._renew()
        return 'takes commands'
