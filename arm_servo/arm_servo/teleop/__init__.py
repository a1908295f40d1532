# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging by hand: keyboard and gamepad for a servo node, of this package or of MoveIt."""

from .jog import CartesianJog, Frame, Jog, JointJog, Scales
from .keyboard_teleop import KeyboardTeleop

__all__ = ['CartesianJog', 'Frame', 'Jog', 'JointJog', 'KeyboardTeleop', 'Scales']
