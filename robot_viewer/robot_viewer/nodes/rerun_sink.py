# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run robot_viewer rerun_sink``: a robot in the viewer of Rerun, or in one of its files."""

from __future__ import annotations

import threading

from node_runner import run_program

from ..exceptions import SinkError
from .serving import serve

NAME = 'rerun_sink'
MISSING = (
    'rerun-sdk (MIT or Apache-2.0, 670 MB with what it needs) is not installed; install it with '
    '`(cd tools && python3 -m workspace build --with rerun robot_viewer)`, '
    'or `pip install rerun-sdk`'
)


def main() -> int:
    """Run until Ctrl-C.

    Returns:
        0, or 1 when it could not begin.
    """
    return run_program(NAME, _serve, SinkError)


def _serve(stop: threading.Event) -> None:
    try:
        from .rerun_node import RerunSink
    except ModuleNotFoundError as error:
        if error.name != 'rerun':
            raise
        raise SinkError(MISSING) from None
    node = RerunSink(NAME)
    serve(node, node.seen_at, node.close, stop)
