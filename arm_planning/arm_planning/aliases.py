# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A program of arm_bringup, which knows robot folders, by the name that it has here."""

from __future__ import annotations

from importlib import import_module
import sys


def srdf() -> None:
    """Make the SRDF of a robot from its description, or refresh it, with a report."""
    try:
        program = import_module('arm_bringup.srdf')
    except ModuleNotFoundError as error:
        sys.exit(f'{error.name} is missing: build arm_bringup, which knows robot folders')
    sys.exit(program.main())
