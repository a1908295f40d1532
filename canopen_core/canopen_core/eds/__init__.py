# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""EDS and DCF files (CiA 306-1), and values as text."""

from .ini import bytes_from_text, parse_integer, text_from_bytes
from .load import DUMMY_TYPES, Eds, load_eds

__all__ = ['DUMMY_TYPES', 'Eds', 'bytes_from_text', 'load_eds', 'parse_integer', 'text_from_bytes']
