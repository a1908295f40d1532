# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys of a device in the text of a bus.yml: changed or added, all else stays as it is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
import re

import yaml


class BusEditError(ValueError):
    """The file has a form in which we change nothing; the message says what to write by hand."""


BEFORE = 'before: '
"""What a comment behind a value that is changed begins with: it is about the old one."""
NOT_DEVICES = frozenset({'options', 'master', 'defaults', 'nodes'})


@dataclass(frozen=True, slots=True)
class _Splice:
    """A piece of text in the place of another one."""

    start: int  # where the old one begins
    end: int  # where it ends
    text: str  # the new one


def edited(
    text: str, device: str, values: Mapping[str, float | bool], reason: str, channel: int | None
) -> str:
    """Return the text with keys of a device changed.

    A key that stands there gets its new value; others are added below the first key. Comments,
    order and quotes of everything else stay. A line above says why, and a comment behind a value
    that is changed begins with ``before:``. The channel is the place of the axis in ``channels``,
    None for a device with one axis.

    Raises:
        BusEditError: The device is an alias, or its axes have no ``channels`` to write to.
    """
    section = _section(text, device, channel, values)
    in_flow = section.flow_style
    splices = _in_flow(section, values) if in_flow else _in_block(text, section, values, reason)
    new = _spliced(text, splices)
    section = _section(new, device, channel, values)
    for name, value in values.items():
        found = _value(section, name)
        if not isinstance(found, yaml.ScalarNode) or found.value != yaml_text(value):
            raise BusEditError(
                f'{name} of {device} is not where it was expected; write by hand: '
                f'{name}: {yaml_text(value)}'
            )
    return new


def replace_file(path: Path, edit: Callable[[str], str]) -> None:
    """Change a file; it is replaced as a whole, or not at all.

    Where the path is a link its file is changed, and the link stays: a workspace that is built
    with links has the file in its sources.
    """
    path = path.resolve()
    text = edit(path.read_text(encoding='utf-8'))
    new = path.with_name(f'{path.name}.new')
    try:
        new.write_text(text, encoding='utf-8')
        new.chmod(path.stat().st_mode)
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)


def _section(
    text: str, device: str, channel: int | None, values: Mapping[str, float | bool]
) -> yaml.MappingNode:
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    nodes = _value(root, 'nodes')
    key, found = _pair(nodes if nodes is not None else root, device)
    if found is None and device not in NOT_DEVICES:
        key, found = _pair(root, device)
    wanted = ', '.join(f'{name}: {yaml_text(value)}' for name, value in values.items())
    if not isinstance(found, yaml.MappingNode) or key is None or not found.value:
        raise BusEditError(f'no keys of {device} to change; write by hand: {wanted}')
    if found.start_mark.index < key.start_mark.index:
        raise BusEditError(
            f'{device} is an alias (*) of another device; write its own keys by hand: {wanted}'
        )
    if channel is None:
        return found
    channels = _value(found, 'channels')
    parts = channels.value if isinstance(channels, yaml.SequenceNode) else []
    if channel >= len(parts) or not isinstance(parts[channel], yaml.MappingNode):
        raise BusEditError(
            f'{device} has no channels with keys; write by hand into entry {channel + 1} of its '
            f'channels: {wanted}'
        )
    section: yaml.MappingNode = parts[channel]
    return section


def _pair(node: yaml.Node | None, name: str) -> tuple[yaml.ScalarNode | None, yaml.Node | None]:
    pairs = node.value if isinstance(node, yaml.MappingNode) else []
    for key, value in pairs:
        if isinstance(key, yaml.ScalarNode) and key.value == name:
            return key, value
    return None, None


def _value(node: yaml.Node | None, name: str) -> yaml.Node | None:
    return _pair(node, name)[1]


def _in_flow(section: yaml.MappingNode, values: Mapping[str, float | bool]) -> list[_Splice]:
    changed = _replacements(section, values)
    new = [name for name in values if _value(section, name) is None]
    last = section.value[-1][1].end_mark.index
    added = ''.join(f', {name}: {yaml_text(values[name])}' for name in new)
    return [*changed, _Splice(last, last, added)] if added else changed


def _in_block(
    text: str, section: yaml.MappingNode, values: Mapping[str, float | bool], reason: str
) -> list[_Splice]:
    first = section.value[0][0].start_mark
    indent = ' ' * first.column
    new = [name for name in values if _value(section, name) is None]
    old = [key for key, _ in section.value if key.value in values]
    splices = [*_replacements(section, values), *_dated_comments(text, section, values)]
    comment = f'# {reason}\n{indent}'
    if new:
        # before the first key: what stands behind its value may be a comment or a block
        lines = ''.join(f'{name}: {yaml_text(values[name])}\n{indent}' for name in new)
        splices.append(_Splice(first.index, first.index, comment + lines))
    elif old:
        start = min(key.start_mark.index for key in old)
        splices.append(_Splice(start, start, comment))
    return splices


def _replacements(section: yaml.MappingNode, values: Mapping[str, float | bool]) -> list[_Splice]:
    splices = []
    for key, value in section.value:
        if not isinstance(key, yaml.ScalarNode) or key.value not in values:
            continue
        written = yaml_text(values[key.value])
        if value.start_mark.index < key.start_mark.index:
            raise BusEditError(
                f'{key.value} is an alias (*); write by hand: {key.value}: {written}'
            )
        splices.append(_Splice(value.start_mark.index, value.end_mark.index, written))
    return splices


def _dated_comments(
    text: str, section: yaml.MappingNode, values: Mapping[str, float | bool]
) -> list[_Splice]:
    """Return the edits that mark comments behind changed values as those of the old value."""
    splices = []
    for key, value in section.value:
        end = value.end_mark.index
        found = re.compile(rf'[ \t]+#[ \t]*(?!{BEFORE}|[ \t])').match(text, end)
        changes = key.value in values and value.value != yaml_text(values[key.value])
        if found is not None and changes:
            splices.append(_Splice(found.end(), found.end(), BEFORE))
    return splices


def _spliced(text: str, splices: list[_Splice]) -> str:
    for splice in sorted(splices, key=lambda each: each.start, reverse=True):
        text = text[: splice.start] + splice.text + text[splice.end :]
    return text


def yaml_text(value: float | bool) -> str:
    """Write a value as YAML 1.1 reads it; 2e-05 were a text there, 2.0e-05 is a number."""
    if isinstance(value, bool):
        return str(value).lower()
    mantissa, exponent, power = repr(value).partition('e')
    return f'{mantissa}{"" if "." in mantissa or not exponent else ".0"}{exponent}{power}'
