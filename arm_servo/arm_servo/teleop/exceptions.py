# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the programs for jogging by hand raise."""

from __future__ import annotations

from arm_model import ArmError


class SettingError(ArmError, ValueError):
    """A parameter is misspelt, or its value makes no sense.

    Scenarios: a speed of 150 %, a button that no gamepad has.
    """
