# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The entry point: parse, execute, and exit with the exit code of ros2cli.

| code | when |
|---|---|
| 0 | done; also for `ros2 topic` without a verb, which shows help |
| 1 | a `FrontendError`, or an error of rclpy: its message is on stderr |
| 2 | wrong arguments, or Ctrl-C (ros2cli leaves with the number of SIGINT) |
| 141 | the reader of our output went away (`| head`), as for every Unix tool |
"""

from __future__ import annotations

from collections.abc import Sequence
import gc
import importlib
import os
import signal
import sys
from types import ModuleType
from typing import Any

from .cli.interrupts import signals_interrupt
from .ros.joining import joined_early

_BROKEN_PIPE = 128 + signal.SIGPIPE


class _Later(ModuleType):
    """A module that is imported on first use.

    Generated messages import numpy, which takes a quarter of a command's time, but only those with
    fixed-length arrays use it; rclpy imports yaml for parameter files. The lazy loader of
    importlib would load both already at ``import``.
    """

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401  # as in ModuleType
        del sys.modules[self.__name__]
        vars(self).update(vars(importlib.import_module(self.__name__)))
        return vars(self)[name]


def main(argv: Sequence[str] | None = None) -> int:
    """Run one `ros2` command line and return the exit code, see the table above.

    Raises:
        SystemExit: From argparse, for `--help` (0) and for wrong arguments (2).
    """
    words = list(sys.argv[1:] if argv is None else argv)
    gc.disable()  # a tenth of the time of imports; what runs for long joins the graph
    for name in ('numpy', 'yaml'):
        sys.modules.setdefault(name, _Later(name))
    try:
        with signals_interrupt(), joined_early(words):
            code = _run(words)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _leave(int(signal.SIGINT))
    except BrokenPipeError:
        return _leave(_BROKEN_PIPE)
    except RuntimeError as error:  # a FrontendError, or the error of rcl for a bad ROS_DOMAIN_ID
        print(error, file=sys.stderr)
        return _leave(1)
    return code


def _run(words: list[str]) -> int:
    from .cli.commands import build  # when DDS discovers already

    parser, help_of, verb = build(words)
    args = parser.parse_args(words)
    if not args.use_python_default_buffering and hasattr(sys.stdout, 'reconfigure'):
        sys.stdout.reconfigure(line_buffering=True)
    if verb is None:
        help_of.print_help()
        return 0
    return verb.main(args) or 0


def _leave(code: int) -> int:
    """Suppress the error that a closed stdout causes when Python exits."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return code
