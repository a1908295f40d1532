# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A scenario: faults of simulated devices at certain times and after certain events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from arm_canopen import DriveState
from arm_canopen.standard import NmtState

from ..device import Device
from ..fault import Fault, FaultInjection
from ..host import DeviceHost
from ..timed import NEVER

LOOK_PERIOD = 0.005  # [s] how often positions are compared while an event waits for one


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happens to a device; what is None does not matter.

    Attributes:
        node_id: The device.
        nmt: Its NMT state.
        drive: State of its drive.
        above: Actual position that its motor is beyond in [inc].
        below: Actual position that its motor is short of in [inc].
    """

    node_id: int
    nmt: NmtState | None = None
    drive: DriveState | None = None
    above: float | None = None
    below: float | None = None

    @property
    def needs_position(self) -> bool:
        """It is about a position, which changes without any notification."""
        return self.above is not None or self.below is not None

    def holds(self, device: Device, now: float) -> bool:
        """Return whether it is so at steady time ``now`` in [s]."""
        if self.nmt is not None and device.nmt_state is not self.nmt:
            return False
        if self.drive is None and not self.needs_position:
            return True
        drive = device.drive
        if drive is None or (self.drive is not None and drive.state is not self.drive):
            return False
        if not self.needs_position:
            return True
        drive.advance(now)
        above, below = self.above, self.below
        return (above is None or drive.position > above) and (
            below is None or drive.position < below
        )


@dataclass(frozen=True, slots=True)
class Step:
    """One thing that a scenario does.

    Attributes:
        node_ids: The devices that it concerns.
        injection: The fault that begins, None when one ends.
        ends: The fault that ends, None for all; of meaning without an injection only.
        after: Time since the start, or since the event, in [s].
        event: What it waits for, None for the start.
    """

    node_ids: tuple[int, ...]
    injection: FaultInjection | None = None
    ends: Fault | None = None
    after: float = 0.0
    event: Event | None = None

    def __str__(self) -> str:
        """Return it in words."""
        devices = ', '.join(str(node_id) for node_id in self.node_ids)
        if self.injection is not None:
            return f'device {devices}: {self.injection}'
        what = self.ends.label if self.ends is not None else 'all faults'
        return f'device {devices}: {what} ended'


class ScenarioPlayer:
    """Plays the steps of a scenario on the devices of a host, each once.

    Attributes:
        deadline: Steady time in [s] at which it wants to be advanced; besides, the host advances
            it after each of its own steps, since an event may have come.
    """

    def __init__(
        self,
        host: DeviceHost,
        steps: Sequence[Step],
        report: Callable[[str], None] = lambda _text: None,
    ) -> None:
        """Prepare; time begins with the first :meth:`advance`.

        Args:
            host: The devices; all that the steps name are there.
            steps: What to do.
            report: Called with each step when it is done.
        """
        self.deadline = 0.0
        self._host = host
        self._report = report
        self._due: list[tuple[float, Step]] = []
        self._waiting = [step for step in steps if step.event is not None]
        self._first = [step for step in steps if step.event is None]
        self._started = False

    @property
    def finished(self) -> bool:
        """Every step is done."""
        return self._started and not self._due and not self._waiting

    def advance(self, now: float) -> None:
        """Do the steps whose time has come."""
        if not self._started:
            self._started = True
            self._due = [(now + step.after, step) for step in self._first]
        if self._waiting:
            self._look(now)
        while self._due and min(time for time, _ in self._due) <= now:
            item = min(self._due, key=lambda item: item[0])
            self._due.remove(item)
            self._do(item[1], now)
        self._schedule(now)

    def _look(self, now: float) -> None:
        """Find the events that have come."""
        still_waiting = []
        for step in self._waiting:
            event = step.event
            if event is not None and event.holds(self._host.device(event.node_id), now):
                self._due.append((now + step.after, step))
            else:
                still_waiting.append(step)
        self._waiting = still_waiting

    def _do(self, step: Step, now: float) -> None:
        for node_id in step.node_ids:
            faults = self._host.device(node_id).faults
            if step.injection is not None:
                faults.inject(step.injection, now)
            else:
                faults.end(now, step.ends)
        self._report(str(step))

    def _schedule(self, now: float) -> None:
        self.deadline = min((time for time, _ in self._due), default=NEVER)
        if any(step.event is not None and step.event.needs_position for step in self._waiting):
            self.deadline = min(self.deadline, now + LOOK_PERIOD)
