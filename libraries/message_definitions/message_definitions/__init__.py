# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Definitions of messages and services as recordings and viewers carry them (`ros2msg`)."""

from .concatenation import concatenated, nested_type
from .installed import (
    DefinitionError,
    message_definition,
    service_definitions,
    ServiceDefinitions,
)

__all__ = [
    'DefinitionError',
    'ServiceDefinitions',
    'concatenated',
    'message_definition',
    'nested_type',
    'service_definitions',
]
