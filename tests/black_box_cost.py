# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a cycle feels of a black box that is written beside it, for the benchmarks of both."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import gc
from pathlib import Path
from tempfile import TemporaryDirectory
import time

from black_box import BlackBox, BlackBoxSettings, Contents

PERIOD = 0.01  # [s] of the cycle
QUIET = 3.0  # [s] that it is looked at before


def cycle_beside(contents: Contents, window: float) -> Iterator[str]:
    """Yield in words how late a cycle is without and beside the writing of a black box.

    Args:
        contents: Full of what happened.
        window: How much of it is written in [s].
    """
    gc.freeze()
    end = time.monotonic() + QUIET
    yield _in_words('cycle, nothing is written', _lateness(lambda: time.monotonic() > end))
    with TemporaryDirectory() as folder:
        box = BlackBox('bench', contents, BlackBoxSettings(Path(folder), window, after=0.0))
        box.start()
        box.fault('', 'a fault of the benchmark')
        begin = time.monotonic()
        yield _in_words('cycle, it is written', _lateness(lambda: box.last is not None))
        took = time.monotonic() - begin
        size = sum(path.stat().st_size for path in Path(folder).rglob('*.log'))
        yield f'written in {took:.1f} s, {size / 1e6:.1f} MB'
        box.close()


def _lateness(until: Callable[[], bool]) -> list[float]:
    """Run a cycle until something holds; return how late each one was in [ms], sorted."""
    late: list[float] = []
    deadline = time.monotonic() + PERIOD
    while not until():
        time.sleep(max(0.0, deadline - time.monotonic()))
        late.append((time.monotonic() - deadline) * 1e3)
        deadline += PERIOD * (1 + late[-1] // (PERIOD * 1e3))
    return sorted(late)


def _in_words(title: str, late: list[float]) -> str:
    last = len(late) - 1
    middle, high = late[last // 2], late[last * 99 // 100]
    return f'{title:25} late by {middle:.2f} / {high:.2f} ms (p50 / p99), {len(late)} cycles'
