# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong, as a user sees it.

::

    FrontendError(RuntimeError)          exit code 1, message on stderr, no traceback
    |-- UnknownNameError(LookupError)    a node, topic, package ... that is not there
    |-- BadTypeError(TypeError)          an interface type that cannot be imported
    |-- FieldValueError(ValueError)      YAML that does not fit a message
    `-- NoAnswerError(TimeoutError)      a service or node that stays silent

Wrong arguments are refused by argparse with exit code 2, as the real command does.
"""

from __future__ import annotations

from collections.abc import Iterable

_ALIKE = 0.75  # types of two packages are 0.6 alike in their middle parts


class FrontendError(RuntimeError):
    """A failure that ends the command with exit code 1 and this message."""


class UnknownNameError(FrontendError, LookupError):
    """Nothing has the name that was given, e.g. ``topic info /chater``."""


class BadTypeError(FrontendError, TypeError):
    """An interface type that is not installed or not of the wanted kind."""


class FieldValueError(FrontendError, ValueError):
    """A value that a message cannot take, e.g. an unknown field or text for a number."""


class NoAnswerError(FrontendError, TimeoutError):
    """A service that did not appear or did not answer in time."""


def hint(name: str, known: Iterable[str]) -> str:
    """Return a line that asks whether one of up to three near names was meant, if any."""
    from difflib import get_close_matches  # only a command that fails needs it

    near = [f"'{each}'" for each in get_close_matches(name, list(known), cutoff=_ALIKE)]
    return f'\nDid you mean {" or ".join(near)}?' if near else ''
