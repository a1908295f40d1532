# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Our buses as a python-can interface, for python-can's tools and python-canopen.

::

    python -m can.viewer -i arm_canopen -c udp_multicast:239.74.163.2
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
import math
from time import monotonic, time

import can
from can.typechecking import AutoDetectedConfig, CanFilters

from ..exceptions import BusError
from .adapter import from_message, to_message
from .frame import Frame
from .opening import AUTO, open_bus, resolve_name


class ArmCanopenBus(can.BusABC):
    """A python-can bus whose channel is the name of one of our buses."""

    def __init__(
        self,
        channel: str = AUTO,
        can_filters: CanFilters | None = None,
        *,
        receive_own_messages: bool = False,
        **_: object,
    ) -> None:
        """Open a bus by its name for :func:`canopen_core.can.open_bus`.

        Raises:
            can.CanInitializationError: The bus cannot be opened, or own messages were requested.
        """
        if receive_own_messages:
            raise can.CanInitializationError('these buses never receive own messages')
        try:
            self._link = open_bus(str(channel))
        except BusError as error:
            raise can.CanInitializationError(str(error)) from error
        self._waiting: deque[Frame] = deque()
        self.channel_info = self._link.name
        super().__init__(channel, can_filters)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a message without waiting; the time-out is ignored.

        Raises:
            can.CanOperationError: The bus refuses it.
        """
        del timeout
        if msg.is_fd:
            raise can.CanOperationError('CAN FD messages are not supported')
        try:
            self._link.send(from_message(msg, 0.0))
        except (BusError, ValueError) as error:
            raise can.CanOperationError(str(error)) from error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._waiting:
            try:
                self._waiting += self._link.receive(math.inf if timeout is None else timeout)
            except BusError as error:
                raise can.CanOperationError(str(error)) from error
        if not self._waiting:
            return None, False
        frame = self._waiting.popleft()
        message = to_message(frame, time() - (monotonic() - frame.timestamp))
        message.channel = self._link.name
        return message, False

    def shutdown(self) -> None:
        """Close the bus."""
        super().shutdown()
        self._link.close()

    @staticmethod
    def _detect_available_configs() -> Sequence[AutoDetectedConfig]:
        return [{'interface': 'arm_canopen', 'channel': resolve_name(AUTO)}]
