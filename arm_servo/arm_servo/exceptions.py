# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What arm_servo raises, beside the errors of arm_model and arm_trajectory."""

from __future__ import annotations

from arm_model import ArmError


class NotReadyError(ArmError):
    """Nothing can be commanded before the arm's position is known.

    Scenarios: a command before the first joint state, or after the set-point was dropped.
    """


class BackendError(ArmError):
    """The back end cannot start; the message names the remedy.

    Scenarios: a bus.yml with mistakes, a CAN interface that is not there, a bus with a master.
    """
