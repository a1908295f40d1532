# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Demos of an arm: one readable program each, a client of public topics, services and actions.

:mod:`.wave` streams targets to drives, :mod:`.motion` jogs and sends trajectories, :mod:`.plan`
picks and places with move_group; :mod:`.arm` contains the shared code.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
import sys

from process_supervisor import USAGE_ERROR

from ..session import MAKE_MOVE


def motion_demo(argv: Sequence[str] | None = None) -> int:
    """Run :mod:`.motion` if arm_servo, an optional dependency, is built."""
    if find_spec('arm_servo') is None:
        sys.stderr.write(f'{MAKE_MOVE}\n')
        return USAGE_ERROR
    from .motion import main

    return main(argv)


def plan_demo(argv: Sequence[str] | None = None) -> int:
    """Run :mod:`.plan` if arm_servo and arm_planning are built."""
    needed = ('arm_servo', 'arm_planning')
    if missing := [name for name in needed if find_spec(name) is None]:
        sys.stderr.write(f'build {" and ".join(missing)} (make build) for planned motions\n')
        return USAGE_ERROR
    from .plan import main

    return main(argv)
