# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lifecycle of managed nodes whose transitions take seconds and many SYNC cycles.

States, transitions and their numbers are those of lifecycle_msgs (ROS 2 design, "Managed nodes").
rclpy's own lifecycle node runs a transition inside a service callback, which would have to wait
for a drive to brake; here a transition is a coroutine of the network.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeAlias

from canopen_core import CanopenError, LifecycleError

from .scheduler import Promise, Scheduler


class LifecycleState(IntEnum):
    """States of lifecycle_msgs/State."""

    UNKNOWN = 0
    UNCONFIGURED = 1
    INACTIVE = 2
    ACTIVE = 3
    FINALIZED = 4
    CONFIGURING = 10
    CLEANING_UP = 11
    SHUTTING_DOWN = 12
    ACTIVATING = 13
    DEACTIVATING = 14

    @property
    def label(self) -> str:
        """Label in lifecycle_msgs/State."""
        return self.name.lower().replace('_', '')


class Verb(IntEnum):
    """Kind of a transition; its id for success is 10 times the value, for failure 1 more."""

    CONFIGURE = 1
    CLEANUP = 2
    ACTIVATE = 3
    DEACTIVATE = 4
    SHUTDOWN = 5

    @property
    def label(self) -> str:
        """Label in lifecycle_msgs/Transition."""
        return self.name.lower()


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition that a client may request."""

    number: int  # its id in lifecycle_msgs/Transition
    verb: Verb  # kind of transition
    start: LifecycleState  # state before it
    through: LifecycleState  # state while it runs
    success: LifecycleState  # state after it
    failure: LifecycleState  # state after a failure


_S = LifecycleState
TRANSITIONS: tuple[Transition, ...] = (
    Transition(1, Verb.CONFIGURE, _S.UNCONFIGURED, _S.CONFIGURING, _S.INACTIVE, _S.UNCONFIGURED),
    Transition(2, Verb.CLEANUP, _S.INACTIVE, _S.CLEANING_UP, _S.UNCONFIGURED, _S.INACTIVE),
    Transition(3, Verb.ACTIVATE, _S.INACTIVE, _S.ACTIVATING, _S.ACTIVE, _S.INACTIVE),
    Transition(4, Verb.DEACTIVATE, _S.ACTIVE, _S.DEACTIVATING, _S.INACTIVE, _S.ACTIVE),
    Transition(5, Verb.SHUTDOWN, _S.UNCONFIGURED, _S.SHUTTING_DOWN, _S.FINALIZED, _S.FINALIZED),
    Transition(6, Verb.SHUTDOWN, _S.INACTIVE, _S.SHUTTING_DOWN, _S.FINALIZED, _S.FINALIZED),
    Transition(7, Verb.SHUTDOWN, _S.ACTIVE, _S.SHUTTING_DOWN, _S.FINALIZED, _S.FINALIZED),
)

WAY_DOWN = ((_S.ACTIVE, Verb.DEACTIVATE), (_S.INACTIVE, Verb.CLEANUP))

MANAGER = 'lifecycle_manager'  # name of the node that starts and stops the others
Work: TypeAlias = Callable[[Verb], Coroutine[Promise[Any], None, None]]


class Managed:
    """One managed entity: its state, and the work to do in its transitions."""

    def __init__(self, name: str, work: Work) -> None:
        """A transition fails if ``work`` raises a CanopenError."""
        self.name = name  # its name, for messages
        self.state = LifecycleState.UNCONFIGURED  # its state
        # called before and after a transition, with the transition, the previous state, the new
        # state, and whether the transition has ended
        self.on_change: Callable[[Transition, LifecycleState, LifecycleState, bool], None] = (
            lambda transition, before, after, ended: None
        )
        self._work = work

    @property
    def possible(self) -> tuple[Transition, ...]:
        """Transitions available in the current state."""
        return tuple(entry for entry in TRANSITIONS if entry.start is self.state)

    def find(self, number: int, label: str = '') -> Transition:
        """Return a transition by label, or by number when there is no label.

        Raises:
            LifecycleError: It is unknown or not possible now; the message lists those that are.
        """
        for entry in self.possible:
            if (entry.verb.label == label) if label else (entry.number == number):
                return entry
        offered = ', '.join(f'{entry.verb.label} ({entry.number})' for entry in self.possible)
        wanted = repr(label) if label else str(number)
        raise LifecycleError(
            f'{self.name} is {self.state.label}: transition {wanted} is not possible; '
            f'possible: {offered or "none"}'
        )

    def require_active(self) -> None:
        """Raise a LifecycleError while it is not active."""
        if self.state is not LifecycleState.ACTIVE:
            raise LifecycleError(
                f'{self.name} is {self.state.label}, not active; activate it, or all with: '
                f'ros2 lifecycle set /{MANAGER} configure, then activate'
            )

    async def change(self, transition: Transition) -> None:
        """Run a transition to its end.

        Raises:
            LifecycleError: It is not possible now.
            CanopenError: It failed; the state is then ``failure`` of the transition.
        """
        if transition.start is not self.state:
            self.find(transition.number)
        self._enter(transition, transition.through, ended=False)
        try:
            await self._work(transition.verb)
        except BaseException:
            self._enter(transition, transition.failure, ended=True)
            raise
        self._enter(transition, transition.success, ended=True)

    async def go(self, *verbs: Verb) -> None:
        """Run transitions in sequence, skipping those whose final state is already reached."""
        for verb in verbs:
            if not any(e.verb is verb and e.success is self.state for e in TRANSITIONS):
                await self.change(self.find(0, verb.label))

    def _enter(self, transition: Transition, state: LifecycleState, *, ended: bool) -> None:
        before, self.state = self.state, state
        self.on_change(transition, before, state, ended)


class Supervisor:
    """Starts and stops a master and its devices in order, like ros2_canopen's manager.

    The devices change state concurrently. If one cannot be activated, the others are stopped
    again, so that a partly started robot accepts no commands.
    """

    def __init__(self, master: Managed, devices: Sequence[Managed], scheduler: Scheduler) -> None:
        self._master = master
        self._devices = devices
        self._scheduler = scheduler

    async def work(self, verb: Verb) -> None:
        """Do the work of a transition of the manager."""
        if verb is Verb.ACTIVATE:
            await self._up()
        elif verb in (Verb.DEACTIVATE, Verb.SHUTDOWN):
            await self._down()

    async def _up(self) -> None:
        await self._master.go(Verb.CONFIGURE, Verb.ACTIVATE)
        try:
            await self._all(self._devices, Verb.CONFIGURE, Verb.ACTIVATE)
        except CanopenError:
            await self._down()
            raise

    async def _down(self) -> None:
        for entities in (self._devices, (self._master,)):
            for state, verb in WAY_DOWN:
                await self._all([each for each in entities if each.state is state], verb)

    async def _all(self, entities: Sequence[Managed], *verbs: Verb) -> None:
        ends = [self._scheduler.spawn(each.go(*verbs)) for each in entities]
        await self._scheduler.gather(ends)
