# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Stopping in order, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from signal import Signals

from hypothesis import given
from hypothesis import strategies as st

from process_supervisor.stopping import StopSequence

STEPS = ((Signals.SIGINT, 5.0), (Signals.SIGTERM, 2.0), (Signals.SIGKILL, 1.0))


@dataclass
class Play:
    """Plays processes that die of one of the signals, some time after it."""

    deaths: dict[str, tuple[Signals | None, float]]
    now: float = 0.0
    sent: list[tuple[float, str, Signals]] = field(default_factory=list)
    gone: dict[str, float] = field(default_factory=dict)
    dying: dict[str, float] = field(default_factory=dict)

    def send(self, name: str, signal: Signals) -> None:
        """Note a signal; the process may die of it."""
        self.sent.append((self.now, name, signal))
        deadly, delay = self.deaths[name]
        if signal is deadly:
            self.dying[name] = self.now + delay

    def run(self, orders: dict[str, int], steps: Sequence[tuple[Signals, float]]) -> StopSequence:
        """Play until all processes have ended."""
        sequence = StopSequence(self.send)
        for name, order in orders.items():
            sequence.add(name, order, steps)
        while not sequence.finished:
            for name in [name for name, when in self.dying.items() if when <= self.now]:
                del self.dying[name]
                self.gone[name] = self.now
                sequence.exited(name)
            sequence.advance(self.now)
            deadline = sequence.next_deadline()
            times = [*self.dying.values(), *([] if deadline is None else [deadline])]
            self.now = max(self.now, min(times, default=self.now))
        return sequence


names = st.sampled_from(['master', 'joint_states', 'slaves', 'viewer'])
deaths = st.tuples(
    st.sampled_from([Signals.SIGINT, Signals.SIGTERM, Signals.SIGKILL, None]),
    st.floats(0, 0.9),
)


@given(st.dictionaries(names, st.tuples(st.integers(0, 2), deaths), min_size=1))
def test_lower_orders_are_gone_before_higher_ones_are_signalled(
    plan: dict[str, tuple[int, tuple[Signals | None, float]]],
) -> None:
    """No process gets a signal while one of a lower order is there, and all are dealt with."""
    orders = {name: order for name, (order, _) in plan.items()}
    play = Play({name: death for name, (_, death) in plan.items()})
    sequence = play.run(orders, STEPS)
    stubborn = {name for name, (signal, _) in play.deaths.items() if signal is None}
    assert set(sequence.abandoned) == stubborn
    assert set(play.gone) == set(plan) - stubborn
    for when, name, _ in play.sent:
        earlier = [other for other, order in orders.items() if order < orders[name]]
        assert all(play.gone.get(other, 0.0) <= when for other in earlier)


@given(deaths)
def test_each_signal_is_sent_once_and_only_as_long_as_needed(
    death: tuple[Signals | None, float],
) -> None:
    """The ladder is climbed up to the signal that the process dies of, after the time-outs."""
    play = Play({'master': death})
    play.run({'master': 0}, STEPS)
    signals = [signal for _, _, signal in play.sent]
    last = [step[0] for step in STEPS].index(death[0]) if death[0] else len(STEPS) - 1
    assert signals == [signal for signal, _ in STEPS[: last + 1]]
    times = [when for when, _, _ in play.sent]
    assert times == [sum(timeout for _, timeout in STEPS[:i]) for i in range(last + 1)]
