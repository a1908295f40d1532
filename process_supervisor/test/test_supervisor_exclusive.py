# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One bring-up per bus."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from process_supervisor import exclusive, StartError

REMEDY = 'another bus with --can'


def test_the_second_on_a_bus_is_refused_with_the_first_ones_process(tmp_path: Path) -> None:
    """And told what to do; another bus is free; after the first has left, so is this one."""
    with exclusive('bus vcan0', tmp_path, REMEDY):
        for _ in range(2):  # being refused must not spoil what the next one reads
            words = rf'process {os.getpid()}.*bus vcan0.*--can'
            with pytest.raises(StartError, match=words), exclusive('bus vcan0', tmp_path, REMEDY):
                pass
        with exclusive('bus udp_multicast:239.1.2.3', tmp_path, REMEDY):
            pass
    with exclusive('bus vcan0', tmp_path, REMEDY):
        pass
