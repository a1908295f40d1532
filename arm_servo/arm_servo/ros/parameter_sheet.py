# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of a node that does not run: declared and refused by the code of those that do."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, cast

from rclpy.node import Node


class ParameterSheet:
    """What declarations need of a node; made of the tables of a parameter file."""

    def __init__(self, name: str, table: Mapping[str, Any]) -> None:
        """Read what the file has for a node.

        Args:
            table: Parameters by name; tables in it are names with dots.
        """
        self._name = name
        self._parameter_overrides = {
            key: SimpleNamespace(name=key, value=value) for key, value in flat(table).items()
        }
        self._declared: dict[str, Any] = {}
        self.node = cast('Node', self)

    def get_name(self) -> str:
        """Return the name of the node."""
        return self._name

    def declare_parameter(
        self, name: str, value: object, *_descriptor: object, **_: object
    ) -> SimpleNamespace:
        """Keep a parameter."""
        self._declared[name] = SimpleNamespace(name=name, value=value)
        return self.get_parameter(name)

    def has_parameter(self, name: str) -> bool:
        """Whether it was declared."""
        return name in self._declared

    def get_parameter(self, name: str) -> SimpleNamespace:
        """Return what was declared."""
        parameter: SimpleNamespace = self._declared[name]
        return parameter

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, SimpleNamespace]:
        """Return what was declared below a prefix; empty for all."""
        return {name: it for name, it in self._declared.items() if name.startswith(prefix)}


def flat(table: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    """Return tables in tables as names with dots.

    Args:
        table: Parameters, and tables of them.
        prefix: Before each name, with its dot.
    """
    names: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict):
            names |= flat(value, f'{prefix}{name}.')
        else:
            names[f'{prefix}{name}'] = value
    return names
