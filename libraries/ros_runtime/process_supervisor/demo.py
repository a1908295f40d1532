# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs a demo beside the processes of its robot, with a live table, summary and exit code.

The package does not import this module: a plain bring-up shows no table.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
import math
import os
import sys
import threading
import time
from typing import Any, Generic, TYPE_CHECKING, TypeVar

from rich import box
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from .runner import Runner
from .spec import CallError, GivenUpError, ProcessSpec
from .supervision import Notice, Outcome, Phase, Severity
from .terminal import explain, join_in_time, LineWriter, Painter, severity_of, wants_colour

if TYPE_CHECKING:
    from .graph_client import GraphClient

ClientT = TypeVar('ClientT', bound='GraphClient')

REFRESH_PERIOD = 0.2  # time between two pictures in [s]
LINE_PERIOD = 3.0  # time between two lines of progress in [s]
NARROWEST = 80  # columns of a terminal below which there is no table
SHOWN_MESSAGES = 2  # lines that messages get below the table
MESSAGE_LIFE = {Severity.INFO: 4.0, Severity.WARNING: 20.0, Severity.ERROR: 60.0}
"""How long a message is shown in [s]."""


class Demo(ABC, Generic[ClientT]):
    """Base class of demos; :func:`run_demo` runs one.

    All methods run in one thread beside the supervisor, except :meth:`leave`.

    Attributes:
        title: What runs, and where.
        commands: Commands to try in a second terminal.
        lines: Lines needed for title and table; a smaller terminal shows lines of progress.
        widest: Maximum width of the title line in columns.
        client: The node of the demo, once it has :attr:`joined` the ROS graph.
        moving: The robot moves: :meth:`perform` handles Ctrl-C, by checking :attr:`left`.
        summary: Lines of the summary, empty until there is something to report.
        problems: Failures; with any, the exit code is 1.
        warnings: Warnings for the summary.
    """

    opening = 'starting'
    lines: int
    widest = NARROWEST
    client: ClientT

    def __init__(self, title: str, commands: Sequence[str]) -> None:
        self.title, self.commands = title, commands
        self.joined = self.moving = False
        self.summary: Sequence[str] = ()
        self.problems: Sequence[str] = ()
        self.warnings: Sequence[str] = ()
        self._screen: _Screen | None = None
        self._ending = threading.Event()
        self._next_picture = 0.0
        self._phase = ''

    @abstractmethod
    def join(self, given_up: Callable[[], bool]) -> ClientT:
        """Join the ROS graph; waiting ends when ``given_up`` returns True."""

    def prepare(self) -> None:  # a demo may need nothing
        """Do the work that needs no process, while the processes start."""

    @abstractmethod
    def perform(self) -> None:
        """Run the demo, from the time the processes are ready until the robot stands still."""

    def stopping(self) -> None:
        """End the activities of the demo; called when the processes begin to stop."""

    @abstractmethod
    def table(self, width: int) -> Sequence[RenderableType]:
        """Draw the table with a width of at least 80 columns."""

    @abstractmethod
    def progress(self) -> str:
        """Return one line of progress."""

    @property
    def left(self) -> bool:
        """Whether the user has requested to quit."""
        return self._ending.is_set()

    def leave(self) -> bool:
        """Request to quit, from any thread; return whether the robot must come to rest first."""
        self._ending.set()
        return self.moving

    def enter(self, phase: str) -> None:
        """Show a new phase of the demo."""
        if self._screen is not None and phase != self._phase:
            self._phase = phase
            self._screen.enter(phase)

    def show(self) -> None:
        """Redraw the screen, at a limited rate."""
        now = time.monotonic()
        if self._screen is not None and now >= self._next_picture:
            self._next_picture = now + REFRESH_PERIOD
            self._screen.show()

    def wait(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for a condition and redraw the table meanwhile.

        Raises:
            CallError: The condition was not met within the timeout in [s].
            GivenUpError: The processes have ended.
        """

        def reached() -> bool:
            self.show()
            return condition()

        self.client.wait_until(reached, timeout, what)

    def play(self, runner: Runner, screen: _Screen) -> None:
        """Run the demo beside a supervisor, stop it, and show the shutdown."""
        self._screen = screen
        self.enter(self.opening)
        try:
            self.client = self.join(lambda: runner.phase in {Phase.STOPPING, Phase.STOPPED})
            self.joined = True
            self.prepare()
            self.wait(lambda: runner.phase is Phase.RUNNING, math.inf, 'the processes')
            self.perform()
            runner.stop(Outcome(0, 'the demo has ended'))
        except GivenUpError:
            pass  # the supervisor knows why
        except CallError as error:
            runner.stop(Outcome(1, str(error)))
        except BaseException as error:
            runner.stop(Outcome(1, f'{type(error).__name__}: {error}'))
            raise
        finally:
            if self.joined:
                self._accompany(lambda: runner.phase is Phase.STOPPED)

    def _accompany(self, stopped: Callable[[], bool]) -> None:
        """Keep redrawing until everything has ended, so that drives are shown as disabled."""
        try:
            self.stopping()
            self.enter('stopping')
            while not stopped():
                self.client.listen(REFRESH_PERIOD / 4)
                self.show()
            self._next_picture = 0.0
            self.show()
        finally:
            self.client.close()


class _Screen:
    """Output of a demo: a live table if the terminal has room for it, else lines."""

    def __init__(
        self, demo: Demo[Any], console: Console, write: LineWriter, painter: Painter
    ) -> None:
        self._demo, self._console, self._write, self._painter = demo, console, write, painter
        self._begun, self._next_line = time.monotonic(), 0.0
        self._phase = 'starting'
        self._messages: deque[tuple[float, str]] = deque(maxlen=2 * SHOWN_MESSAGES)
        self._notes: dict[str, str] = {}
        self._commands = second_terminal(demo.commands)
        self._lock = threading.Lock()
        size = console.size
        self.live: Live | None = None
        if not console.is_terminal or console.is_dumb_terminal or console.encoding[:3] != 'utf':
            write(demo.title)
        elif size.width < NARROWEST or size.height < demo.lines:
            room = f'{size.width} x {size.height} characters, too few for the table'
            write(f'this terminal has {room}')
            write(demo.title)
        else:
            self.live = Live(console=console, auto_refresh=False, redirect_stdout=False)
            self.live.start()
            self._refresh()

    def enter(self, phase: str) -> None:
        """Show the current phase: in the title, or as a line with the time since the start."""
        self._phase = phase
        if self.live is None:
            self._next_line = time.monotonic() + LINE_PERIOD
            self._write(f'{time.monotonic() - self._begun:6.1f} s  {phase}')
        self._refresh()

    def show(self) -> None:
        """Draw the latest values; in line mode only every few seconds."""
        if self.live is None and time.monotonic() >= self._next_line:
            self.enter(self._demo.progress())
        self._refresh()

    def line(self, name: str, text: str) -> None:
        """Show output of a process if it is a warning or an error; thread-safe."""
        severity = severity_of(text)
        if severity is Severity.INFO:
            return
        if self.live is None:
            self._write(self._painter.line(name, text))
        self._keep(severity, f'{name}: {text}')

    def notice(self, notice: Notice) -> None:
        """Show a notice of the supervisor; thread-safe."""
        if self.live is None:
            self._write(self._painter.notice(notice))
        if notice.lasting:
            self._notes[notice.process] = notice.text
        else:
            self._notes.pop(notice.process, None)
            self._keep(notice.severity, notice.text)
        self._refresh()

    def close(self) -> None:
        """Leave the last table on the screen, without commands that no longer work."""
        if self.live is not None:
            self._commands, self._notes = [], {}
            self.enter('ended')
            with self._lock:
                self.live.stop()

    def _keep(self, severity: Severity, text: str) -> None:
        self._messages.append((time.monotonic() + MESSAGE_LIFE[severity], text))

    def _refresh(self) -> None:
        with self._lock:
            if self.live is not None and self.live.is_started:
                size = self._console.size
                self.live.update(self._picture(size.width, size.height), refresh=True)

    def _picture(self, width: int, height: int) -> RenderableType:
        """Draw title, table, notes, messages and commands, as far as there is room."""
        demo, now = self._demo, time.monotonic()
        title = Table.grid(expand=False)
        title.width = min(width, demo.widest)
        title.add_column(no_wrap=True, overflow='ellipsis', ratio=1)
        title.add_column(justify='right', no_wrap=True)
        right = Text(f'{self._phase}  {now - self._begun:.1f} s', style='cyan')
        title.add_row(Text(demo.title, style='bold'), right)
        parts: list[RenderableType] = [title, *demo.table(width)]
        kept = [text for end, text in list(self._messages) if now < end][-SHOWN_MESSAGES:]
        room = height - demo.lines
        for lines in (
            [Text(text, style='bold green', overflow='fold') for text in self._notes.values()],
            [Text(text, style='yellow', no_wrap=True, overflow='ellipsis') for text in kept],
            _folded(self._commands, width),
        ):
            if lines and room > 1:
                shown = lines[: room - 1]
                parts += [Text(''), *shown]
                room -= 1 + len(shown)
        return Group(*parts)


def second_terminal(commands: Sequence[str]) -> list[str]:
    """Return commands for a second terminal, with the set-up for this ROS domain first."""
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    first = f'source env.sh; export ROS_DOMAIN_ID={domain}' if domain else 'source env.sh'
    return [first, *commands]


def _folded(commands: Sequence[str], width: int) -> list[Text]:
    """Fold long commands by character, as a terminal does, so that they can be copied."""
    indented = (f'  {command}' for command in commands)
    folded = (line[i : i + width] for line in indented for i in range(0, len(line), width))
    lines = [Text(line, style='cyan', no_wrap=True) for line in folded]
    return [Text('try in a second terminal', style='bold'), *lines] if lines else []


def make_table(*columns: tuple[str, int, bool]) -> Table:
    """Return an empty table; columns are (name, minimum width, whether it holds numbers)."""
    table = Table(box=box.HORIZONTALS, show_edge=False, padding=0, header_style='bold')
    for name, width, is_number in columns:
        justify = 'right' if is_number else 'left'
        table.add_column(name, no_wrap=True, min_width=width, justify=justify)  # type: ignore[arg-type]
    return table


def signed(value: float) -> str:
    """Format a number with sign and three digits, and an unknown one as a dash."""
    # adding 0.0 turns a rounded -0.0 into 0.0
    return f'{round(value, 3) + 0.0:+.3f}' if math.isfinite(value) else '-'


def run_demo(demo: Demo[ClientT], processes: Sequence[ProcessSpec], *, endless: bool) -> int:
    """Run a demo in a thread beside the supervisor of its processes.

    An endless demo ends at Ctrl-C, and prints no summary after its table.

    Returns:
        0, or 1 when something went wrong.
    """
    write = LineWriter(sys.stdout)
    painter = Painter('demo', [s.name for s in processes], wants_colour(sys.stdout, os.environ))
    screen = _Screen(demo, Console(), write, painter)
    try:
        with Runner(processes, screen.line, screen.notice, on_interrupt=demo.leave) as runner:
            thread = threading.Thread(
                target=demo.play, args=[runner, screen], name='demo', daemon=True
            )
            thread.start()
            outcome = runner.run()
            late = join_in_time(thread)
    finally:
        screen.close()
    if not (endless and screen.live is not None):
        for line in demo.summary:
            write(line)
    for line in demo.warnings:
        write(f'warning: {line}')
    failures = [] if demo.left else [*demo.problems]
    if outcome.exit_code:
        failures = [explain(outcome), *failures]
    if late:
        failures.append(late)
    for line in dict.fromkeys(failures):
        write(f'error: {line}')
    return 1 if failures else 0
