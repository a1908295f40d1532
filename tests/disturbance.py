# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Disturbances at random moments: drawing them, and the run that does them to a robot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass, field
from enum import Enum
import itertools
import os
import random
import subprocess
import sys
import time
from typing import Protocol

STOPPED = 2.0
"""How long a process is held by SIGSTOP in [s]."""
BAD_LINE = (0.5, 2.0)
"""Least and greatest time in [s] for which a line is bad, or the computer busy."""


class Disturbance(Enum):
    """What may happen to a robot in motion."""

    KILL = 'SIGKILL'
    STOP = 'SIGSTOP for 2 s'
    LOSS = 'frames lost'
    DELAY = 'frames late'
    DOUBLING = 'frames doubled'
    NOISE = 'serial noise'
    FULL_CPU = 'full CPU'


ON_PROCESSES = (Disturbance.KILL, Disturbance.STOP)


@dataclass(frozen=True)
class Event:
    """One disturbance."""

    kind: Disturbance  # what happens
    process: str  # name of the process that it happens to; empty for the line and the computer
    delay: float  # time in [s] from the start of the motion
    duration: float  # how long it lasts in [s]
    severity: float  # 0 to 1, for kinds that have degrees

    def __str__(self) -> str:
        """Say it in words."""
        return f'{self.process} {self.kind.value}'.strip()


@dataclass
class Report:
    """What a chaos run has found."""

    # disturbances so far, counted by what they were
    events: Counter[str] = field(default_factory=Counter)
    outcomes: Counter[str] = field(default_factory=Counter)  # how the motions ended, counted
    # what should not have happened, with the event it came after
    violations: list[str] = field(default_factory=list)


class Victim(Protocol):
    """A robot in motion."""

    @property
    def kinds(self) -> Sequence[Disturbance]:
        """What may happen to it."""

    @property
    def processes(self) -> Sequence[str]:
        """Names of those that may be killed and stopped."""

    def round(self, event: Event) -> str:
        """Move, be disturbed, come to rest, recover and move again.

        Returns:
            How the disturbed motion ended.

        Raises:
            AssertionError: It did not end or recover as documented.
        """

    def violations(self) -> list[str]:
        """Return what was against a law since the last call."""


def draw(victim: Victim, seed: int) -> Iterator[Event]:
    """Draw disturbances without end: each comes once before any comes again."""
    chance = random.Random(seed)
    deck = [
        (kind, process)
        for kind in victim.kinds
        for process in (victim.processes if kind in ON_PROCESSES else [''])
    ]
    while True:
        for kind, process in chance.sample(deck, len(deck)):
            duration = STOPPED if kind is Disturbance.STOP else chance.uniform(*BAD_LINE)
            yield Event(kind, process, chance.uniform(0.0, 1.0), duration, chance.random())


def run(victim: Victim, events: Iterable[Event]) -> Report:
    """Disturb a robot again and again, until it does not recover."""
    report = Report()
    for number, event in enumerate(events, 1):
        report.events[str(event)] += 1
        print(f'{number}: {event} after {event.delay:.2f} s', end=' ', flush=True)
        try:
            outcome = victim.round(event)
        except AssertionError as error:
            report.violations += [f'{number}, {event}: {v}' for v in (error, *victim.violations())]
            print(f'-> NOT RECOVERED: {error}', flush=True)
            break  # what follows would show the effects of this one
        print(f'-> {outcome}', flush=True)
        report.outcomes[outcome.partition(':')[0]] += 1
        report.violations += [f'{number}, {event}: {v}' for v in victim.violations()]
    return report


def until(end: float, events: Iterable[Event]) -> Iterator[Event]:
    """Pass events on until a time on the steady clock in [s]."""
    return itertools.takewhile(lambda _: time.monotonic() < end, events)


@contextmanager
def full_cpu() -> Iterator[None]:
    """Keep every core busy.

    Linux shares cores out by session (autogroup): in this one, it would be the test itself, with
    its serial cable, and others in the same terminal that are slow, instead of the robot's nodes.
    """
    loop = [sys.executable, '-c', 'while True: pass']
    with ExitStack() as stack:
        for _ in os.sched_getaffinity(0):
            busy = subprocess.Popen(loop, start_new_session=True)
            stack.callback(busy.wait)
            stack.callback(busy.kill)
        yield
