# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The stop of a whole robot: all drives halted at once, and in words what became of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..exceptions import CanopenError
from ..master.scheduler import Promise, Scheduler
from .drive_commands import DriveCommands
from .drive_view import FAULTY, POWERED


@dataclass(frozen=True, slots=True)
class StopReport:
    """What became of the drives, by name.

    Attributes:
        stopped: They moved, and stand now; still enabled.
        standing: They did not move visibly, and no target of before moves them any more.
        unpowered: They are not enabled, so nothing moves them.
        failed: Why it is not known that they stand, each with its name.
    """

    stopped: tuple[str, ...]
    standing: tuple[str, ...]
    unpowered: tuple[str, ...]
    failed: tuple[str, ...]

    def __str__(self) -> str:
        """Return it in a sentence, what is worst first."""
        named = (
            ('NOT known to stand', '; '.join(self.failed)),
            ('stopped', ', '.join(self.stopped)),
            ('stand', ', '.join(self.standing)),
            ('not enabled', ', '.join(self.unpowered)),
        )
        return '. '.join(f'{what}: {names}' for what, names in named if names) or 'no drives'


async def stop_all(commands: Sequence[DriveCommands], scheduler: Scheduler) -> StopReport:
    """Halt all drives, whatever moves them, and wait until each stands.

    One that does not come to rest keeps no other from it.

    Args:
        commands: Those of the drives.
        scheduler: Time.
    """
    moving = {each.drive.name for each in commands if not each.drive.view.stands}
    halts = [each.request('halt') for each in commands]
    stopped: list[str] = []
    standing: list[str] = []
    unpowered: list[str] = []
    failed: list[str] = []
    for each, halt in zip(commands, halts, strict=True):
        view, name = each.drive.view, each.drive.name
        try:
            await _to_its_end(halt, each, scheduler)
        except CanopenError as error:
            if view.fresh and view.state in FAULTY:  # its own reaction has ended its motion
                unpowered.append(f'{name} (faulted)')
            else:
                failed.append(str(error))
        else:
            if view.state not in POWERED:
                unpowered.append(name)
            else:
                (stopped if name in moving else standing).append(name)
    return StopReport(tuple(stopped), tuple(standing), tuple(unpowered), tuple(failed))


async def _to_its_end(halt: Promise[str], commands: DriveCommands, scheduler: Scheduler) -> None:
    """Wait for a stop, or for the one that has taken its place.

    Raises:
        CanopenError: The drive does not come to rest, or nobody can know.
    """
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
