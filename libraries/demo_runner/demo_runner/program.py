# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The program around a demo: supervisor in the main thread, scenario beside it, and its result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import os
import sys
import threading
from typing import Any

from rich.console import Console

from process_supervisor import (
    explain,
    join_in_time,
    LineWriter,
    Outcome,
    Painter,
    ProcessSpec,
    Runner,
    wants_colour,
)

from .display import choose_display, Display, Setting, TableDisplay, View
from .scenario import ClientT, DemoScenario, MakeClient


def second_terminal(commands: Sequence[str]) -> list[str]:
    """Return commands to try in a second terminal, after those that make it find this one.

    Args:
        commands: The commands.
    """
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    first = f'source env.sh; export ROS_DOMAIN_ID={domain}' if domain else 'source env.sh'
    return [first, *commands]


def run_demo(
    processes: Sequence[ProcessSpec],
    *,
    view: View[Any],
    figures: object,
    commands: Sequence[str],
    make_scenario: Callable[[Display[Any]], DemoScenario[ClientT]],
    make_client: MakeClient[ClientT],
    endless: bool,
) -> int:
    """Run a demo.

    Args:
        processes: What runs.
        view: How its figures look.
        figures: The first ones, before there are any.
        commands: Commands to try in a second terminal.
        make_scenario: Makes its scenario, for a display.
        make_client: Makes its ROS client, in the thread of the scenario.
        endless: It ends at Ctrl-C; whoever has seen the table needs no summary then.

    Returns:
        0, or 1 when something went wrong.
    """
    write = LineWriter(sys.stdout)
    painter = Painter('demo', [s.name for s in processes], wants_colour(sys.stdout, os.environ))
    setting = Setting(view, figures, second_terminal(commands), painter)
    display = choose_display(setting, Console(), write)
    scenario = make_scenario(display)
    try:
        with Runner(
            processes, display.line, display.notice, on_interrupt=scenario.leave
        ) as runner:
            thread = threading.Thread(
                target=scenario.run, args=[runner, make_client], name='scenario', daemon=True
            )
            thread.start()
            outcome = runner.run()
            late = join_in_time(thread)
    finally:
        display.close()
    with_summary = not (endless and isinstance(display, TableDisplay))
    code = conclude(write, scenario, outcome, with_summary=with_summary)
    if late:
        write(f'error: {late}')
    return 1 if late else code


def conclude(
    write: LineWriter, scenario: DemoScenario[Any], outcome: Outcome, *, with_summary: bool
) -> int:
    """Report how it went.

    Args:
        write: Takes the lines.
        scenario: The scenario, ended.
        outcome: How the supervisor ended.
        with_summary: Write the summary.

    Returns:
        The exit code.
    """
    result = scenario.result
    for line in result.summary if with_summary else []:
        write(line)
    for line in result.warnings:
        write(f'warning: {line}')
    failures = [] if scenario.left else result.problems
    if outcome.exit_code:
        failures = [explain(outcome), *failures]
    for line in dict.fromkeys(failures):
        write(f'error: {line}')
    return 1 if failures else 0
