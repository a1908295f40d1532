# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The program around a demo: supervisor in the main thread, its play beside it, and how it went.

This module is not imported by the package: it needs rich, which a mere bring-up does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import os
import re
import sys
import threading
from typing import Any

from rich.console import Console

from .console import explain
from .display import choose_display, Display, Setting, TableDisplay, View
from .play import ClientT, MakeClient, Play
from .runner import Runner
from .spec import ProcessSpec
from .supervision import Outcome
from .terminal import LineWriter, Painter, wants_colour


def second_terminal(commands: Sequence[str]) -> list[str]:
    """Return commands to try in a second terminal, after those that make it find this one.

    Args:
        commands: The commands.
    """
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    first = f'source env.sh; export ROS_DOMAIN_ID={domain}' if domain else 'source env.sh'
    return [first, *commands]


def perform(
    processes: Sequence[ProcessSpec],
    *,
    view: View[Any],
    figures: object,
    commands: Sequence[str],
    make_play: Callable[[Display[Any]], Play[ClientT]],
    make_client: MakeClient[ClientT],
    endless: bool,
) -> int:
    """Run a demo.

    Args:
        processes: What runs.
        view: How its figures look.
        figures: The first ones, before there are any.
        commands: Commands to try in a second terminal.
        make_play: Makes its course, for a display.
        make_client: Makes its ROS client, in the thread of the course.
        endless: It ends at Ctrl-C; whoever has seen the table needs no summary then.

    Returns:
        0, or 1 when something went wrong.
    """
    write = LineWriter(sys.stdout)
    painter = Painter('demo', [s.name for s in processes], wants_colour(sys.stdout, os.environ))
    setting = Setting(view, figures, second_terminal(commands), painter)
    display = choose_display(setting, Console(), write)
    play = make_play(display)
    line = without_readiness(processes, display.line)
    try:
        with Runner(processes, line, display.notice, on_interrupt=play.leave) as runner:
            thread = threading.Thread(target=play.run, args=[runner, make_client], name='play')
            thread.start()
            outcome = runner.run()
            thread.join()
    finally:
        display.close()
    with_summary = not (endless and isinstance(display, TableDisplay))
    return conclude(write, play, outcome, with_summary=with_summary)


def without_readiness(
    processes: Sequence[ProcessSpec], take: Callable[[str, str], None]
) -> Callable[[str, str], None]:
    """Leave out the lines by which processes say that they are ready: the supervisor says so.

    Args:
        processes: What runs.
        take: Takes all other lines, with the name of the process first.
    """
    ready = {spec.name: re.compile(spec.ready) for spec in processes if spec.ready}

    def line(name: str, text: str) -> None:
        if name not in ready or not ready[name].search(text):
            take(name, text)

    return line


def conclude(write: LineWriter, play: Play[Any], outcome: Outcome, *, with_summary: bool) -> int:
    """Say how it went.

    Args:
        write: Takes the lines.
        play: The course, ended.
        outcome: How the supervisor ended.
        with_summary: Write the summary.

    Returns:
        The exit code.
    """
    result = play.result
    for line in result.summary if with_summary else []:
        write(line)
    for line in result.warnings:
        write(f'warning: {line}')
    failures = [] if play.left else result.problems
    if outcome.exit_code:
        failures = [explain(outcome), *failures]
    for line in failures:
        write(f'error: {line}')
    return 1 if failures else 0
