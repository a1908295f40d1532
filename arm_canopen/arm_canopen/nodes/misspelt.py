# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters on the command line that nobody declares, because they are misspelt."""

from __future__ import annotations

import difflib

from rclpy.node import Node

from ..exceptions import CanopenError


def refuse_misspelt(node: Node) -> None:
    """Refuse a parameter that looks like one of the node; rclpy ignores it.

    Others are left alone: a parameter file may be for several nodes.

    Args:
        node: A node that has declared all its parameters.

    Raises:
        CanopenError: There is one; the message says what was meant.
    """
    overrides = node._parameter_overrides  # noqa: SLF001  # there is no public way to ask
    declared = [name for name in overrides if node.has_parameter(name)]
    known = list(node.get_parameters_by_prefix(''))
    for name in sorted(set(overrides) - set(declared)):
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
        if close:
            raise CanopenError(f'unknown parameter {name!r}; did you mean {close[0]!r}?')
