# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the simulated robot in real time on a pseudo-terminal, in one loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
import os
from pathlib import Path
import pty
import select
import socket
import termios
import threading
import time
import tty
from typing import TYPE_CHECKING, TypeVar

from .exceptions import SetupError
from .robot_line import RobotLine
from .servos import Plant
from .state import BasePose, BaseVelocity

if TYPE_CHECKING:
    from typing_extensions import Self


CHUNK = 4096  # [B]
DEVICES = Path('/dev/pts')
_OUTPUT_SPEED = 5  # index in what tcgetattr returns
_BAUD_OF = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name.startswith('B') and name[1:].isdigit() and name != 'B0'
}


class PseudoTerminal:
    """The robot's end of a serial line; the other end is a device for any program."""

    def __init__(self, link: Path) -> None:
        """Create the device and the link.

        Raises:
            SetupError: The path is in use, or the link cannot be created.
        """
        self.link = link  # path that leads to the device, whatever its name is
        self._master = self._slave = -1
        self._claim = _claim(link)
        if os.path.lexists(link) and not _is_left_over(link):
            self._claim.close()
            raise SetupError(f'{link} is there already and is not ours; choose another --link')
        self.plug()

    @property
    def plugged(self) -> bool:
        """Whether the device exists."""
        return self._master >= 0

    @property
    def device(self) -> str:
        """Path of the device; empty without one."""
        return os.ttyname(self._slave) if self.plugged else ''

    def plug(self) -> None:
        """Create the device if there is none.

        Raises:
            SetupError: The link cannot be created.
        """
        if self.plugged:
            return
        self._master, self._slave = pty.openpty()
        # this end of the device stays open: settings survive between two programs
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        try:
            self.link.unlink(missing_ok=True)
            self.link.symlink_to(self.device)
        except OSError as error:
            self.unplug()
            raise SetupError(f'{self.link} cannot be made: {error.strerror}') from error

    def unplug(self) -> None:
        """Remove the device: programs that use it get a hang-up."""
        if not self.plugged:
            return
        device = self.device
        if self.link.is_symlink() and str(self.link.readlink()) == device:
            self.link.unlink()
        os.close(self._slave)
        os.close(self._master)
        self._master = self._slave = -1

    def fileno(self) -> int:
        """Return the file descriptor for :mod:`select`."""
        return self._master

    @property
    def baud(self) -> int:
        """Speed chosen by the other end [bit/s]; 0 for a non-standard one."""
        return _BAUD_OF.get(termios.tcgetattr(self._master)[_OUTPUT_SPEED], 0)

    def read(self) -> bytes:
        """Return the received bytes without blocking."""
        try:
            return os.read(self._master, CHUNK)
        except BlockingIOError:
            return b''

    def write(self, data: bytes) -> None:
        """Send bytes; those that do not fit the reader's buffer are lost."""
        with suppress(BlockingIOError):
            os.write(self._master, data)

    def close(self) -> None:
        """Remove the device and the link."""
        self.unplug()
        self._claim.close()

    def __enter__(self) -> Self:
        """Return the terminal."""
        return self

    def __exit__(self, *_error: object) -> None:
        """Remove the device and the link."""
        self.close()


def _claim(link: Path) -> socket.socket:
    """Lock a path for this process; the lock ends with the process, even if killed."""
    claim = socket.socket(socket.AF_UNIX)
    try:
        # a name that is no file: Linux gives it back by itself
        claim.bind(f'\0fake_xgo:{link.absolute()}')
    except OSError as error:
        claim.close()
        raise SetupError(
            f'{link} belongs to another simulated robot; end it, or choose another --link'
        ) from error
    return claim


def _is_left_over(link: Path) -> bool:
    """Return whether a link was left behind by a killed simulated robot."""
    return link.is_symlink() and link.readlink().parent == DEVICES


Result = TypeVar('Result')

IDLE_PERIOD = 0.02  # [s] between two turns of the loop on a silent line
TRUTH_PERIOD = 0.02  # [s] between two looks at where it is


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth of the robot."""

    pose: BasePose  # of base_link in the world
    velocity: BaseVelocity  # of base_link
    foot_contacts: tuple[bool, ...]  # which feet touch the ground, in the order of the legs


class Server:
    """Runs a robot in real time; run :meth:`run` in its own thread."""

    def __init__(
        self,
        plant: Plant,
        line: RobotLine,
        terminal: PseudoTerminal,
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        """Connect robot and terminal; the caller closes it. ``watch`` is called every 20 ms."""
        self._plant, self._line, self._terminal = plant, line, terminal
        self._actions: deque[tuple[Future[object], Callable[[], object]]] = deque()
        self._wake_read, self._wake_write = os.pipe()
        os.set_blocking(self._wake_read, False)
        self.stopping = threading.Event()  # ends :meth:`run` when it is set
        self._start = time.monotonic()
        self._watch = watch
        self._look()

    def run(self) -> None:
        """Serve until :meth:`stop` is called.

        Raises:
            SimulationError: The simulation became unstable, or the port could not be recreated.
        """
        self._start = time.monotonic()
        while not self.stopping.is_set():
            self._turn()
            wait = min(max(self._line.next_event - self.now, 0.0), IDLE_PERIOD)
            watched: list[int | PseudoTerminal] = [self._wake_read]
            if self._terminal.plugged:
                watched.append(self._terminal)
            ready, _, _ = select.select(watched, [], [], wait)
            if self._wake_read in ready:
                os.read(self._wake_read, 64)

    def stop(self) -> None:
        """Stop :meth:`run`; callable from any thread or signal handler."""
        self.stopping.set()
        self._wake()

    def close(self) -> None:
        """Release the resources of :meth:`stop` and :meth:`submit`; call it after :meth:`run`."""
        os.close(self._wake_read)
        os.close(self._wake_write)

    def submit(self, action: Callable[[], Result]) -> Future[Result]:
        """Run an action on the robot between two loop cycles; thread-safe."""
        future: Future[Result] = Future()
        self._actions.append((future, action))  # type: ignore[arg-type]
        self._wake()
        return future

    @property
    def now(self) -> float:
        """Time of the robot [s]."""
        return time.monotonic() - self._start

    def _wake(self) -> None:
        os.write(self._wake_write, b'.')

    def _turn(self) -> None:
        self._act()
        terminal, line = self._terminal, self._line
        data = terminal.read() if terminal.plugged else b''
        now = self.now  # bytes that came in a pause of this process did not come before it
        if terminal.plugged:
            line.set_baud(terminal.baud)
            if data:
                line.receive(data, now)
        out = line.advance(now)
        if line.plugged != terminal.plugged:
            (terminal.plug if line.plugged else terminal.unplug)()
        if out and terminal.plugged:
            terminal.write(out)
        if now - self._looked_at >= TRUTH_PERIOD:
            self._look()

    def _act(self) -> None:
        while self._actions:
            future, action = self._actions.popleft()
            try:
                future.set_result(action())
            except (SetupError, ValueError) as error:
                future.set_exception(error)

    def _look(self) -> None:
        self._looked_at = self.now
        plant = self._plant
        # where the robot was last; may be read from any thread
        self.truth = Truth(plant.base_pose, plant.base_velocity, plant.foot_contacts)
        self._watch()
