# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot lies down before its controller is stopped, or stands still, if it is on its feet."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from process_supervisor import CallError, GivenUpError

if TYPE_CHECKING:
    from .mode_client import ModeClient

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
    """Make the robot lie down if it is on its feet; give up on a controller that does not answer.

    Args:
        report: Takes what happens, in words.
        given_up: Returns whether the person does not want to wait any longer.
        namespace: Of the controller.
        hold: Let the robot end its gait instead, so that it is left standing on all its feet.
    """
    # rclpy is loaded only now, a bring-up does not need it
    from .mode_client import ModeClient

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
    """Request it, wait for one of some states, and return that."""
    before = client.state  # a fault of before is no end
    client.set_mode(LYING, LIE_TIMEOUT)
    client.wait_until(lambda: client.state != before, LIE_TIMEOUT, 'it to lie')
    client.wait_until(lambda: client.state in ends, LIE_TIMEOUT, 'it to lie')
    return client.state
