# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who a device is by 0x1000 and 0x1018 (CiA 301, 7.5.2.1 and 7.5.2.19)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...standard.objects import Index


@dataclass(frozen=True, slots=True)
class Identity:
    """The identity of a device, 0x1000 and 0x1018; 0 is not checked."""

    device_type: int = 0
    vendor_id: int = 0
    product_code: int = 0
    revision_number: int = 0
    serial_number: int = 0

    @property
    def objects(self) -> Iterator[tuple[str, int, int, int]]:
        """Attribute, index, sub-index and value of what is checked."""
        for attribute, index, subindex in IDENTITY_OBJECTS:
            value = getattr(self, attribute)
            if value:
                yield attribute, index, subindex, value


IDENTITY_OBJECTS = (
    ('device_type', Index.DEVICE_TYPE, 0),
    ('vendor_id', Index.IDENTITY, 1),
    ('product_code', Index.IDENTITY, 2),
    ('revision_number', Index.IDENTITY, 3),
    ('serial_number', Index.IDENTITY, 4),
)


ANY_DEVICE = Identity()
