# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who a device is, as 0x1000 and 0x1018 tell."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Identity:
    """What a device says of itself in 0x1000 and 0x1018; 0 is not checked."""

    device_type: int = 0
    vendor_id: int = 0
    product_code: int = 0
    revision_number: int = 0
    serial_number: int = 0


ANY_DEVICE = Identity()
