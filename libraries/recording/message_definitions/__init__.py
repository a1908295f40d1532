# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Definitions of messages (`ros2msg`), and what their Python classes need."""

from .installed import (
    concatenated,
    DefinitionError,
    message_definition,
    nested_type,
)
from .type_support import load_type_support

__all__ = [
    'DefinitionError',
    'concatenated',
    'load_type_support',
    'message_definition',
    'nested_type',
]
