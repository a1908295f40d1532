# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot lies down before its controller is stopped, or stands still, if it is on its feet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from process_supervisor import CallError, GivenUpError

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


class Client(Protocol):
    """What is needed of ROS; :class:`.mode_client.ModeClient` is the real one."""

    @property
    def state(self) -> str:
        """State of the controller, empty before it is received."""

    def set_mode(self, mode: str, timeout: float) -> str:
        """Request a mode; return the answer."""

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for something."""

    def close(self) -> None:
        """Leave the ROS graph."""


MakeClient = Callable[[Callable[[], bool]], Client]
"""Joins the ROS graph; the client asks the argument whether its waiting shall be given up."""


def join_ros(given_up: Callable[[], bool], namespace: str = '') -> Client:
    """Make the client; rclpy is loaded only now, a bring-up does not need it."""
    from .mode_client import ModeClient

    return ModeClient('quad_bringup', given_up, namespace)


def lie_down(
    report: Callable[[str], None], given_up: Callable[[], bool], make_client: MakeClient = join_ros
) -> None:
    """Let the robot lie down, if it is on its feet; a controller that does not help is left."""
    _leave(_lie_down, 'lying down', report, make_client(given_up))


def stand_still(
    report: Callable[[str], None], given_up: Callable[[], bool], make_client: MakeClient = join_ros
) -> None:
    """Let the robot end its gait, if it walks, so that it is left standing on all its feet."""
    _leave(_stand_still, 'standing still', report, make_client(given_up))


def _leave(
    end: Callable[[Client, Callable[[str], None]], None],
    what: str,
    report: Callable[[str], None],
    client: Client,
) -> None:
    try:
        client.wait_until(lambda: bool(client.state), STATE_TIMEOUT, 'the state of the controller')
        end(client, report)
    except GivenUpError:
        report(f'stopping without {what}')
    except CallError as error:
        report(f'stopping without {what}: {error}')
    finally:
        client.close()


def _stand_still(client: Client, report: Callable[[str], None]) -> None:
    if client.state.removeprefix(ON_THE_WAY) not in STEPPING and client.state != TO_STAND:
        return
    report('standing still first; Ctrl-C again stops at once')
    client.set_mode(STANDING, LIE_TIMEOUT)
    ends = {STANDING, FAULT}
    client.wait_until(lambda: client.state in ends, LIE_TIMEOUT, 'it to stand still')


def _lie_down(client: Client, report: Callable[[str], None]) -> None:
    if client.state != TO_LIE and client.state.removeprefix(ON_THE_WAY) not in ON_ITS_FEET:
        return
    report('lying down first; Ctrl-C again stops at once')
    # what fails on the way down stops it; asked once more, the robot lies down without it
    if _try_to_lie(client, {LYING, FAULT}) == FAULT:
        _try_to_lie(client, {LYING})


def _try_to_lie(client: Client, ends: set[str]) -> str:
    """Request it, wait for one of some states, and return that."""
    before = client.state  # a fault of before is no end
    client.set_mode(LYING, LIE_TIMEOUT)
    client.wait_until(lambda: client.state != before, LIE_TIMEOUT, 'it to lie')
    client.wait_until(lambda: client.state in ends, LIE_TIMEOUT, 'it to lie')
    return client.state
