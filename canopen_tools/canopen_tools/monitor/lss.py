# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Layer setting services in words (CiA 305, 6)."""

from __future__ import annotations

from arm_canopen.standard.lss import LssMessage


def lss_text(data: bytes) -> str:
    """Return an LSS message in words, also one of a wrong length; its parameters stay bytes."""
    return LssMessage(data[0], data[1:]).text if data else 'empty message'
