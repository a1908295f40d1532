# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bring-up's client to the controller: reads the state, requests modes, lies down at exit.

A robot on its feet lies down, or stops walking, before its controller is stopped.
"""

from __future__ import annotations

from collections.abc import Callable
import time

from std_msgs.msg import String

from node_runner import LATCHED
from process_supervisor import CallError, GivenUpError
from process_supervisor.graph_client import GraphClient
from quad_msgs.srv import SetMode

REFUSAL_TIMEOUT = 3.0
"""Time in [s] for which a refused mode is requested again."""
RETRY_PERIOD = 0.2
"""Time in [s] between that."""
STATE_TOPIC = 'controller_node/state'
"""Topic on which the controller publishes what it is doing."""


class ModeClient(GraphClient):
    """Client with its own node; use it in one thread only."""

    def __init__(self, name: str, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph."""
        super().__init__(name, given_up, namespace)
        self.state = ''  # of the controller, as it calls it; empty before it is received
        self._modes = self.node.create_client(SetMode, 'set_mode')
        self.node.create_subscription(String, STATE_TOPIC, self._take_state, LATCHED)

    def set_mode(self, mode: str, timeout: float) -> str:
        """Request a mode; retry for a while if the controller rejects it.

        A controller that has just started may still lack inputs.

        Args:
            mode: Mode name.
            timeout: Time-out for an answer in [s].

        Returns:
            The answer of the controller.

        Raises:
            CallError: The controller rejected the mode, or did not answer in time.
            GivenUpError: The user gave up waiting.
        """
        deadline = time.monotonic() + REFUSAL_TIMEOUT
        while True:
            answer = self._request(mode, timeout)
            if answer.success:
                return str(answer.message)
            if time.monotonic() > deadline:
                raise CallError(f'the mode {mode!r} was refused: {answer.message}')
            self.listen(RETRY_PERIOD)

    def _request(self, mode: str, timeout: float) -> SetMode.Response:
        end = time.monotonic() + timeout
        self.wait_until(self._modes.service_is_ready, timeout, 'the service /set_mode')
        self.wait_until_known(['set_mode'], max(0.0, end - time.monotonic()))
        future = self._modes.call_async(SetMode.Request(mode=mode))
        left = max(0.0, end - time.monotonic())
        self.wait_until(future.done, left, f'an answer of /set_mode to {mode!r}')
        answer: SetMode.Response = future.result()
        return answer

    def _take_state(self, message: String) -> None:
        self.state = message.data


STATE_TIMEOUT = 5.0
"""Longest time in [s] to receive what the controller is doing."""
LIE_TIMEOUT = 10.0
"""Longest time in [s] for it to lie, or to stand still."""
FAULT, LYING, STANDING = 'fault', 'lie', 'stand'
"""States of the controller after a fault, and at the end."""
ON_ITS_FEET = frozenset({'stand', 'walk', 'turn', 'policy', 'get_up', FAULT})
"""States of the controller in which the legs may carry the body."""
STEPPING = frozenset({'walk', 'turn', 'policy'})
"""States of the controller in which a leg may be in the air."""
ON_THE_WAY = 'to '
"""In front of a state that is not reached yet."""
TO_STAND = ON_THE_WAY + STANDING
"""It stands up, or ends its gait."""
TO_LIE = ON_THE_WAY + LYING
"""It lies down already; left now, it would stay half-way."""


def leave(
    report: Callable[[str], None], given_up: Callable[[], bool], *, namespace: str, hold: bool
) -> None:
    """Make a robot on its feet lie down; give up if the controller does not answer.

    Args:
        report: Called with progress messages.
        given_up: Returns whether the user gave up waiting.
        namespace: Namespace of the controller.
        hold: Only end the gait, so that the robot stays standing on all its feet.
    """
    end, what = (_stand_still, 'standing still') if hold else (_lie_down, 'lying down')
    client = ModeClient('quad_bringup', given_up, namespace)
    try:
        client.wait_until(lambda: bool(client.state), STATE_TIMEOUT, 'the state of the controller')
        end(client, report)
    except GivenUpError:
        report(f'stopping without {what}')
    except CallError as error:
        report(f'stopping without {what}: {error}')
    finally:
        client.close()


def _stand_still(client: ModeClient, report: Callable[[str], None]) -> None:
    if client.state.removeprefix(ON_THE_WAY) not in STEPPING and client.state != TO_STAND:
        return
    report('standing still first; Ctrl-C again stops at once')
    client.set_mode(STANDING, LIE_TIMEOUT)
    ends = {STANDING, FAULT}
    client.wait_until(lambda: client.state in ends, LIE_TIMEOUT, 'it to stand still')


def _lie_down(client: ModeClient, report: Callable[[str], None]) -> None:
    if client.state != TO_LIE and client.state.removeprefix(ON_THE_WAY) not in ON_ITS_FEET:
        return
    report('lying down first; Ctrl-C again stops at once')
    # what fails on the way down stops it; asked once more, the robot lies down without it
    if _try_to_lie(client, {LYING, FAULT}) == FAULT:
        _try_to_lie(client, {LYING})


def _try_to_lie(client: ModeClient, ends: set[str]) -> str:
    """Request mode lie; wait for a final state and return it."""
    before = client.state  # a fault of before is no end
    client.set_mode(LYING, LIE_TIMEOUT)
    client.wait_until(lambda: client.state != before, LIE_TIMEOUT, 'it to lie')
    client.wait_until(lambda: client.state in ends, LIE_TIMEOUT, 'it to lie')
    return client.state
