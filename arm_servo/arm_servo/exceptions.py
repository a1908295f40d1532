# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What arm_servo raises, beside the errors of arm_model and arm_trajectory."""

from __future__ import annotations

from arm_model import ArmError


class NotReadyError(ArmError):
    """Nothing can be commanded before the arm's position is known.

    Scenarios: a command before the first joint state, or after the set-point was dropped.
    """
