# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""EDS and DCF files (CiA 306-1), and values as text."""

from .ini import IniFile, IniSection, read_ini
from .load import DUMMY_TYPES, Eds, load_eds, read_eds_text
from .values import bytes_from_text, parse_integer, text_from_bytes

__all__ = [
    'DUMMY_TYPES',
    'Eds',
    'IniFile',
    'IniSection',
    'bytes_from_text',
    'load_eds',
    'parse_integer',
    'read_eds_text',
    'read_ini',
    'text_from_bytes',
]
