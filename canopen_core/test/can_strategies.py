# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Hypothesis strategies for CAN frames."""

from __future__ import annotations

from hypothesis import strategies as st

from canopen_core.can import EXTENDED_ID_MAX, Frame, STANDARD_ID_MAX

payloads = st.binary(max_size=8)


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    """Draw a data frame or a remote request, of 11 or 29 bits."""
    is_extended = draw(st.booleans())
    is_remote = draw(st.booleans())
    can_id = draw(st.integers(0, EXTENDED_ID_MAX if is_extended else STANDARD_ID_MAX))
    data = b'' if is_remote else draw(payloads)
    length = draw(st.integers(0, 8)) if is_remote else 0
    return Frame(can_id, data, 0.0, is_extended, is_remote, remote_length=length)
