# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameter files: YAML with the nodes' names on top, `ros__parameters` below, then the values.

https://docs.ros.org/en/jazzy/How-To-Guides/ROS2-Node-arguments.html
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..cli.errors import FieldValueError, UnknownNameError
from ..cli.suggest import hint
from .from_text import parse_mapping

_SECTION = 'ros__parameters'
_ALL_NODES = '/**'
_SEPARATOR = '.'


def dump(node: str, values: Mapping[str, object]) -> str:
    """Write a parameter file for one node, keys sorted; a point in a name starts a level."""
    import yaml

    tree: dict[str, Any] = {}
    for name, value in values.items():
        *levels, last = name.split(_SEPARATOR)
        branch = tree
        for level in levels:
            branch = branch.setdefault(level, {})
        branch[last] = value
    text: str = yaml.safe_dump({node: {_SECTION: tree}})
    return text


def values_for(node: str, text: str, *, use_wildcard: bool = True) -> dict[str, object]:
    """Read the parameters of one node, and perhaps those for all (`/**`), in a parameter file.

    What names the node goes before what is for all nodes. (rclpy's reader takes a quoted '5' for
    a number.)

    Raises:
        UnknownNameError: The file has nothing for the node.
        FieldValueError: It is no parameter file.
    """
    sections = parse_mapping(text)
    wanted = [*([_ALL_NODES] if use_wildcard else []), node.lstrip('/'), node]
    found = [key for key in wanted if key in sections]
    if not found:
        names = ', '.join(str(key) for key in sections)
        raise UnknownNameError(
            f'Param file does not contain parameters for {node}, only for nodes: {names}'
            + hint(node, [str(key) for key in sections])
        )
    values: dict[str, object] = {}
    for key in found:
        section = sections[key]
        if not isinstance(section, dict) or not isinstance(section.get(_SECTION), dict):
            raise FieldValueError(
                f"YAML file is not a valid ROS parameter file for node {key}: '{_SECTION}' "
                'is missing below it'
            )
        values.update(_flatten('', section[_SECTION]))
    return values


def _flatten(prefix: str, tree: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _flatten(f'{prefix}{name}{_SEPARATOR}', value)
        else:
            yield f'{prefix}{name}', value
