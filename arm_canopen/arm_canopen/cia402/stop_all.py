# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The stop of all axes, and what became of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

from canopen_core import CanopenError
from canopen_core.standard import DriveState

from ..master.scheduler import Promise, Scheduler
from .commands import AxisCommands
from .state import FAULTY, POWERED
from .stop_commands import BRAKED_TIMEOUT


@dataclass(frozen=True, slots=True)
class StopReport:
    """What became of the drives, by name."""

    stopped: tuple[str, ...]  # they moved, and stand now; still under power
    # they did not move visibly, and no target of before moves them any more
    standing: tuple[str, ...]
    unpowered: tuple[str, ...]  # they are not enabled, so nothing moves them
    failed: tuple[str, ...]  # why it is not known that they stand, each with its name

    def __str__(self) -> str:
        """Return it in a sentence, what is worst first."""
        named = (
            ('NOT known to stand', '; '.join(self.failed)),
            ('stopped', ', '.join(self.stopped)),
            ('stand', ', '.join(self.standing)),
            ('not enabled', ', '.join(self.unpowered)),
        )
        return '. '.join(f'{what}: {names}' for what, names in named if names) or 'no drives'


async def stop_all(commands: Sequence[AxisCommands], scheduler: Scheduler) -> StopReport:
    """Halt all drives, whatever moves them, and wait until each stands or has no power.

    One that does not come to rest keeps no other from it.
    """
    ends = [scheduler.spawn(_stopped(each, scheduler)) for each in commands]
    outcomes = [await end for end in ends]
    return StopReport(
        **{
            each.name: tuple(text for outcome, text in outcomes if outcome == each.name)
            for each in fields(StopReport)
        }
    )


async def _stopped(commands: AxisCommands, scheduler: Scheduler) -> tuple[str, str]:
    """Halt a drive; return its field of StopReport, and its name or why that is not known."""
    view = commands.axis.view
    moved = not view.stands
    try:
        try:
            await _to_its_end(commands.request('halt'), commands, scheduler)
        except CanopenError:
            if not (view.seen and view.state in FAULTY):
                raise
        await commands.stops.at_rest(BRAKED_TIMEOUT)
    except CanopenError as error:
        return 'failed', str(error)
    if view.state is DriveState.FAULT:  # its own reaction has ended its motion
        return 'unpowered', f'{view.name} (faulted)'
    if view.shown_state is DriveState.UNKNOWN:
        return 'failed', f'{view.name}: {commands.axis.describe()}'
    if view.state not in POWERED:
        return 'unpowered', view.name
    return 'stopped' if moved else 'standing', view.name


async def _to_its_end(halt: Promise[str], commands: AxisCommands, scheduler: Scheduler) -> None:
    """Wait for a stop, or for the one that has taken its place."""
    while True:
        try:
            await halt
        except CanopenError:  # noqa: PERF203  # the other one may be replaced, too
            await scheduler.timer(0.0)  # until the other one has begun
            other = commands.stopping
            if other is None or other is halt:
                raise
            halt = other
        else:
            return
