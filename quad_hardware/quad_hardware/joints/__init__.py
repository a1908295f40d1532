# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From joints of the URDF to servos and back, and what is let through to them."""

from .command import Command, CommandLimiter, LimiterSettings
from .command_loss import CommandLoss, LossReaction, MAX_TILT
from .commander import CommandCounters, JointCommander
from .mapping import JointMap, JointServo, servo_of

__all__ = [
    'MAX_TILT',
    'Command',
    'CommandCounters',
    'CommandLimiter',
    'CommandLoss',
    'JointCommander',
    'JointMap',
    'JointServo',
    'LimiterSettings',
    'LossReaction',
    'servo_of',
]
