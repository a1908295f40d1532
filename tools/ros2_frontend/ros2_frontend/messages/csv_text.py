# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A message as one line of comma-separated values, e.g. for plotting."""

from __future__ import annotations

from typing import Any

from ..aliases import Message
from .document import Abbreviation, describe_array, describe_text, FULL, is_array


def to_csv(message: Message, abbreviation: Abbreviation = FULL) -> str:
    """Write all values of a message, depth first; texts are not quoted (as in ros2cli)."""
    fields = message.get_fields_and_field_types()
    cells = (
        _cell(getattr(message, name), slot, abbreviation)
        for name, slot in zip(fields, message.SLOT_TYPES, strict=True)
    )
    return ','.join(cells)


def _cell(value: Any, slot: Any, cut: Abbreviation) -> str:  # noqa: ANN401  # of any type
    if is_array(value):
        if cut.no_arrays and slot is not None:
            return describe_array(value, slot)
        shown = value if cut.length is None else value[: cut.length]
        cells = [_cell(element, None, cut) for element in shown]
        return ','.join([*cells, '...'] if len(shown) < len(value) else cells)
    if hasattr(value, 'SLOT_TYPES'):
        return to_csv(value, cut)
    if isinstance(value, str) and cut.no_texts:
        return describe_text(value)
    if isinstance(value, str | bytes) and cut.length is not None and len(value) > cut.length:
        rest: Any = b'...' if isinstance(value, bytes) else '...'
        value = value[: cut.length] + rest
    return str(value)
