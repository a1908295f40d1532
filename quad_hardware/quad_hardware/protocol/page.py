# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_hardware protocol``: prints the protocol tables as Markdown."""

from __future__ import annotations

from collections.abc import Iterator
import sys

from . import PROTOCOLS
from .frame import Access, Field, Function, Kind, Protocol
from .tables import MOTOR_ORDER

_ACCESS = {Access.READ: 'R', Access.WRITE: 'W', Access.PUSH: 'push'}


def protocol_page() -> str:
    """Return PROTOCOL.md: frames, motors, registers and functions of all protocols."""
    lines = [
        '# Serial protocols of the XGO',
        '',
        'Made from its tables by `ros2 run quad_hardware protocol > PROTOCOL.md`; do not edit.',
        '',
        'Every frame of all protocols:',
        '',
        '```',
        '55 00 | LEN | TYPE | address | payload | CHK | 00 AA',
        'LEN counts the whole frame; CHK = 255 - (LEN + TYPE + address + payload) mod 256',
        '```',
        '',
        f'Motors, in the order of the wire: {", ".join(map(str, MOTOR_ORDER))}.',
        '',
    ]
    for protocol in PROTOCOLS:
        lines += _section(protocol)
    return '\n'.join(lines)


def _section(protocol: Protocol) -> Iterator[str]:
    yield f'## Protocol {protocol.name}'
    yield ''
    yield (
        f'Layout: {protocol.origin}. {protocol.baud} baud, 8N1; address of '
        f'{protocol.address_size} byte(s); frames of up to {protocol.max_length} bytes.'
    )
    yield ''
    kinds = (f'{kind:02X} {kind.name.lower()}' for kind in Kind if kind in protocol.kinds)
    other = protocol.other_write
    also = '' if other is None else f'; {other:02X} of some hosts is a write, too'
    yield f'TYPE: {", ".join(kinds)}{also}.'
    yield ''
    yield '| address | name | access | bytes | payload | range | meaning |'
    yield '|---|---|---|---|---|---|---|'
    for function in protocol.functions.values():
        yield _row(protocol, function)
    yield ''


def _row(protocol: Protocol, function: Function) -> str:
    address = function.address.to_bytes(protocol.address_size, 'big').hex(' ').upper()
    access = ''.join(name for flag, name in _ACCESS.items() if flag in function.access)
    size = f'{"≤ " if function.variable else ""}{function.length}'
    if function.repeated:
        size = f'n × {size}'
    fields = '<br>'.join(_field(field) for field in function.fields)
    cells = (address, function.name, access, size, fields, _range(function), function.meaning)
    return '| ' + ' | '.join(cells) + ' |'


def _field(field: Field) -> str:
    count = f' × {field.count}' if field.count > 1 else ''
    scale = '' if field.scale == 1.0 else f' × {field.scale:.6g}'
    unit = f' [{field.unit}]' if field.unit else ''
    meaning = f': {field.meaning}' if field.meaning else ''
    name = field.scalar.name.lower().replace('_', ' ')
    return f'{field.offset}: {field.name} {name}{count}{scale}{unit}{meaning}'


def _range(function: Function) -> str:
    ranges: dict[str, list[str]] = {}
    for model, span in function.spans.items():
        ranges.setdefault(f'{span.low:g} to {span.high:g}', []).append(model.value)
    if len(ranges) == 1:
        return f'{next(iter(ranges))} {function.unit}'
    parts = (f'{", ".join(models)} {text}' for text, models in ranges.items())
    return '; '.join(parts) + (f' {function.unit}' if ranges else '')


def main() -> None:
    """Entry point."""
    sys.stdout.write(protocol_page())


if __name__ == '__main__':
    main()
