# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Playing a log: in time, from the middle, again and again."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
import threading

import pytest

from black_box import LogPlayer, PlaybackError

PERIOD = 0.01  # [s] of the entries


class Recorded:
    """A replay that keeps what was played to it."""

    def __init__(self) -> None:
        # the entries, and when they happened by the log [s]
        self.entries: list[tuple[int, float]] = []
        self.now = 0.0  # time of the log [s]
        self.restarts = 0  # how often the log has begun again
        self.on_entry: Callable[[int], None] = lambda entry: None  # called with each entry

    def take(self, entry: int, now: float) -> None:
        """Record an entry; time never goes back."""
        self.advance(now)
        self.entries.append((entry, now))
        self.on_entry(entry)

    def advance(self, now: float) -> None:
        """Advance the time."""
        assert now >= self.now
        self.now = now

    def restart(self) -> None:
        """Begin again."""
        self.restarts += 1


def player(
    replay: Recorded, count: int, *, rate: float = 100.0, start: float = 0.0
) -> LogPlayer[int]:
    """Return a player of a log of some entries, which began long ago."""
    return LogPlayer(
        replay,
        lambda: ((1.7e9 + number * PERIOD, number) for number in range(count)),
        name='walk.log',
        rate=rate,
        start=start,
    )


def test_a_log_is_played_in_time_and_its_beginning_is_skipped() -> None:
    """What is before the start is taken at once; the rest needs the time that the rate makes."""
    replay = Recorded()
    playing = player(replay, 1000, start=4.0)
    sought: list[bool] = []
    replay.on_entry = lambda entry: sought.append(playing.seeking)
    ticks: list[float] = []
    playing.on_tick = lambda: ticks.append(replay.now)
    playing.play(threading.Event(), loop=False)
    assert sum(sought) == pytest.approx(400, abs=1)
    assert [entry for entry, _ in replay.entries] == list(range(1000))
    assert ticks[0] >= 3.9
    assert playing.steady(9.99) - playing.steady(4.0) == pytest.approx(0.0599)


def test_a_log_that_is_repeated_goes_on_in_time() -> None:
    """Each turn begins anew, a little after the last entry of the one before."""
    replay = Recorded()
    stop = threading.Event()
    replay.on_entry = lambda entry: stop.set() if len(replay.entries) == 25 else None
    player(replay, 10).play(stop, loop=True)
    assert [entry for entry, _ in replay.entries[:25]] == [*range(10)] * 2 + [*range(5)]
    assert replay.restarts == 2
    times = [now for _, now in replay.entries]
    steps = [after - before for before, after in pairwise(times)]
    assert steps[8:11] == pytest.approx([PERIOD, 0.1, PERIOD], abs=1e-6)


@pytest.mark.parametrize(
    ('count', 'start', 'reason'),
    [(0, 0.0, '^walk.log: .* is empty'), (11, 9.0, '^walk.log: .* 0.1 s')],
)
def test_a_log_with_nothing_to_play_is_refused(count: int, start: float, reason: str) -> None:
    """An empty file, or a start behind its end."""
    with pytest.raises(PlaybackError, match=reason):
        player(Recorded(), count, start=start).play(threading.Event(), loop=False)
