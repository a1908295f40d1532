# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands to a gateway as its clients give them, prepared in the test's own thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np

from arm_servo import DisplacementRequest, JogRequest, JointCommand, Outcome, TwistCommand
from arm_servo.core.gateway import CommandGateway
from arm_servo.core.motion_queue import MotionCommand
from arm_servo.core.requests import by_joint


class InlineWorker(Executor):
    """Does what it is given at once."""

    def submit(self, job: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Do a job."""
        future: Future[Any] = Future()
        future.set_result(job(*args, **kwargs))
        return future


class SteppedWorker(Executor):
    """Does a job when the test says so."""

    def __init__(self) -> None:
        self._jobs: deque[Callable[[], object]] = deque()

    def submit(self, job: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Keep a job."""
        self._jobs.append(lambda: job(*args, **kwargs))
        return Future()

    @property
    def is_idle(self) -> bool:
        """Whether nothing is left to be done."""
        return not self._jobs

    def run(self) -> bool:
        """Do the next job; return whether there was one."""
        if not self._jobs:
            return False
        self._jobs.popleft()()
        return True


def jog(
    gateway: CommandGateway, velocities: Mapping[str, float], now: float, duration: float = 0.1
) -> Future[None]:
    """Jog joints."""
    command = JointCommand(*by_joint(gateway.model, velocities, 'velocities'))
    return gateway.command(JogRequest(command, now + duration))


def twist(
    gateway: CommandGateway, numbers: Sequence[float], now: float, duration: float = 0.1
) -> Future[None]:
    """Jog the tool."""
    command = TwistCommand(np.array(numbers))
    return gateway.command(JogRequest(command, now + duration))


def move_by(gateway: CommandGateway, displacements: Mapping[str, float]) -> MotionCommand:
    """Move joints on."""
    return gateway.request(DisplacementRequest(displacements))


def outcome(command: MotionCommand) -> Outcome:
    """Return how a trajectory has ended."""
    assert command.execution is not None, command.future.exception()
    assert command.execution.ending is not None
    return command.execution.ending
