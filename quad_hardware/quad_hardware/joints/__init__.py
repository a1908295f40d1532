# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From joints of the URDF to servos and back, and what is let through to them."""

from .command import CommandLimiter, LimiterSettings
from .commander import CommandCounters, JointCommander, LossReaction
from .mapping import JointMap, JointServo, servo_of

__all__ = [
    'CommandCounters',
    'CommandLimiter',
    'JointCommander',
    'JointMap',
    'JointServo',
    'LimiterSettings',
    'LossReaction',
    'servo_of',
]
