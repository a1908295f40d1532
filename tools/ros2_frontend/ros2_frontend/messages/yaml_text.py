# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML text of a document, character for character what PyYAML writes, in a tenth of the time.

`topic echo` prints every message: PyYAML takes 2 ms for a `JointState` of seven joints. The shape
of a message is simple, so that most of it is written here; PyYAML decides how a text is quoted
(once per text), and writes the whole document when a text needs several lines.
"""

from __future__ import annotations

from functools import lru_cache
import math
import re
import sys

from ..aliases import Document, Value

_INDENT = '  '
# texts that are the same in YAML: they start like a name, hold nothing that YAML knows as syntax,
# and are not the words of the YAML 1.1 types bool and null
_PLAIN = re.compile(r'[A-Za-z/][A-Za-z0-9_/.\-]*')
_LINE_BREAKS = frozenset('\n\x85\u2028\u2029')
_WORDS = frozenset({'yes', 'no', 'true', 'false', 'on', 'off', 'null'})


def to_yaml(document: Document, flow_style: bool = False) -> str:
    """Write a document.

    Args:
        document: Nested dicts, lists, numbers, bools and texts.
        flow_style: Whether to write one line with braces and brackets.

    Returns:
        YAML, with a final line feed.
    """
    lines: list[str] = []
    if flow_style or not isinstance(document, dict) or not document:
        return _by_pyyaml(document, flow_style)
    try:
        _mapping(document, '', '', lines)
    except _NeedsSeveralLinesError:
        return _by_pyyaml(document, flow_style)
    return '\n'.join(lines) + '\n'


class _NeedsSeveralLinesError(Exception):
    """A text that does not fit on one line."""


def _by_pyyaml(document: Document, flow_style: bool) -> str:
    import yaml

    text: str = yaml.dump(
        document,
        Dumper=yaml.SafeDumper,
        allow_unicode=True,
        width=sys.maxsize,
        default_flow_style=flow_style,
        sort_keys=False,
    )
    return text


def _mapping(mapping: dict[str, Document], first: str, indent: str, lines: list[str]) -> None:
    for key, value in mapping.items():
        _entry(f'{first}{_text(key)}:', value, indent, lines)
        first = indent


def _entry(head: str, value: Document, indent: str, lines: list[str]) -> None:
    """One key with its value; a sequence below a key is not indented further."""
    if isinstance(value, dict) and value:
        lines.append(head)
        _mapping(value, indent + _INDENT, indent + _INDENT, lines)
    elif isinstance(value, list) and value:
        lines.append(head)
        _sequence(value, indent, indent, lines)
    else:
        lines.append(f'{head} {_scalar(value)}')


def _sequence(values: list[Document], first: str, indent: str, lines: list[str]) -> None:
    for value in values:
        if isinstance(value, dict) and value:
            _mapping(value, f'{first}- ', indent + _INDENT, lines)
        elif isinstance(value, list) and value:
            _sequence(value, f'{first}- ', indent + _INDENT, lines)
        else:
            lines.append(f'{first}- {_scalar(value)}')
        first = indent


def _scalar(value: Document) -> str:
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, float):
        return _float(value)
    return _other(value)


def _float(value: float) -> str:
    """A float as PyYAML writes it: YAML 1.1 wants a point before an exponent."""
    if math.isinf(value):
        return '.inf' if value > 0.0 else '-.inf'
    if math.isnan(value):
        return '.nan'
    text = repr(value)
    return text.replace('e', '.0e') if 'e' in text and '.' not in text else text


def _other(value: Value) -> str:
    if type(value) is int:
        return str(value)
    return _by_pyyaml({'k': value}, False)[len('k: ') : -1]


def _text(value: str) -> str:
    if _PLAIN.fullmatch(value) and value.lower() not in _WORDS:
        return value
    return _quoted(value)


@lru_cache(maxsize=1024)
def _quoted(value: str) -> str:
    if not _LINE_BREAKS.isdisjoint(value):
        raise _NeedsSeveralLinesError
    return _by_pyyaml({'k': value}, False)[len('k: ') : -1]
