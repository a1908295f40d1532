# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Unknown names that are misspelt."""

from __future__ import annotations

from collections.abc import Collection, Iterable
import difflib

from rclpy.node import Node

from .exceptions import ParameterError

ALIKE = 0.8  # of SequenceMatcher: one letter in five; short names for other nodes pass
RCLPY_PREFIX = 'qos_overrides.'  # declared with a topic, so some of them later than our look


def refuse_misspelt(node: Node, similar: Collection[str] = ()) -> list[str]:
    """Refuse a parameter that looks like one of a node's; rclpy would ignore it.

    Others are left alone: a parameter file may be for several nodes. ``similar`` are names of
    other programs that look like one by chance; the node has declared all its parameters.

    Returns:
        The names that were given and that the node has not; they have no effect on it.

    Raises:
        ParameterError: There is one; the message names the likely one.
    """
    given = node._parameter_overrides  # noqa: SLF001  # there is no public way to read it
    unknown = [
        name
        for name in given
        if not node.has_parameter(name) and not name.startswith(RCLPY_PREFIX)
    ]
    known = node.get_parameters_by_prefix('')
    refuse_similar(
        (name for name in unknown if name not in similar),
        (name for name in known if not name.startswith(RCLPY_PREFIX)),
    )
    return unknown


def refuse_similar(unknown: Iterable[str], known: Iterable[str]) -> None:
    """Refuse a name that looks like a known one.

    Raises:
        ParameterError: There is one; the message names the likely one.
    """
    names = list(known)
    for name in sorted(unknown):
        if meant := closest(name, names):
            raise ParameterError(f'unknown parameter {name!r}; did you mean {meant!r}?')


def closest(name: str, names: Iterable[str], alike: float = ALIKE) -> str:
    """Return the one of some names that is most like another one; empty when none is.

    Args:
        name: What was written.
        names: What there is.
        alike: Least likeness, 0 to 1.
    """
    return next(iter(difflib.get_close_matches(name, list(names), n=1, cutoff=alike)), '')
