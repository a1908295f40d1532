# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The end by signals, in virtual time."""

from __future__ import annotations

import signal

from node_runner import stop_on_signals
from node_runner.program import ENDING


def test_an_echo_of_a_ctrl_c_is_no_second_one() -> None:
    """Two signals a few milliseconds apart are one: drives come to rest and are disabled."""
    before = {number: signal.getsignal(number) for number in ENDING}
    times = iter([5.0, 5.003, 5.49])
    try:
        stop = stop_on_signals(clock=lambda: next(times))
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)  # as a second one it would end this process
        assert stop.is_set()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
