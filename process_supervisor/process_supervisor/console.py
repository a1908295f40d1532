# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A bring-up on standard output: every line with the name of its process, and why it ended."""

from __future__ import annotations

from collections.abc import Sequence
import os
import sys

from .runner import Runner
from .spec import ProcessSpec
from .supervision import Notice, Outcome, Severity
from .terminal import LineWriter, Painter, wants_colour

USAGE_ERROR = 2
"""Exit code of a bring-up when nothing was started."""


def supervise(processes: Sequence[ProcessSpec], name: str = 'bringup') -> Outcome:
    """Run processes with their output on standard output, until Ctrl-C or one ends.

    Args:
        processes: What to run.
        name: Name before the supervisor's own lines.

    Returns:
        How it ended.
    """
    names = [spec.name for spec in processes]
    painter = Painter(name, names, wants_colour(sys.stdout, os.environ))
    write = LineWriter(sys.stdout)
    with Runner(
        processes,
        lambda name, line: write(painter.line(name, line)),
        lambda notice: write(painter.notice(notice)),
    ) as runner:
        outcome = runner.run()
    if outcome.exit_code:
        write(painter.notice(Notice(Severity.ERROR, explain(outcome))))
    return outcome


def explain(outcome: Outcome) -> str:
    """Say why a bring-up failed, with what the process wrote last.

    Args:
        outcome: How it ended.
    """
    if not outcome.last_lines:
        return outcome.reason
    quoted = '\n'.join(f'    {line}' for line in outcome.last_lines)
    return f'{outcome.reason}; it wrote last:\n{quoted}'
