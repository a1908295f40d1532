# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A CAN frame as a value."""

from __future__ import annotations

from typing import NamedTuple

STANDARD_ID_MAX = 0x7FF  # 11 bits
EXTENDED_ID_MAX = 0x1FFF_FFFF  # 29 bits
PAYLOAD_MAX = 8  # [byte]


class Frame(NamedTuple):
    """A classic CAN frame (ISO 11898-1). A tuple, because thousands are made each second.

    Attributes:
        can_id: 11-bit or 29-bit identifier.
        data: Payload of 0 to 8 bytes.
        timestamp: Time of reception on the steady clock (``time.monotonic``) in [s]; 0 when not
            received.
        is_extended: The identifier has 29 bits.
        is_remote: Remote transmission request; the payload is empty.
        is_error: Error frame of the controller; can_id and data are the kernel's error classes.
    """

    can_id: int
    data: bytes = b''
    timestamp: float = 0.0
    is_extended: bool = False
    is_remote: bool = False
    is_error: bool = False
