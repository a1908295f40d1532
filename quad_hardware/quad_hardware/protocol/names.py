# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of the protocols on command lines and in parameters."""

from __future__ import annotations

import sys

from .function_table import V2
from .register_table import V1

FORMER_NAMES = {'old': V1.name, 'new': V2.name}
"""Present names by former ones, which are accepted with a warning."""


def protocol_argument(text: str) -> str:
    """Return the name of a protocol, for the ``type`` of an argument with choices."""
    if text in FORMER_NAMES:
        warn_of_former_name(f"protocol '{text}'", f"'{FORMER_NAMES[text]}'")
    return FORMER_NAMES.get(text, text)


def warn_of_former_name(former: str, present: str) -> None:
    """Print that something on a command line has another name now."""
    sys.stderr.write(
        f'warning: {former} is called {present} now; the former name is accepted for a while\n'
    )
