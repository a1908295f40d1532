# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The program of quad_sim by the name that it has in quad_hardware, too."""

from __future__ import annotations

from importlib import import_module
import sys


def fake_xgo() -> None:
    """Simulate an XGO on a pseudo-terminal: fake_xgo of quad_sim, by its former name."""
    try:
        program = import_module('quad_sim.fake_xgo')
    except ModuleNotFoundError as error:
        if error.name != 'quad_sim':
            raise
        sys.exit(
            'this program belongs to quad_sim, which is not installed; build it with '
            '`colcon build --packages-up-to quad_sim`, or `pip install ./quad_sim`'
        )
    sys.exit(program.main())
