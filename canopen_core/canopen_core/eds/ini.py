# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The text of EDS and DCF files: sections with their lines, and values (CiA 306-1, 4.2, 4.6.3).

Services and command lines use the same syntax for values. Tolerates vendors' files: any case,
blanks around names, CRLF, UTF-8, UTF-16 or Latin-1 text, comments with ``;`` or ``#``. Invalid
lines are reported and skipped, never fatal.
"""

from __future__ import annotations

import codecs
from dataclasses import dataclass, field
import re
import struct

from ..exceptions import CodecError
from ..standard.datatypes import (
    byte_length,
    DataType,
    decode,
    encode,
    FIXED_BITS,
    integer_range,
    REAL_FORMATS,
    TIME_BITS,
    Value,
)

NUL_SAMPLE = 64  # [byte] of a file by which UTF-16 is recognised
COMMENT_MARKS = (';', '#')


@dataclass(frozen=True, slots=True)
class IniValue:
    """The text right of an equals sign."""

    text: str  # the text without blanks around it
    line: int  # its line, from 1


@dataclass(slots=True)
class IniSection:
    """A section and its values."""

    title: str  # name as the file writes it
    line: int  # line of its head, from 1
    values: dict[str, IniValue] = field(default_factory=dict)  # values by lower-case key

    def text(self, key: str) -> str:
        """Return the text of a lower-case key; empty if it is missing."""
        value = self.values.get(key)
        return value.text if value is not None else ''

    def line_of(self, key: str) -> int:
        """Return the line number of a key, or of the section if the key is missing."""
        value = self.values.get(key)
        return value.line if value is not None else self.line


@dataclass(slots=True)
class IniFile:
    """All sections of a file."""

    # sections by name in lower case without blanks
    sections: dict[str, IniSection] = field(default_factory=dict)
    # line, section and description of everything that had to be skipped or guessed
    oddities: list[tuple[int, str, str]] = field(default_factory=list)

    def odd(self, line: int, message: str, section: str = '') -> None:
        """Add a warning about skipped or guessed content."""
        self.oddities.append((line, section, message))


def decode_text(data: bytes) -> str:
    """Read bytes as UTF-8 or UTF-16 (with or without byte order mark), else as Latin-1."""
    encoding = _utf_16(data)
    try:
        if encoding:
            return data.decode(encoding)
        return data.decode('utf-8-sig')
    except UnicodeDecodeError:
        return data.decode('latin-1')


def _utf_16(data: bytes) -> str:
    """Return the UTF-16 encoding of a text in which every other byte is 0."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return 'utf-16'
    head = data[:NUL_SAMPLE]
    for start, encoding in ((1, 'utf-16-le'), (0, 'utf-16-be')):
        if len(head) > 1 and not any(head[start::2]) and any(head[1 - start :: 2]):
            return encoding
    return ''


def section_name(title: str) -> str:
    """Return the normalized name of a section: ``1018 Sub1`` becomes ``1018sub1``."""
    return ''.join(title.split()).lower()


def read_ini(text: str) -> IniFile:
    """Split a text into sections; never raises."""
    result = IniFile()
    section: IniSection | None = None
    # only these end a line: str.splitlines() would also split at form feeds inside a name
    for number, raw in enumerate(text.replace('\r\n', '\n').replace('\r', '\n').split('\n'), 1):
        line = raw.strip()
        if not line or line.startswith(COMMENT_MARKS):
            continue
        if line.startswith('['):
            section = _open_section(result, line, number)
        elif section is None:
            result.odd(number, f'{line[:40]!r} stands before the first section')
        else:
            _add_value(result, section, line, number)
    return result


def _open_section(result: IniFile, line: str, number: int) -> IniSection:
    title, bracket, _ = line[1:].partition(']')
    if not bracket:
        result.odd(number, f'section {line[:40]!r} has no closing bracket')
    name = section_name(title)
    if name in result.sections:
        first = result.sections[name]
        result.odd(number, f'section [{title}] was already opened in line {first.line}')
        return first
    return result.sections.setdefault(name, IniSection(title.strip(), number))


def _add_value(result: IniFile, section: IniSection, line: str, number: int) -> None:
    key, equals, text = line.partition('=')
    name = key.strip().lower()
    if not equals or not name:
        result.odd(number, f'{line[:40]!r} is neither a section nor a value')
        return
    if name in section.values:
        earlier = section.values[name].line
        result.odd(number, f'{key.strip()} was already given in line {earlier}; this one counts')
    section.values[name] = IniValue(text.strip(), number)


NODE_ID_TERM = '$NODEID'
INTEGER = re.compile(r'[-+]?(?:0[xX][0-9a-fA-F]+|[0-9]+)')
ASSEMBLER_HEX = re.compile(r'[0-9a-fA-F]+[hH]')  # 60400010h, as some vendors' files have it
INTEGER_DIGITS_MAX = 40  # longer than any 64-bit number in any notation
BOOLEAN_WORDS = {'true': True, 'false': False}


@dataclass(frozen=True, slots=True)
class EdsValue:
    """A parsed value of an EDS."""

    value: Value  # the value; of a sum with ``$NODEID`` all but the node id
    node_relative: bool = False  # the node id is to be added


def parse_integer(text: str) -> int:
    """Read a decimal (leading zeros allowed) or hexadecimal number, up to a comment (``;``).

    Raises:
        ValueError: The text is not an integer.
    """
    text = text.partition(';')[0].strip()
    if len(text) > INTEGER_DIGITS_MAX or not INTEGER.fullmatch(text):
        hint = f': write 0x{text[:-1]}' if ASSEMBLER_HEX.fullmatch(text[:40]) else ''
        raise ValueError(f'{text[:40]!r} is not a whole number{hint}')
    return int(text, 16 if 'x' in text.lower() else 10)


def parse_value(data_type: DataType, text: str) -> EdsValue | None:
    """Read a DefaultValue, ParameterValue or limit; None for an empty text and for a DOMAIN.

    Raises:
        ValueError: The text is not a value of this type.
    """
    if not text or data_type is DataType.DOMAIN:
        return None
    if data_type is DataType.VISIBLE_STRING:
        return EdsValue(text)
    if data_type is DataType.UNICODE_STRING:
        return EdsValue(_unicode_string(text))
    if data_type is DataType.OCTET_STRING:
        return EdsValue(bytes.fromhex(text))
    if data_type in REAL_FORMATS:
        return EdsValue(_real(data_type, text))
    limits = integer_range(data_type)
    if limits is None:
        return EdsValue(_time(data_type, text))
    if data_type is DataType.BOOLEAN and text.lower() in BOOLEAN_WORDS:
        return EdsValue(BOOLEAN_WORDS[text.lower()])
    return _integer(data_type, text, *limits)


def _integer(data_type: DataType, text: str, low: int, high: int) -> EdsValue | None:
    terms = [term.strip() for term in text.partition(';')[0].split('+')]
    numbers = [term for term in terms if term.upper() != NODE_ID_TERM]
    relative = len(terms) - len(numbers)
    if relative > 1:
        raise ValueError(f'{text[:40]!r} adds the node id more than once')
    if terms == ['']:
        return None
    if len(terms) > 1 and not relative:
        numbers = [text]  # '+5' is a number, '1+2' is none
    value = sum(parse_integer(number) for number in numbers)
    if low < 0 and high < value < 1 << FIXED_BITS[data_type]:
        value -= 1 << FIXED_BITS[data_type]  # 0xFF of an INTEGER8 is -1
    if not low <= value <= high:
        raise ValueError(f'{text[:40]} does not fit {data_type.name} ({low} to {high})')
    return EdsValue(value, bool(relative))


def _real(data_type: DataType, text: str) -> float:
    text = text.partition(';')[0].strip()
    size = FIXED_BITS[data_type] // 8
    try:
        if not text.lower().startswith('0x'):
            struct.pack(REAL_FORMATS[data_type], real := float(text))
            return real
        bits = parse_integer(text).to_bytes(size, 'little')  # of the number
    except OverflowError as error:
        raise ValueError(f'{text[:40]} does not fit {data_type.name}') from error
    return float(struct.unpack(REAL_FORMATS[data_type], bits)[0])


def _unicode_string(text: str) -> str:
    """Read UTF-16 as hexadecimal digits, as in the standard, or as plain text."""
    try:
        return bytes.fromhex(text).decode('utf-16-be')
    except (ValueError, UnicodeDecodeError):
        return text


def _time(data_type: DataType, text: str) -> bytes:
    size = byte_length(data_type) or 0
    try:
        return parse_integer(text).to_bytes(size, 'little')
    except OverflowError as error:
        raise ValueError(f'{text[:40]} does not fit {data_type.name}') from error


BYTE_TYPES = frozenset({DataType.DOMAIN, DataType.OCTET_STRING, *TIME_BITS})
"""Types written as hexadecimal bytes."""


def text_from_bytes(data_type: DataType, data: bytes) -> str:
    """Format the bytes of an SDO as text: a number, true or false, a string, or hexadecimal.

    Raises:
        CodecError: The bytes do not fit the type.
    """
    value = decode(data_type, data)
    if isinstance(value, bool):
        return str(value).lower()
    return value.hex(' ') if isinstance(value, bytes) else str(value)


def bytes_from_text(data_type: DataType, text: str) -> bytes:
    """Parse text into the bytes of an SDO; the inverse of :func:`text_from_bytes`.

    Integers may be hexadecimal, with ``0x``.

    Raises:
        CodecError: The text is not a value of this type.
    """
    if data_type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return encode(data_type, text)
    try:
        if data_type in BYTE_TYPES:
            return encode(data_type, bytes.fromhex(text))
        parsed = parse_value(data_type, text.strip())
    except CodecError:
        raise
    except ValueError as error:
        raise CodecError(f'{text[:40]!r} is no {data_type.name}: {error}') from error
    if parsed is None or parsed.node_relative:
        raise CodecError(f'{text[:40]!r} is no {data_type.name}')
    return encode(data_type, parsed.value)
