# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Splitting an EDS or DCF file into sections and values with their lines (CiA 306-1, 4.2).

Takes what vendors' files hold: any case, blanks around names, CRLF, UTF-8, UTF-16 or Latin-1 text,
comments with ``;`` or ``#``. Odd lines are reported and skipped, never fatal.
"""

from __future__ import annotations

import codecs
from dataclasses import dataclass, field

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
        """Return the text of a lower-case key, empty when it is missing or empty."""
        value = self.values.get(key)
        return value.text if value is not None else ''

    def line_of(self, key: str) -> int:
        """Return the line of a key, that of the section when it is missing."""
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
        """Report what was skipped or guessed."""
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
    """Name the encoding of a text in which every other byte is 0, as that of ASCII is."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return 'utf-16'
    head = data[:NUL_SAMPLE]
    for start, encoding in ((1, 'utf-16-le'), (0, 'utf-16-be')):
        if len(head) > 1 and not any(head[start::2]) and any(head[1 - start :: 2]):
            return encoding
    return ''


def section_name(title: str) -> str:
    """Return the name by which a section is found: ``1018 Sub1`` is ``1018sub1``."""
    return ''.join(title.split()).lower()


def read_ini(text: str) -> IniFile:
    """Split a text into sections; nothing in it can make this fail."""
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
