# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the layer setting services: bytes by hand, and laws."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.can import Frame
from arm_canopen.standard import (
    BIT_RATES,
    decode_lss,
    fast_scan,
    FastScan,
    lss_bytes,
    lss_number,
    LSS_REQUEST,
    LssAddress,
    LssCommand,
    LssMessage,
)
from canopen_tools.monitor import FrameDescriber


@pytest.mark.parametrize(
    ('message', 'data'),
    [
        (lss_bytes(LssCommand.SWITCH_GLOBAL, 1), '04 01 00 00 00 00 00 00'),
        (lss_number(LssCommand.SELECT_VENDOR, 0x12345678), '40 78 56 34 12 00 00 00'),
        (lss_bytes(LssCommand.CONFIGURE_NODE_ID, 17), '11 11 00 00 00 00 00 00'),
        (lss_bytes(LssCommand.CONFIGURE_BIT_TIMING, 0, 2), '13 00 02 00 00 00 00 00'),
        (lss_bytes(LssCommand.STORE), '17 00 00 00 00 00 00 00'),
        (FastScan().message(), '51 00 00 00 00 80 00 00'),
        (FastScan(0xCAFE, 5, 3, 0).message(), '51 FE CA 00 00 05 03 00'),
    ],
)
def test_bytes_of_messages(message: LssMessage, data: str) -> None:
    """As CiA 305 draws them: specifier, parameters little-endian, padded to 8 bytes."""
    assert message.encode() == bytes.fromhex(data)


@given(st.binary(min_size=8, max_size=8))
def test_any_8_bytes_are_a_message(data: bytes) -> None:
    """Reading and writing are inverse; reserved specifiers are reported as such."""
    message = decode_lss(data)
    assert message is not None
    assert message.encode() == data
    assert (data[0] in set(LssCommand)) == ('unknown' not in message.text)


@given(st.binary().filter(lambda data: len(data) != 8))
def test_other_lengths_are_none(data: bytes) -> None:
    """A message has 8 bytes; the monitor has words for what is none."""
    assert decode_lss(data) is None
    assert FrameDescriber().describe(Frame(LSS_REQUEST, data)).text


@given(
    st.builds(
        FastScan,
        st.integers(0, 0xFFFF_FFFF),
        st.integers(0, 0xFF),
        st.integers(0, 0xFF),
        st.integers(0, 0xFF),
    )
)
def test_a_step_of_fast_scan_survives(step: FastScan) -> None:
    """What a master sends is what a device reads."""
    message = decode_lss(step.message().encode())
    assert message is not None
    assert fast_scan(message) == step


def test_tables_are_complete() -> None:
    """Every command has words; the standard table has no doubles."""
    assert len({command.text for command in LssCommand}) == len(LssCommand)
    assert set(BIT_RATES) == set(range(9))
    assert len(set(BIT_RATES.values())) == len(BIT_RATES)
    assert str(LssAddress(1, 2, 3, 0xCAFE)).endswith(' 0x0000CAFE')
