# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run canopen_tools canopen VERB``; needs no ROS.

::

    ros2 run canopen_tools canopen check bus.yml --bitrate 500k
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
import signal
import sys

from canopen_core import CanopenError

from ..ros_arguments import split_ros_arguments
from . import check, dcf, diff, eds, new, objects, scan
from .arguments import apply_parameters, SuggestingParser, UsageError
from .output import warn

VERBS = (check, eds, new, scan, objects, diff, dcf)
INTERRUPTED = 130  # exit code of a program that Ctrl-C ended


def main(argv: Sequence[str] | None = None) -> int:
    """Run a verb.

    Returns:
        Exit code: 0, 1 when something is wrong (with a file, a device or the bus), 2 for wrong
        usage, when nothing was sent.
    """
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    parser = _parser()
    try:
        arguments = split_ros_arguments(sys.argv[1:] if argv is None else argv)
    except ValueError as error:
        parser.error(str(error))
    options = parser.parse_args(arguments.own)
    apply_parameters(options, arguments.parameters)
    try:
        code = int(options.run(options))
        sys.stdout.flush()
    except BrokenPipeError:
        # the interpreter flushes stdout once more when it ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    except (CanopenError, OSError) as error:
        warn(str(error))
        return 2 if isinstance(error, UsageError) else 1
    return code


def _parser() -> argparse.ArgumentParser:
    parser = SuggestingParser(
        prog='canopen', description='Checks, reads and sets CANopen files, devices and buses.'
    )
    verbs = parser.add_subparsers(title='verbs', metavar='VERB', required=True)
    for verb in VERBS:
        verb.add_parser(verbs)
    return parser


if __name__ == '__main__':
    sys.exit(main())
