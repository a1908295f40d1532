# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""EDS and DCF files (CiA 306-1), and values as text."""

from .ini import bytes_from_text, IniFile, IniSection, parse_integer, read_ini, text_from_bytes
from .load import DUMMY_TYPES, Eds, load_eds, read_eds_text

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
