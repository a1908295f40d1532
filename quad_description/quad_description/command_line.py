# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How programs of a terminal begin and end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import signal
import sys
from typing import NoReturn

INTERRUPTED = 130  # exit code of a program that Ctrl-C ended


def run_command(run: Callable[[Sequence[str]], int]) -> NoReturn:
    """Run a program with the arguments of its command line, and end with its exit code."""
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        sys.exit(run(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
