# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Times in which this computer stood still: robots that are not computed fail for that alone.

A process of its own sleeps all the time, so that it waits for a processor as little as any. When
it wakes up late, simulated drives, master and test were not computed in time, either. A test that
failed in such a time says nothing, and is run again; the closing line counts it as a rerun.

A kernel that shares the processor among sessions can starve busy processes while one that sleeps
wakes up in time. So a test is run again, too, where simulated drives report that they got no
processor, or where its own process, which is client, driver or robot in many tests, waited for
one.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import suppress
import os
from pathlib import Path
import re
import subprocess
import sys
import time

import pytest

LATE = 0.1  # [s] reports of a robot count as missing after that; drives wait for 0.1 to 0.5 s
WAITED_MAX = 0.5  # [s] that the process of a test may wait for a processor, all in all
RERUNS = 2  # of a test, at most
STARVED = re.compile(r'got no processor for (\d+\.\d+) s')  # as simulated drives report it
WAKE = 0.05  # [s] until it has written of a stall that has ended
_WATCH = f"""
import select, sys, time
before = time.monotonic()
print(before, before, flush=True)
while not select.select([sys.stdin], [], [], 0.02)[0]:
    now = time.monotonic()
    if now - before > {LATE}:
        print(before, now, flush=True)
    before = now
"""


class StallWatch:
    """Notes stalls from its start on."""

    def __init__(self) -> None:
        command = [sys.executable, '-S', '-c', _WATCH]
        self._pipe, end = os.pipe()
        # the one that sleeps
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=end)
        os.close(end)
        self._lines = os.read(self._pipe, 1 << 20)  # it has begun
        os.set_blocking(self._pipe, False)

    def since(self, begin: float) -> list[float]:
        """Return the stalls since then.

        Args:
            begin: On the monotonic clock [s].

        Returns:
            How long each was [s].
        """
        time.sleep(WAKE)
        with suppress(BlockingIOError):
            self._lines += os.read(self._pipe, 1 << 20)
        pairs = (tuple(map(float, line.split())) for line in self._lines.splitlines())
        return [end - start for start, end in pairs if end > begin]

    def close(self) -> None:
        """End the process."""
        self.process.communicate()
        os.close(self._pipe)


WATCH = pytest.StashKey[StallWatch]()
BEGIN = pytest.StashKey[float]()  # of a test, on the monotonic clock [s]
WAITED = pytest.StashKey[float]()  # by this process for a processor, when a test began [s]
STARVED_IN = pytest.StashKey[bool]()  # drives or this process, when a test failed


def waited() -> float:
    """Return how long the threads of this process have waited for a processor so far [s].

    Source: kernel documentation, scheduler/sched-stats, /proc/<pid>/schedstat, the second number.
    """
    total = 0
    for thread in Path('/proc/self/task').iterdir():
        with suppress(OSError):  # it ended meanwhile
            total += int((thread / 'schedstat').read_text().split()[1])
    return total * 1e-9


def stalls_in(item: pytest.Item) -> list[float]:
    """Return how long this computer stood still in a test, each time [s]."""
    return item.config.stash[WATCH].since(item.stash.get(BEGIN, 0.0))


def pytest_sessionstart(session: pytest.Session) -> None:
    """Watch as long as tests run."""
    watch = session.config.stash[WATCH] = StallWatch()
    session.config.add_cleanup(watch.close)


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark each test; the condition is asked when it has failed."""

    def stood_still() -> bool:
        return item.stash.get(STARVED_IN, False) or bool(stalls_in(item))

    item.add_marker(pytest.mark.flaky(reruns=RERUNS, condition=stood_still))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Note when a test begins."""
    item.stash[BEGIN] = time.monotonic()
    item.stash[WAITED] = waited()
    item.stash[STARVED_IN] = False


@pytest.hookimpl(wrapper=True, tryfirst=True)  # around what adds the outputs of processes
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Report the stalls in a test that failed."""
    report = yield
    if report.failed:
        said = '\n'.join([report.longreprtext, *(text for _, text in report.sections)])
        starved = max(map(float, STARVED.findall(said)), default=0.0)
        own = waited() - item.stash.get(WAITED, 0.0)
        item.stash[STARVED_IN] |= starved > LATE or own > WAITED_MAX
        report.sections.append(('waited for a processor', f'{own:.2f} s'))
    if report.failed and (stalls := stalls_in(item)):
        durations = ', '.join(f'{stall:.2f} s' for stall in stalls)
        report.sections.append(('this computer stood still', durations))
    return report
