# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serial bridge of the XGO quadruped: both protocols, driver, node and tools.

Conventions: ``now`` and all times are on the steady clock in [s], unless they are named otherwise;
servo angles are in [deg] by motor id on the side of the board, joints in [rad] elsewhere.
"""

from .exceptions import (
    CodecError,
    CommandError,
    HardwareError,
    LinkError,
    NoAnswerError,
    RecordingError,
)

__all__ = [
    'CodecError',
    'CommandError',
    'HardwareError',
    'LinkError',
    'NoAnswerError',
    'RecordingError',
]


__version__ = '0.1.0'
