# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Hypothesis strategies for frames of both protocols."""

from __future__ import annotations

from hypothesis import strategies as st

from quad_hardware.protocol import Frame, HOST_KINDS, Protocol, ROBOT_KINDS, V1, V2

PROTOCOLS = st.sampled_from([V1, V2])
SIDES = st.sampled_from([HOST_KINDS, ROBOT_KINDS])


@st.composite
def frames(draw: st.DrawFn, protocol: Protocol) -> Frame:
    """Any frame of a protocol, also with an address that its table lacks."""
    address = draw(st.integers(0, 256**protocol.address_size - 1))
    payload = draw(st.binary(max_size=protocol.max_length - protocol.overhead))
    return Frame(draw(st.sampled_from(sorted(protocol.kinds))), address, payload)


@st.composite
def cut(draw: st.DrawFn, data: bytes) -> list[bytes]:
    """Data in pieces, cut anywhere."""
    at = sorted(draw(st.lists(st.integers(0, len(data)), max_size=12)))
    return [data[a:b] for a, b in zip([0, *at], [*at, len(data)], strict=True)]
