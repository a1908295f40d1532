# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Processes of a bring-up: how each is started, reports readiness, and is stopped.

The errors of the package are here, too::

    SupervisorError
    ├── StartError (OSError)   a process cannot be started
    ├── CallError              what runs refused something, or did not answer in time
    └── GivenUpError           what is waited for is no longer wanted
"""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
from dataclasses import dataclass, field
import os
from signal import Signals
import socket


class SupervisorError(Exception):
    """Root of all errors of this package."""


class StartError(SupervisorError, OSError):
    """A process of a bring-up cannot be started.

    Scenarios: the package is not built, the workspace is not sourced, another bring-up of this
    user holds the bus, the port or the ROS domain, ROS_DOMAIN_ID is no domain.
    """


class CallError(SupervisorError):
    """A running process refused a request, did not answer in time, or is in a fault.

    Scenarios: a drive that does not enable, a mode that is not accepted, a robot that has
    fallen, a service that is not there.
    """


def no_answer(what: str, waited: float) -> CallError:
    """Return the error for a missing answer after a time in [s]."""
    return CallError(
        f'waited {round(waited, 1):g} s in vain for {what}; is this machine too busy? '
        'If not, the log above says why'
    )


class GivenUpError(SupervisorError):
    """A wait was given up.

    Scenarios: Ctrl-C, a process of the bring-up has ended.
    """


VARIABLE = 'NOTIFY_SOCKET'  # names the socket in the environment of the process
TRACES = 'PYTHONFAULTHANDLER'
"""Variable that makes Python print its threads' stacks at a crash or SIGABRT."""
_READY = b'READY=1'
_STATUS = b'STATUS='
_MAX_MESSAGE = 4096


class ReadinessSocket:
    """Receives the readiness of one process; ignores other messages of systemd's protocol."""

    def __init__(self) -> None:
        """Open it."""
        self.status = ''  # what it said last of itself, for the user
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind('')  # the kernel chooses a free name in the abstract namespace

    @property
    def address(self) -> str:
        """Value of the environment variable that names the socket."""
        name: bytes = self._socket.getsockname()
        return f'@{name[1:].decode()}'

    def fileno(self) -> int:
        """Its file descriptor, for a selector."""
        return self._socket.fileno()

    def is_ready(self) -> bool:
        """Receive pending messages; return True if one reports readiness."""
        ready = False
        with contextlib.suppress(BlockingIOError):
            while True:
                lines = self._socket.recv(_MAX_MESSAGE).splitlines()
                ready |= _READY in lines
                for line in lines:
                    if line.startswith(_STATUS):
                        self.status = line.removeprefix(_STATUS).decode(errors='replace')
        return ready

    def close(self) -> None:
        """Close the socket; later reports of the process are lost."""
        self._socket.close()


class ServiceManager:
    """Parent that waits for readiness of this process, such as systemd (``Type=notify``)."""

    def __init__(self) -> None:
        """Find the service manager, and hide it from child processes."""
        address = os.environ.pop(VARIABLE, '')
        self._address = f'\0{address[1:]}' if address.startswith('@') else address
        self._reported = ''

    def report(self, state: str) -> None:
        """Report a state of sd_notify(3) once, if there is a service manager."""
        if not self._address or state == self._reported:
            return
        self._reported = state
        with (
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender,
            contextlib.suppress(OSError),
        ):
            sender.sendto(state.encode(), self._address)


@dataclass(frozen=True, slots=True)
class StopStep:
    """One step of the escalation that stops a process."""

    signal: Signals  # the signal that is sent to its process group
    timeout: float  # how long it may take to end before the next step, in [s]


STOP_STEPS = (
    StopStep(Signals.SIGTERM, 20.0),
    StopStep(Signals.SIGABRT, 2.0),
    StopStep(Signals.SIGKILL, 2.0),
)
"""Default escalation; 20 s because a master may take 18 s to bring its drives to rest.

No SIGINT: it ends a Python process that is still importing with a traceback. SIGABRT makes a
hanging process print the stacks of its threads.
"""


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """A process of a bring-up."""

    name: str  # short name, unique in its bring-up; the prefix of its output
    argv: tuple[str, ...]  # program and arguments
    # variables that it gets beside those of the supervisor
    environment: Mapping[str, str] = field(default_factory=dict)
    # it reports ``READY=1`` at the socket that ``NOTIFY_SOCKET`` names, as in sd_notify(3), when
    # it is ready. Otherwise it is ready when it is started
    notifies_ready: bool = False
    ready_timeout: float = 30.0  # how long it may take to be ready in [s]; infinite for no limit
    required: bool = True  # the whole bring-up ends when this process ends
    awaited: bool = True  # all is ready only when this process is
    # those with a lower number are stopped, and gone, before those with a higher one
    stop_order: int = 0
    stop_steps: tuple[StopStep, ...] = STOP_STEPS  # how it is stopped

    def __post_init__(self) -> None:
        """Reject a specification that would fail only later.

        Raises:
            ValueError: ``argv`` or the stop steps are empty.
        """
        if not self.argv:
            raise ValueError(f'process {self.name}: argv is empty')
        if not self.stop_steps:
            raise ValueError(f'process {self.name}: it needs at least one stop step')
