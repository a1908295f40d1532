# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names for what rclpy and the generated interfaces leave without types."""

from __future__ import annotations

from typing import Any, TypeAlias

Message: TypeAlias = Any
"""An instance of a generated class: a message, request, response, goal, result or feedback."""

InterfaceClass: TypeAlias = Any
"""A generated class: of a message, a service or an action."""

Slot: TypeAlias = Any
"""The declared type of a field, a `rosidl_parser.definition` type from `SLOT_TYPES`."""

Value: TypeAlias = Any
"""What a field holds: a number, bool, text, bytes, message, list or array of these."""

Document: TypeAlias = Any
"""Plain data: nested dicts, lists, numbers, bools and texts."""

Node: TypeAlias = Any
"""An `rclpy.node.Node`."""

Endpoint: TypeAlias = Any
"""An `rclpy.topic_endpoint_info.TopicEndpointInfo`."""

QosProfile: TypeAlias = Any
"""An `rclpy.qos.QoSProfile`."""

Handle: TypeAlias = Any
"""Another object of rclpy: an executor, client, publisher, future, goal handle or event."""

NamesAndTypes: TypeAlias = list[tuple[str, list[str]]]
"""Topics, services or actions with the types they are used with."""
