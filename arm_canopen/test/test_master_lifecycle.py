# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Managed entities: every transition from every state, and a manager that leaves no half."""

from __future__ import annotations

from typing import Any

from lifecycle_msgs.msg import State
from lifecycle_msgs.msg import Transition as TransitionMessage
import pytest

from arm_canopen import CanopenError, LifecycleError, Scheduler
from arm_canopen.master.lifecycle import (
    LifecycleState,
    Managed,
    Supervisor,
    Transition,
    TRANSITIONS,
    Verb,
)

PRIMARY = [state for state in LifecycleState if 1 <= state <= 4]


class Recorder:
    """A managed entity whose work takes a second of virtual time, and may fail."""

    def __init__(self, scheduler: Scheduler, name: str = 'entity') -> None:
        self.fails: set[Verb] = set()
        self.done: list[Verb] = []
        self.events: list[tuple[str, str, bool]] = []
        self._scheduler = scheduler
        self.managed = Managed(name, self._work)
        self.managed.on_change = self._note

    async def _work(self, verb: Verb) -> None:
        await self._scheduler.timer(1.0)
        if verb in self.fails:
            raise CanopenError(f'{self.managed.name} cannot {verb.label}')
        self.done.append(verb)

    def _note(
        self, transition: Transition, before: LifecycleState, after: LifecycleState, ended: bool
    ) -> None:
        del transition
        self.events.append((before.label, after.label, ended))


def run(scheduler: Scheduler, coroutine: Any) -> Any:
    """Run a coroutine to its end in virtual time."""
    task = scheduler.spawn(coroutine)
    for _ in range(1000):
        if task.done:
            return task.result()
        scheduler.advance(scheduler.now + 0.1)
    raise AssertionError('it never ended')


def test_numbers_are_those_of_lifecycle_msgs() -> None:
    """States and transitions, so that the real ros2 lifecycle understands them."""
    for state in PRIMARY:
        assert getattr(State, f'PRIMARY_STATE_{state.name}') == state
    for name in ('CONFIGURING', 'ACTIVATING', 'DEACTIVATING', 'CLEANING_UP', 'SHUTTING_DOWN'):
        number = getattr(State, f'TRANSITION_STATE_{name.replace("_", "")}')
        assert number == LifecycleState[name]
    names = ['CONFIGURE', 'CLEANUP', 'ACTIVATE', 'DEACTIVATE']
    names += [f'{state}_SHUTDOWN' for state in ('UNCONFIGURED', 'INACTIVE', 'ACTIVE')]
    numbers = [getattr(TransitionMessage, f'TRANSITION_{name}') for name in names]
    assert [entry.number for entry in TRANSITIONS] == numbers
    for verb in Verb:
        success = getattr(TransitionMessage, f'TRANSITION_ON_{verb.name}_SUCCESS')
        assert success == 10 * verb


@pytest.mark.parametrize('transition', TRANSITIONS, ids=lambda t: f'{t.number}')
def test_each_transition_from_each_state(transition: Transition) -> None:
    """It runs from its start state, passes its transition state, and is refused elsewhere."""
    for state in LifecycleState:
        scheduler = Scheduler()
        entity = Recorder(scheduler)
        entity.managed.state = state
        if state is not transition.start:
            with pytest.raises(LifecycleError, match=f'is {state.label}: transition'):
                run(scheduler, entity.managed.change(transition))
            assert entity.managed.state is state
            continue
        run(scheduler, entity.managed.change(transition))
        assert entity.managed.state is transition.success
        assert entity.events == [
            (state.label, transition.through.label, False),
            (transition.through.label, transition.success.label, True),
        ]


@pytest.mark.parametrize('transition', TRANSITIONS, ids=lambda t: f'{t.number}')
def test_a_transition_that_fails_has_its_own_end(transition: Transition) -> None:
    """Back where it began, or finalized; the reason reaches the caller."""
    scheduler = Scheduler()
    entity = Recorder(scheduler)
    entity.fails = {transition.verb}
    entity.managed.state = transition.start
    with pytest.raises(CanopenError, match=f'cannot {transition.verb.label}'):
        run(scheduler, entity.managed.change(transition))
    assert entity.managed.state is transition.failure


def test_a_second_transition_is_refused_while_one_runs() -> None:
    """Nobody queues behind a drive that brakes."""
    scheduler = Scheduler()
    entity = Recorder(scheduler)
    first = scheduler.spawn(entity.managed.go(Verb.CONFIGURE))
    with pytest.raises(LifecycleError, match=r'is configuring.*possible: none'):
        entity.managed.find(0, 'configure')
    scheduler.advance(2.0)
    assert first.done
    assert entity.managed.state is LifecycleState.INACTIVE


def test_the_manager_brings_all_up_and_down_in_order() -> None:
    """The master first and last, the devices side by side; a failure leaves no half of them."""
    scheduler = Scheduler()
    master, *devices = everybody = [Recorder(scheduler, name) for name in ('master', *'abc')]
    supervisor = Supervisor(master.managed, [d.managed for d in devices], scheduler)
    manager = Managed('manager', supervisor.work)
    run(scheduler, manager.go(Verb.CONFIGURE, Verb.ACTIVATE))
    assert scheduler.now == pytest.approx(4.0, abs=0.3)  # not 2 s for each of four
    assert {entity.managed.state for entity in everybody} == {LifecycleState.ACTIVE}
    run(scheduler, manager.go(Verb.DEACTIVATE))
    assert {entity.managed.state for entity in everybody} == {LifecycleState.UNCONFIGURED}
    assert devices[0].done == [Verb.CONFIGURE, Verb.ACTIVATE, Verb.DEACTIVATE, Verb.CLEANUP]
    devices[1].fails = {Verb.ACTIVATE}
    with pytest.raises(CanopenError, match='b cannot activate'):
        run(scheduler, manager.go(Verb.ACTIVATE))
    assert manager.state is LifecycleState.INACTIVE
    assert {entity.managed.state for entity in everybody} == {LifecycleState.UNCONFIGURED}
    devices[1].fails = set()
    run(scheduler, manager.go(Verb.ACTIVATE))
    assert devices[1].managed.state is LifecycleState.ACTIVE
