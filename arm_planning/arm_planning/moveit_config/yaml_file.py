# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML files as flat parameters, each with the line that it stands in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
import re

import yaml

from ..exceptions import ConfigError

EXPONENT = re.compile(r'[-+]?\d+(\.\d*)?[eE][-+]?\d+')
"""Numbers that YAML 1.1 takes for text, and ROS does not."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a parameter comes from."""

    file: Path  # the file
    line: int  # its line, from 1 on

    def __str__(self) -> str:
        """Return it as compilers write it."""
        return f'{self.file}:{self.line}'


@dataclass(frozen=True, slots=True)
class FlatYaml:
    """A file."""

    values: Mapping[str, object]  # its scalars and lists by name, with dots between the keys
    places: Mapping[str, Place]  # where each of them is, and each table


def read_flat(path: Path, prefix: str = '') -> FlatYaml:
    """Read a file.

    Args:
        prefix: Before each name, with its dot.

    Raises:
        ConfigError: It cannot be read, is no YAML or no table, or has a key twice.
    """
    try:
        loader = yaml.SafeLoader(path.read_text(encoding='utf-8'))
        root = loader.get_single_node()
        if root is None:
            return FlatYaml({}, {})
        if not isinstance(root, yaml.MappingNode):
            raise ConfigError(f'{path}:1: a table is needed: keys with values')
        entries = list(_walk(path, loader, root, prefix))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: {error}') from error
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise ConfigError(f'{path}:{line}: no YAML: {error.problem}') from error
    except yaml.YAMLError as error:
        raise ConfigError(f'{path}: no YAML: {error}') from error
    return FlatYaml(
        {name: value for name, value, _ in entries if not isinstance(value, _Table)},
        {name: Place(path, line) for name, _, line in entries},
    )


class _Table:
    """Stands for a table, whose entries follow."""


def _walk(
    path: Path, loader: yaml.SafeLoader, node: yaml.MappingNode, prefix: str
) -> Iterator[tuple[str, object, int]]:
    seen: dict[str, int] = {}
    for key_node, value_node in node.value:
        line = key_node.start_mark.line + 1
        key = str(loader.construct_object(key_node, deep=True))
        if key in seen:
            raise ConfigError(
                f'{path}:{line}: {key} is there twice, in line {seen[key]} too; remove one'
            )
        seen[key] = line
        name = f'{prefix}{key}'
        if isinstance(value_node, yaml.MappingNode):
            yield name, _Table(), line
            # some files have the table of their prefix around all of it
            inner = prefix if f'{key}.' == prefix else f'{name}.'
            yield from _walk(path, loader, value_node, inner)
        else:
            yield name, _value(loader, value_node), line


def _value(loader: yaml.SafeLoader, node: yaml.Node) -> object:
    value = loader.construct_object(node, deep=True)
    if isinstance(node, yaml.ScalarNode) and node.style is None and isinstance(value, str):
        return float(value) if EXPONENT.fullmatch(value) else value
    return value
