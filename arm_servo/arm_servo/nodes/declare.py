# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Declaring parameters in a line each, with what they mean and their range."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node


class Declarations:
    """Declares parameters of a node."""

    def __init__(self, node: Node, prefix: str = '', *, read_only: bool = True) -> None:
        """Prepare.

        Args:
            node: The node.
            prefix: Before each name, with its dot.
            read_only: They cannot be changed while the node runs.
        """
        self._read_only = read_only
        self._node = node
        self._prefix = prefix

    def text(self, name: str, default: str, description: str) -> str:
        """Declare a text."""
        return str(self._declare(name, default, description))

    def flag(self, name: str, description: str, *, default: bool) -> bool:
        """Declare a flag."""
        return bool(self._declare(name, default, description))

    def number(
        self, name: str, default: float, description: str, span: tuple[float, float]
    ) -> float:
        """Declare a number within a range."""
        limits = [FloatingPointRange(from_value=span[0], to_value=span[1])]
        return float(self._declare(name, default, description, limits))

    def integer(self, name: str, default: int, description: str, span: tuple[int, int]) -> int:
        """Declare a whole number within a range."""
        descriptor = self._descriptor(description)
        descriptor.integer_range = [IntegerRange(from_value=span[0], to_value=span[1])]
        return int(self._node.declare_parameter(self._prefix + name, default, descriptor).value)

    def texts(self, name: str, default: list[str], description: str) -> list[str]:
        """Declare a list of texts; the default is never empty, which would have no type."""
        return [str(value) for value in self._declare(name, default, description)]

    def _declare(
        self,
        name: str,
        default: object,
        description: str,
        limits: Sequence[FloatingPointRange] = (),
    ) -> Any:  # noqa: ANN401  # the type of the default
        descriptor = self._descriptor(description)
        descriptor.floating_point_range = list(limits)
        return self._node.declare_parameter(self._prefix + name, default, descriptor).value

    def _descriptor(self, description: str) -> ParameterDescriptor:
        return ParameterDescriptor(description=description, read_only=self._read_only)
