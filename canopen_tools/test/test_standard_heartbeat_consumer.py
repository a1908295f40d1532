# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An entry of 0x1016 means the same to master, check, export, monitor and simulated device."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.standard import ConsumerHeartbeatTime
from canopen_tools.monitor.value_text import value_text


@given(st.integers(1, 127), st.integers(1, 0xFFFF))
def test_what_is_written_is_read(node_id: int, time_ms: int) -> None:
    """Node id in bits 16 to 23, time in bits 0 to 15."""
    entry = ConsumerHeartbeatTime(node_id, time_ms)
    assert ConsumerHeartbeatTime.parse(entry.word) == entry
    assert entry.used
    assert value_text(0x1016, 1, entry.word).startswith(f'node {node_id}, {time_ms} ms')


@pytest.mark.parametrize('word', [0, 0x0001_0000, 0x0000_0064, 0x0080_0064, 0x00FF_0064])
def test_an_entry_that_is_not_used(word: int) -> None:
    """Time 0, node id 0 or above 127 (CiA 301, 7.5.2.17)."""
    assert not ConsumerHeartbeatTime.parse(word).used


def test_bit_23_belongs_to_the_node_id() -> None:
    """An entry for id 129, which there is not, is not that of node 1."""
    assert ConsumerHeartbeatTime.parse(0x0081_0064).node_id != 1
