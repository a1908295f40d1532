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

from .arguments import apply_parameters, split_ros_arguments, StrictParser, UsageError, warn
from .check import add_check, add_eds
from .dcf import add_dcf
from .new import add_new
from .objects import add_diff, add_read_and_write
from .scan import add_scan

VERBS = (add_check, add_eds, add_new, add_scan, add_read_and_write, add_diff, add_dcf)
INTERRUPTED = 130  # exit code after Ctrl-C


def main(argv: Sequence[str] | None = None) -> int:
    """Run a verb.

    Returns:
        Exit code: 0 on success, 1 for a problem with a file, a device or the bus, 2 for wrong
        usage, in which case nothing was sent.
    """
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    parser = _parser()
    try:
        own, parameters = split_ros_arguments(sys.argv[1:] if argv is None else argv)
    except ValueError as error:
        parser.error(str(error))
    options = parser.parse_args(own)
    apply_parameters(options, parameters)
    try:
        code = int(options.run(options))
        sys.stdout.flush()
    except BrokenPipeError:
        # the interpreter flushes stdout again at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    except (CanopenError, OSError) as error:
        warn(str(error))
        return 2 if isinstance(error, UsageError) else 1
    return code


def _parser() -> argparse.ArgumentParser:
    parser = StrictParser(
        prog='canopen', description='Checks, reads and sets CANopen files, devices and buses.'
    )
    verbs = parser.add_subparsers(title='verbs', metavar='VERB', required=True)
    for add_verb in VERBS:
        add_verb(verbs)
    return parser


if __name__ == '__main__':
    sys.exit(main())
