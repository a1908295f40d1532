# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names for what rclpy and the generated interfaces leave without types."""

from __future__ import annotations

from typing import Any, TypeAlias

Message: TypeAlias = Any
"""An instance of a generated class: a message, request, response, goal, result or feedback."""
InterfaceClass: TypeAlias = Any
"""A generated class: of a message, a service or an action."""
Handle: TypeAlias = Any
"""An object of rclpy: node, client, publisher, future, goal handle, QoS profile, endpoint."""
NamesAndTypes: TypeAlias = list[tuple[str, list[str]]]
"""Topics, services or actions with the types they are used with."""
