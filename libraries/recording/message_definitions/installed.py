# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Definitions of installed packages: `share/<package>/msg/<Name>.msg` below ament's prefixes."""

from __future__ import annotations

from collections.abc import Callable
import importlib
import os
from pathlib import Path
import re
import sys
from typing import Any

_TYPE_SUPPORT = 'rosidl_generator_py'
_GENERATOR = 'rosidl_generator_py.generate_py_impl'


def load_type_support() -> None:
    """Load the importer of type supports without the code generator.

    The generator is optional for the package. It would load templates and a parser for interface
    files: 10 MB and 0.1 s in each process, for nothing. It can still be imported later by its
    module.
    """
    if _TYPE_SUPPORT in sys.modules:
        return
    modules: dict[str, Any] = sys.modules
    modules[_GENERATOR] = None  # by which Python takes it for missing
    try:
        importlib.import_module(_TYPE_SUPPORT)
    finally:
        del modules[_GENERATOR]


# a type of another message: `pkg/Name` or `Name` (same package), with an array suffix perhaps;
# https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html, section 2.1
_FIELD = re.compile(r'(?:(?P<package>[a-z]\w*)/)?(?:msg/)?(?P<name>[A-Z]\w*)(?:\[[^\]]*\])?\s+\w')

_NESTED = '=' * 80  # before each nested definition


def nested_type(line: str, package: str) -> str | None:
    """Return the message type, `package/msg/Name`, of the field that a line declares.

    None for constants, primitive types and comments.
    """
    match = _FIELD.match(line.strip())
    if match is None:
        return None
    return f'{match["package"] or package}/msg/{match["name"]}'


def concatenated(name: str, read: Callable[[str], str]) -> str:
    """Return a definition followed by those of all nested messages, as in bags (`ros2msg`).

    Each nested definition appears once, below a line with its name, `package/msg/Name`; `read`
    returns a definition by name.
    """
    found: dict[str, str] = {}
    wanted = [name]
    while wanted:
        each = wanted.pop(0)
        if each in found:
            continue
        found[each] = read(each)
        package = each.partition('/')[0]
        nested = (nested_type(line, package) for line in found[each].splitlines())
        wanted += [type_ for type_ in nested if type_ is not None]
    top, *others = found.items()
    return '\n'.join([top[1], *(f'{_NESTED}\nMSG: {type_}\n{text}' for type_, text in others)])


class DefinitionError(LookupError):
    """A message type is not installed, or is defined in IDL only."""


def message_definition(name: str) -> str:
    """Return the definition of `package/msg/Name` and those of all nested messages.

    Raises:
        DefinitionError: The message or a nested one is not installed, or has no .msg file.
    """
    return concatenated(name, _read)


def _read(name: str) -> str:
    parts = name.split('/')
    if len(parts) != 3 or parts[1] != 'msg':
        raise DefinitionError(f'{name}: write package/msg/Name')
    package, folder, base = parts
    prefixes = filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep))
    for prefix in prefixes:
        path = Path(prefix, 'share', package, folder, f'{base}.{folder}')
        if path.is_file():
            return path.read_text(encoding='utf-8')
    raise DefinitionError(f'{name}: no {base}.{folder} of {package} is installed')
