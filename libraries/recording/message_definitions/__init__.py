# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Message definitions (`ros2msg`), and a fast import of type supports."""

from .installed import (
    concatenated,
    DefinitionError,
    load_type_support,
    message_definition,
    nested_type,
)

__all__ = [
    'DefinitionError',
    'concatenated',
    'load_type_support',
    'message_definition',
    'nested_type',
]
