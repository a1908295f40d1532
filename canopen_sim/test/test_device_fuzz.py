# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Random frames: the device must live, and must not move unasked."""

from __future__ import annotations

import random

from device_rig import NODE_ID, Rig
import pytest

from canopen_core.can import Frame
from canopen_core.standard import NmtState

pytestmark = pytest.mark.slow

FRAMES = 20_000
OWN_IDS = [0x000, 0x080, 0x701, *(0x080 + 0x80 * k + NODE_ID for k in range(14))]


def random_frame(source: random.Random) -> Frame:
    """Return a frame that hits the device's own identifiers most of the time."""
    can_id = source.choice(OWN_IDS) if source.random() < 0.9 else source.randrange(0x800)
    size = 8 if source.random() < 0.7 else source.randrange(9)
    data = source.randbytes(size)
    if can_id == 0:
        data = bytes((source.choice((1, 2, 0x80, 0x81, 0x82, 7)), source.choice((0, NODE_ID, 9))))
    kind = source.random()
    return Frame(
        can_id,
        data,
        is_extended=kind < 0.01,
        is_remote=0.01 < kind < 0.03,
        is_error=0.03 < kind < 0.04,
    )


def likely_sdo(source: random.Random) -> Frame:
    """Return an SDO request to an object that exists, with any command byte and value."""
    index = source.choice((0x1400, 0x1600, 0x1800, 0x1A00, 0x1014, 0x1016, 0x1017, 0x1005, 0x6040,
                           0x6060, 0x605A, 0x607A, 0x607D, 0x6081, 0x6083, 0x6084, 0x6098, 0x60C1,
                           0x60C2, 0x60FF, 0x607F, 0x6065, 0x6085))  # fmt: skip
    command = source.choice(
        (0x2F, 0x2B, 0x27, 0x23, 0x22, 0x21, 0x40, 0x60, 0x70, 0x00, 0x01, 0xC0)
    )
    data = bytes((command,)) + (index + source.randrange(4)).to_bytes(2, 'little')
    data += bytes((source.randrange(4),)) + source.randbytes(4)
    return Frame(0x600 + NODE_ID, data)


def test_any_frames_at_any_time() -> None:
    """Random frames at random times: nothing raises, and afterwards the device works."""
    source = random.Random(1)
    rig = Rig()
    for _ in range(FRAMES):
        frame = likely_sdo(source) if source.random() < 0.4 else random_frame(source)
        rig.device.receive(frame, rig.now)
        rig.run(source.choice((0.0, 0.0, 0.0001, 0.003, 0.02)))
        rig.sent.clear()
    rig.send(0, b'\x81\x00')
    assert rig.nmt_state is NmtState.PRE_OPERATIONAL
    assert rig.read(0x1000) == b'\x92\x01\x02\x00'
    rig.enable(1)
    start = rig.get(0x6064)
    rig.put(0x607A, start + 100)
    rig.command(0x1F)
    rig.run(2.0)
    assert rig.get(0x6064) == start + 100


def test_noise_never_moves_a_disabled_drive() -> None:
    """Frames with any data on every identifier but the controlword's move nothing."""
    source = random.Random(7)
    rig = Rig()
    for _ in range(FRAMES // 2):
        can_id = source.randrange(0x800)
        if can_id in (0x000, 0x600 + NODE_ID) or 0x200 <= can_id & 0x7F0 < 0x580:
            continue
        rig.device.receive(Frame(can_id, source.randbytes(source.randrange(9))), rig.now)
        rig.run(0.001)
        rig.sent.clear()
    assert rig.get(0x6064) == 0
    assert rig.get(0x6040) == 0
