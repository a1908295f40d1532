# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A CAN frame as a value."""

from __future__ import annotations

from typing import NamedTuple

STANDARD_ID_MAX = 0x7FF  # 11 bits
EXTENDED_ID_MAX = 0x1FFF_FFFF  # 29 bits
PAYLOAD_MAX = 8  # [byte]


class Frame(NamedTuple):
    """A classic CAN frame (ISO 11898-1). A tuple, because thousands are made each second."""

    can_id: int  # 11-bit or 29-bit identifier
    data: bytes = b''  # payload of 0 to 8 bytes
    # time of reception on the steady clock (``time.monotonic``) in [s]; 0 when not received
    timestamp: float = 0.0
    is_extended: bool = False  # the identifier has 29 bits
    is_remote: bool = False  # remote transmission request; the payload is empty
    # error frame of the controller; can_id and data are the kernel's error classes
    is_error: bool = False
    remote_length: int = 0  # length of the data that a remote request asks for in [byte]


def checked(frame: Frame) -> Frame:
    """Return the frame when it is a classic CAN frame.

    Raises:
        ValueError: The identifier is out of range or the payload too long.
    """
    if not 0 <= frame.can_id <= (EXTENDED_ID_MAX if frame.is_extended else STANDARD_ID_MAX):
        raise ValueError(f'CAN identifier 0x{frame.can_id:X} is out of range')
    if len(frame.data) > PAYLOAD_MAX:
        raise ValueError(f'a CAN frame carries at most {PAYLOAD_MAX} bytes, got {len(frame.data)}')
    if not 0 <= frame.remote_length <= (PAYLOAD_MAX if frame.is_remote else 0):
        raise ValueError(f'{frame.remote_length} bytes cannot be requested by such a frame')
    return frame
