# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the pictures of all demos have in common: title, phase, messages, commands to try."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

MESSAGE_ROOM = 2
"""Lines that messages get before the commands do."""


@dataclass(frozen=True, slots=True)
class DemoStatus:
    """What is shown beside the figures.

    Attributes:
        elapsed: Time since the start in [s].
        phase: What is going on.
        messages: The last messages.
        commands: Commands to try in a second terminal.
        notes: What stays true as long as it runs.
    """

    elapsed: float
    phase: str
    messages: Sequence[str] = ()
    commands: Sequence[str] = ()
    notes: Sequence[str] = ()


def compose(
    title: str,
    status: DemoStatus,
    body: Sequence[RenderableType],
    widths: tuple[int, int],
    room: int,
) -> RenderableType:
    """Put a picture together: title and phase, the body, notes, messages, and commands.

    Args:
        title: What runs, and where.
        status: What is shown beside the figures.
        body: What the demo drew.
        widths: Columns of the title line and of the terminal.
        room: Lines that are left for what stands below the body; what has no room is left out.
    """
    title_width, width = widths
    parts: list[RenderableType] = [_title_line(title, status, title_width), *body]
    messages = [_message(text) for text in status.messages[-MESSAGE_ROOM:]]
    notes = [Text(text, style='bold green', overflow='fold') for text in status.notes]
    for lines in (notes, messages, _commands(status.commands, width)):
        if lines and room > 1:
            shown = lines[: room - 1]
            parts += [Text(''), *shown]
            room -= 1 + len(shown)
    return Group(*parts)


def _title_line(title: str, status: DemoStatus, width: int) -> RenderableType:
    line = Table.grid(expand=False)
    line.width = width
    line.add_column(no_wrap=True, overflow='ellipsis', ratio=1)
    line.add_column(justify='right', no_wrap=True)
    right = Text(f'{status.phase}  {status.elapsed:.1f} s', style='cyan')
    line.add_row(Text(title, style='bold'), right)
    return line


def _message(text: str) -> Text:
    return Text(text, style='yellow', no_wrap=True, overflow='ellipsis')


def _commands(commands: Sequence[str], width: int) -> list[Text]:
    """Fold long commands by character, as a terminal does, so that they can be copied."""
    if not commands:
        return []
    indented = (f'  {command}' for command in commands)
    folded = (line[i : i + width] for line in indented for i in range(0, len(line), width))
    head = Text('try in a second terminal', style='bold')
    return [head, *(Text(line, style='cyan', no_wrap=True) for line in folded)]
