# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Definitions of messages (`ros2msg`), and what their Python classes need."""

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
