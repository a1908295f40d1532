# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``~/pause`` and ``~/resume``: the arm is held on its path, and goes on along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import time

from rclpy.node import Node
from std_srvs.srv import Trigger

from ...controllers.controller import Source
from ...core.gateway import CommandGateway
from ...core.requests import PauseRequest
from ...core.snapshot import Snapshot

SOURCE_WORDS = {
    Source.TRAJECTORY: 'the trajectory',
    Source.TARGET: 'the single target',
    Source.JOG: 'the jog',
}


class TrajectoryPause:
    """Holds whatever moves the arm, and lets it go on."""

    def __init__(self, node: Node, gateway: CommandGateway) -> None:
        self._gateway = gateway
        self._paused = False  # as it was ordered: the cycle may not have come to it yet
        node.create_service(Trigger, '~/pause', self._pause)
        node.create_service(Trigger, '~/resume', self._resume)

    def _pause(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._order(True, words_of_pause, response)

    def _resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._order(False, words_of_resume, response)

    def _order(
        self, paused: bool, words: Callable[[Snapshot], str], response: Trigger.Response
    ) -> Trigger.Response:
        snapshot = self._gateway.snapshot
        response.message = snapshot.stale(time.monotonic() - snapshot.time)
        if response.message:
            return response
        self._gateway.command(PauseRequest(paused))
        response.success, response.message = True, words(replace(snapshot, paused=self._paused))
        self._paused = paused
        return response


def words_of_pause(snapshot: Snapshot) -> str:
    """Return what a pause does."""
    if snapshot.paused:
        return 'is paused already; ~/resume goes on'
    if snapshot.source is Source.NONE:
        return 'paused; nothing is under way, and trajectories wait for ~/resume'
    if snapshot.source is Source.JOG:
        return 'paused; the jog ends, and trajectories wait for ~/resume'
    return f'paused; {SOURCE_WORDS[snapshot.source]} comes to rest on its path until ~/resume'


def words_of_resume(snapshot: Snapshot) -> str:
    """Return what goes on."""
    if not snapshot.paused:
        return 'was not paused'
    if snapshot.speed == 0.0:
        return 'no longer paused, but the speed override is 0; see ~/speed_scaling_input'
    if snapshot.source is Source.NONE:
        return 'takes commands again; nothing is under way'
    return f'{SOURCE_WORDS[snapshot.source]} goes on'
