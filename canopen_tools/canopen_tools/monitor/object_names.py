# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names and types of objects: by the EDS of the device, else by the standard."""

from __future__ import annotations

from canopen_core.standard import (
    DataType,
    Index,
    object_address,
    ObjectDictionary,
    pdo_object,
)

_STANDARD_NAMES: dict[int, str] = {
    index: index.name.replace('_', ' ').capitalize() for index in Index
}


class ObjectNames:
    """What is known of the objects of one device."""

    def __init__(self, dictionary: ObjectDictionary | None = None) -> None:
        """Read names from a dictionary, without one from the standard."""
        self._dictionary = dictionary

    def name(self, index: int, subindex: int) -> str:
        """Return the name of an object, empty when it has none."""
        entry = self._dictionary.get(index, subindex) if self._dictionary else None
        return entry.name if entry else _standard_name(index)

    def title(self, index: int, subindex: int) -> str:
        """Return address and name, e.g. ``0x6041:00 Statusword``."""
        return f'{object_address(index, subindex)} {self.name(index, subindex)}'.rstrip()

    def data_type(self, index: int, subindex: int) -> DataType | None:
        """Return the type of an object, None when it is unknown."""
        entry = self._dictionary.get(index, subindex) if self._dictionary else None
        return entry.data_type if entry else None


def _standard_name(index: int) -> str:
    if pdo := pdo_object(index):
        what = 'mapping' if pdo.is_mapping else 'communication'
        return f'{pdo.direction.upper()}{pdo.number} {what}'
    return _STANDARD_NAMES.get(index, '')
