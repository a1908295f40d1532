# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serial bridge of the XGO quadruped: protocols, driver, node and tools.

Conventions: ``now`` and all times are on the steady clock in [s], unless stated
otherwise; servo angles are in [deg] by motor id, as on the board, joint positions in [rad].
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
