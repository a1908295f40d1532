# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which frames a filter shows."""

from __future__ import annotations

from can_sample_bus import BUS
import pytest

from arm_canopen.can import Frame
from canopen_tools.monitor import FrameDescriber, FrameFilter

FRAMES = {
    'nmt': Frame(0x000, b'\x01\x02'),
    'sync': Frame(0x080),
    'emcy': Frame(0x082, bytes(8)),
    'tpdo': Frame(0x182, bytes(3)),
    'sdo': Frame(0x602, bytes(8)),
    'heartbeat': Frame(0x702, b'\x05'),
    'other heartbeat': Frame(0x709, b'\x05'),
    'extended': Frame(0x0001_0182, is_extended=True),
}


@pytest.mark.parametrize(
    ('terms', 'shown'),
    [
        ([], set(FRAMES)),
        ([''], set(FRAMES)),
        (['sdo'], {'sdo'}),
        (['SDO', 'emcy'], {'sdo', 'emcy'}),
        (['sdo, emcy'], {'sdo', 'emcy'}),
        (['^sync,^heartbeat'], {'nmt', 'emcy', 'tpdo', 'sdo', 'extended'}),
        (['heartbeat', '^node:gripper'], {'heartbeat'}),
        (['node:panda_joint1'], {'nmt', 'emcy', 'tpdo', 'sdo', 'heartbeat'}),
        (['node:9'], {'other heartbeat'}),
        (['node:nobody'], set()),
        (['182'], {'tpdo'}),
        (['0x182'], {'tpdo'}),
        (['700:780'], {'heartbeat', 'other heartbeat'}),
        (['182:7FF'], {'tpdo', 'extended'}),
        (['10182'], {'extended'}),
    ],
)
def test_terms_choose_frames(terms: list[str], shown: set[str]) -> None:
    """Positive terms add up, negative ones take away, none shows all."""
    describer, chosen = FrameDescriber(BUS), FrameFilter(terms)
    seen = {
        name for name, frame in FRAMES.items() if chosen.shows(frame, describer.describe(frame))
    }
    assert seen == shown


@pytest.mark.parametrize('term', ['tpdos', '18x', '180:', ':7FF', '^', '^foo', '123456789'])
def test_a_wrong_term_lists_what_would_be_right(term: str) -> None:
    """A typing mistake is not silently a filter that shows nothing."""
    with pytest.raises(ValueError, match=r'unknown filter .*; choose one of nmt, .*180:780'):
        FrameFilter([term])
