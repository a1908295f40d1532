# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing as a sequence (CiA 402-2, clause 11)."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from canopen_core import CodecError, DriveError, SdoError
from canopen_core.standard import DriveState, Index, OperationMode, Statusword

from ..master.events import EventKind, Severity
from ..master.scheduler import Promise
from .drive import Drive
from .modes import Homing
from .sequences import DriveSequences

EDGE_CYCLES = 3  # of SYNC in which a drive sees bit 4 cleared
HOMING_START = 0.1  # [s] after which a drive has overwritten the homing bits of the last time


class HomingProgress(Enum):
    """What happens at the moment."""

    ENABLING = 'enabling'
    SWITCHING = 'switching to mode 6'
    HOMING = 'homing'
    DONE = 'done'


async def home(
    steps: DriveSequences,
    method: int | None = None,
    on_progress: Callable[[HomingProgress], None] | None = None,
) -> str:
    """Home a drive that is enabled, by a method of 0x6098 or, with None, the one in the drive.

    It is left in mode 6. Ended from outside, bit 4 is cleared, which interrupts the homing. A
    method that is given is for this time only: whatever happens, 0x6098 gets back the one that the
    drive had.

    Returns:
        What was done, in words.

    Raises:
        DriveError: The drive has no homing, refuses the method, or fails.
    """
    drive = steps.drive
    notify = on_progress or (lambda progress: None)
    homing = _homing_mode(steps)
    stored = await _stored_method(steps)
    method = await _choose(steps, method, stored)
    try:
        notify(HomingProgress.SWITCHING)
        await steps.switch(homing)
        notify(HomingProgress.HOMING)
        await _run(steps, homing, f'the end of homing {method}')
    finally:
        if method != stored:
            _put_back(steps, stored)
    if drive.objects.statusword & Statusword.HOMING_ERROR:
        raise steps.refused(f'failed to home by method {method}')
    notify(HomingProgress.DONE)
    return f'homed by method {method}'


def method_at_init(drive: Drive) -> int:
    """Return the homing method that bus.yml writes to 0x6098; 0 where it has no homing."""
    write = drive.node.config.write_of(drive.objects.at(Index.HOMING_METHOD), 0)
    return int.from_bytes(write.data, 'little', signed=True) if write is not None else 0


def _homing_mode(steps: DriveSequences) -> Homing:
    drive = steps.drive
    homing = drive.control.modes[OperationMode.HOMING]
    if not isinstance(homing, Homing):
        raise TypeError('mode 6 is no homing mode')
    if not drive.view.parameters.supports(OperationMode.HOMING):
        raise steps.refused('has no homing (mode 6 is not in 0x6502)')
    return homing


async def _run(steps: DriveSequences, homing: Homing, what: str) -> None:
    """Set bit 4 until the drive shows that it has ended, well or not."""
    # without a falling edge of bit 4 before, the drive would miss the start, and the bits of the
    # last homing would pass for those of this one
    await steps.pause(EDGE_CYCLES * steps.drive.period)
    homing.started = True
    try:
        await steps.pause(HOMING_START)
        since = steps.now
        await steps.until(
            lambda: _is_cut(steps) or _is_over(steps, since),
            steps.drive.config.homing_timeout,
            what,
            'raise homing_timeout_seconds in bus.yml where the way takes longer',
        )
    finally:
        homing.started = False
    steps.drive.view.observe()  # its bits came after the last cycle
    if _is_cut(steps):
        raise steps.refused('was cut off while it homed, and is not homed')


async def _stored_method(steps: DriveSequences) -> int:
    """Return what is in 0x6098 now, which the end of the last homing may just have changed."""
    drive = steps.drive
    try:
        stored = await drive.node.objects.read_object(drive.objects.at(Index.HOMING_METHOD))
    except (SdoError, CodecError):
        return drive.view.parameters.homing_method
    return stored if isinstance(stored, int) else drive.view.parameters.homing_method


def _put_back(steps: DriveSequences, method: int) -> None:
    """Write a method without waiting, as there is no time to when the homing was cancelled."""
    drive = steps.drive

    def look(written: Promise[None]) -> None:
        if written.error is not None:
            text = f'the homing method {method} was not put back into 0x6098: {written.error}'
            drive.node.report(EventKind.DRIVE, Severity.WARNING, text)

    drive.node.objects.write_object(drive.objects.at(Index.HOMING_METHOD), 0, method).when_done(
        look
    )


async def _choose(steps: DriveSequences, method: int | None, stored: int) -> int:
    drive = steps.drive
    if method is None:
        if not stored:
            raise steps.refused('has no homing method (0x6098 is 0); name one')
        return stored
    if method == stored:
        return method
    try:
        await drive.node.objects.write_object(drive.objects.at(Index.HOMING_METHOD), 0, method)
    except (SdoError, CodecError) as error:
        raise DriveError(f'{drive.name} does not take homing method {method}: {error}') from error
    return method


def _is_cut(steps: DriveSequences) -> bool:
    """Whether it is not enabled any more: its homing bits mean nothing then."""
    return steps.drive.objects.state is not DriveState.OPERATION_ENABLED


def _is_over(steps: DriveSequences, since: float) -> bool:
    """Whether bits that came since a time in [s] show that it has ended."""
    objects = steps.drive.objects  # the view of the last cycle is older than its bits
    if not (objects.fresh(steps.now) and objects.statusword_came(since)):
        return False
    word = objects.statusword
    if word & Statusword.HOMING_ERROR:
        return True
    done = Statusword.HOMING_ATTAINED
    if not steps.quirks.homed_without_arrival:
        done |= Statusword.TARGET_REACHED
    return word & done == done
