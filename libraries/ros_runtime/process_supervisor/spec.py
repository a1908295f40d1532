# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Processes of a bring-up: how each is started and stopped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from signal import Signals


@dataclass(frozen=True, slots=True)
class StopStep:
    """One step of the escalation that stops a process.

    Attributes:
        signal: The signal that is sent to its process group.
        timeout: How long it may take to end before the next step, in [s].
    """

    signal: Signals
    timeout: float


STOP_STEPS = (
    StopStep(Signals.SIGTERM, 20.0),
    StopStep(Signals.SIGABRT, 2.0),
    StopStep(Signals.SIGKILL, 2.0),
)
"""The usual ladder; 20 s because a master may take 18 s to bring its drives to rest.

No SIGINT: by it, a Python process that is still importing ends with a traceback. By SIGABRT, one
that hangs prints what each of its threads is doing.
"""


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """A process of a bring-up.

    Attributes:
        name: Short name, unique in its bring-up; the prefix of its output.
        argv: Program and arguments.
        environment: Variables that it gets beside those of the supervisor.
        notifies_ready: It reports ``READY=1`` at the socket that ``NOTIFY_SOCKET`` names, as in
            sd_notify(3), when it is ready. Otherwise it is ready when it is started.
        ready_timeout: How long it may take to be ready in [s]; infinite for no limit.
        required: The whole bring-up ends when this process ends.
        awaited: All is ready only when this process is.
        stop_order: Those with a lower number are stopped, and gone, before those with a
            higher one.
        stop_steps: How it is stopped.
    """

    name: str
    argv: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)
    notifies_ready: bool = False
    ready_timeout: float = 30.0
    required: bool = True
    awaited: bool = True
    stop_order: int = 0
    stop_steps: tuple[StopStep, ...] = STOP_STEPS

    def __post_init__(self) -> None:
        """Refuse what would only fail later.

        Raises:
            ValueError: Empty argv or steps.
        """
        if not self.argv:
            raise ValueError(f'process {self.name}: argv is empty')
        if not self.stop_steps:
            raise ValueError(f'process {self.name}: it needs at least one stop step')
