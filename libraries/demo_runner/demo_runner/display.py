# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where a demo shows how it goes: a live table in a terminal, lines elsewhere.

What is in the table is the demo's own: it hands in a :class:`View` of its figures.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
import threading
import time
from typing import Generic, Protocol, TypeVar

from rich.console import Console, RenderableType
from rich.live import Live

from process_supervisor import LineWriter, Notice, Painter, Severity, severity_of

from .picture import DemoStatus

FiguresT = TypeVar('FiguresT')
FiguresT_contra = TypeVar('FiguresT_contra', contravariant=True)

LINE_PERIOD = 3.0
"""Time between two lines of progress in [s]."""
MESSAGES = 4
"""How many messages are kept below the table."""
MESSAGE_LIFE = {Severity.INFO: 4.0, Severity.WARNING: 20.0, Severity.ERROR: 60.0}
"""How long a message is shown in [s]."""


class View(Protocol[FiguresT_contra]):
    """How a demo's figures look."""

    @property
    def title(self) -> str:
        """What runs, and where."""

    def fits(self, width: int, height: int) -> bool:
        """Return whether a terminal of so many columns and lines has room for the table."""

    def render(
        self, figures: FiguresT_contra, status: DemoStatus, width: int, height: int
    ) -> RenderableType:
        """Draw the table into so many columns and lines."""

    def progress(self, figures: FiguresT_contra) -> str:
        """Return one line of progress."""


@dataclass(frozen=True, slots=True)
class Setting(Generic[FiguresT]):
    """What does not change while a demo runs.

    Attributes:
        view: How its figures look.
        figures: The first ones, before there are any.
        commands: Commands to try in a second terminal.
        painter: Puts names in front of lines.
    """

    view: View[FiguresT]
    figures: FiguresT
    commands: Sequence[str]
    painter: Painter


class Display(Protocol[FiguresT_contra]):
    """What a demo needs of its place to show things."""

    def phase(self, text: str) -> None:
        """Return what is going on now."""

    def show(self, figures: FiguresT_contra) -> None:
        """Show the latest figures; called several times a second."""

    def line(self, name: str, text: str) -> None:
        """Take a line of output of a process, from any thread."""

    def notice(self, notice: Notice) -> None:
        """Take a notice of the supervisor, from any thread."""

    def close(self) -> None:
        """Show nothing more; what is written after this is plain text below."""


class LineDisplay(Generic[FiguresT]):
    """Lines: phases at once, figures every few seconds, warnings and errors of the processes."""

    def __init__(self, setting: Setting[FiguresT], write: LineWriter) -> None:
        """Begin.

        Args:
            setting: What does not change.
            write: Takes the lines.
        """
        self._setting = setting
        self._write = write
        self._begun = time.monotonic()
        self._next = 0.0
        write(setting.view.title)

    def phase(self, text: str) -> None:
        """Write it, with the time since the start.

        Args:
            text: What is going on.
        """
        self._next = time.monotonic() + LINE_PERIOD
        self._stamped(text)

    def show(self, figures: FiguresT) -> None:
        """Write a line of progress, when the last one is old enough.

        Args:
            figures: The latest.
        """
        if time.monotonic() >= self._next:
            self.phase(self._setting.view.progress(figures))

    def line(self, name: str, text: str) -> None:
        """Write it when it is a warning or an error.

        Args:
            name: The process.
            text: What it wrote.
        """
        if severity_of(text) is not Severity.INFO:
            self._write(self._setting.painter.line(name, text))

    def notice(self, notice: Notice) -> None:
        """Write it.

        Args:
            notice: The notice.
        """
        self._write(self._setting.painter.notice(notice))

    def close(self) -> None:
        """Nothing is left open."""

    def _stamped(self, text: str) -> None:
        self._write(f'{time.monotonic() - self._begun:6.1f} s  {text}')


class TableDisplay(Generic[FiguresT]):
    """A live table; warnings of the processes are kept below it."""

    def __init__(self, setting: Setting[FiguresT], console: Console) -> None:
        """Begin with an empty table.

        Args:
            setting: What does not change.
            console: The terminal.
        """
        self._setting = setting
        self._console = console
        self._begun = time.monotonic()
        self._phase = 'starting'
        self._figures = setting.figures
        self._messages: deque[tuple[float, str]] = deque(maxlen=MESSAGES)
        self._notes: dict[str, str] = {}
        self._lock = threading.Lock()
        self._live = Live(console=console, auto_refresh=False, redirect_stdout=False)
        self._live.start()
        self._refresh()

    def phase(self, text: str) -> None:
        """Show it in the title.

        Args:
            text: What is going on.
        """
        self._phase = text
        self._refresh()

    def show(self, figures: FiguresT) -> None:
        """Draw the table anew.

        Args:
            figures: The latest.
        """
        self._figures = figures
        self._refresh()

    def line(self, name: str, text: str) -> None:
        """Keep it when it is a warning or an error.

        Args:
            name: The process.
            text: What it wrote.
        """
        severity = severity_of(text)
        if severity is not Severity.INFO:
            self._keep(severity, f'{name}: {text}')

    def notice(self, notice: Notice) -> None:
        """Keep it.

        Args:
            notice: The notice.
        """
        if notice.lasting:
            self._notes[notice.process] = notice.text
        else:
            self._notes.pop(notice.process, None)
            self._keep(notice.severity, notice.text)
        self._refresh()

    def close(self) -> None:
        """Leave the last table where it is, without what can no longer be tried."""
        self._setting, self._notes = replace(self._setting, commands=()), {}
        self.phase('ended')
        with self._lock:
            self._live.stop()

    def _keep(self, severity: Severity, text: str) -> None:
        self._messages.append((time.monotonic() + MESSAGE_LIFE[severity], text))

    def _refresh(self) -> None:
        setting = self._setting
        now = time.monotonic()
        messages = [text for end, text in list(self._messages) if now < end]
        status = DemoStatus(
            now - self._begun,
            self._phase,
            messages,
            setting.commands,
            list(self._notes.values()),
        )
        with self._lock:
            if self._live.is_started:
                size = self._console.size
                drawing = setting.view.render(self._figures, status, size.width, size.height)
                self._live.update(drawing, refresh=True)


def choose_display(
    setting: Setting[FiguresT], console: Console, write: LineWriter
) -> Display[FiguresT]:
    """Choose the table where there is a terminal that has room for it.

    Args:
        setting: What does not change.
        console: Standard output.
        write: Takes lines when there is no table.
    """
    size = console.size
    plain = console.is_dumb_terminal or not console.encoding.startswith('utf')
    if plain or not console.is_terminal:
        return LineDisplay(setting, write)
    if not setting.view.fits(size.width, size.height):
        write(f'this terminal has {size.width} x {size.height} characters, too few for the table')
        return LineDisplay(setting, write)
    return TableDisplay(setting, console)
