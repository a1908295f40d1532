# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing of an axis by a method of 0x6098, in mode 6."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from canopen_core import CodecError, DriveError, SdoError
from canopen_core.standard import DriveState, Index, OperationMode, Statusword

from ..master.scheduler import Promise
from .modes import Homing
from .steps import AxisSteps

EDGE_CYCLES = 3  # of SYNC in which a drive sees bit 4 cleared
HOMING_START = 0.1  # [s] after which a drive has overwritten the homing bits of the last time


class HomingProgress(Enum):
    """What happens at the moment."""

    ENABLING = 'enabling'
    SWITCHING = 'switching to mode 6'
    HOMING = 'homing'
    DONE = 'done'


async def home(
    steps: AxisSteps,
    method: int | None = None,
    notify: Callable[[HomingProgress], None] = lambda progress: None,
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
    axis = steps.axis
    homing = axis.modes[OperationMode.HOMING]
    supported = axis.view.parameters.supports(OperationMode.HOMING)
    if not (isinstance(homing, Homing) and supported):
        raise steps.refused('has no homing (mode 6 is not in 0x6502)')
    stored = await _stored_method(steps)
    method = _choice(steps, method, stored)
    try:
        if method != stored:
            await _choose(steps, method)
        notify(HomingProgress.SWITCHING)
        await steps.switch(homing)
        notify(HomingProgress.HOMING)
        await _run(steps, homing, f'the end of homing {method}')
    finally:
        if method != stored:
            _put_back(steps, stored)
    if axis.view.statusword & Statusword.HOMING_ERROR:
        raise steps.refused(f'failed to home by method {method}')
    notify(HomingProgress.DONE)
    return f'homed by method {method}'


async def _run(steps: AxisSteps, homing: Homing, what: str) -> None:
    """Set bit 4 until the drive shows that it has ended, well or not."""
    axis, view = steps.axis, steps.axis.view

    def is_cut() -> bool:  # it is not enabled any more: its homing bits mean nothing then
        view.observe()  # they come after the last cycle
        return view.state is not DriveState.OPERATION_ENABLED

    def is_over() -> bool:
        if not (view.fresh and view.statusword_came(since)):
            return False
        word = view.statusword
        done = Statusword.HOMING_ATTAINED
        if not steps.quirks.homed_without_arrival:
            done |= Statusword.TARGET_REACHED
        return bool(word & Statusword.HOMING_ERROR) or word & done == done

    # without a falling edge of bit 4 before, the drive would miss the start, and the bits of the
    # last homing would pass for those of this one
    await steps.pause(EDGE_CYCLES * axis.period)
    homing.started = True
    try:
        await steps.pause(HOMING_START)
        since = steps.now
        await steps.until(
            lambda: is_cut() or is_over(),
            axis.config.homing_timeout,
            what,
            'raise homing_timeout_seconds in bus.yml where the way takes longer',
        )
    finally:
        homing.started = False
    if is_cut():
        raise steps.refused('was cut off while it homed, and is not homed')


async def _stored_method(steps: AxisSteps) -> int:
    """Return what is in 0x6098 now, which the end of the last homing may just have changed."""
    axis = steps.axis
    try:
        stored = await axis.node.objects.read_object(axis.view.at(Index.HOMING_METHOD))
    except (SdoError, CodecError):
        return axis.view.parameters.homing_method
    return stored if isinstance(stored, int) else axis.view.parameters.homing_method


def _put_back(steps: AxisSteps, method: int) -> None:
    """Write a method without waiting, as there is no time to when the homing was cancelled."""
    axis = steps.axis

    def check(written: Promise[None]) -> None:
        if written.error is not None:
            axis.warn(f'the homing method {method} was not put back into 0x6098: {written.error}')

    axis.node.objects.write_object(axis.view.at(Index.HOMING_METHOD), 0, method).when_done(check)


def _choice(steps: AxisSteps, method: int | None, stored: int) -> int:
    """Return the method to home by."""
    if method is None and not stored:
        raise steps.refused('has no homing method (0x6098 is 0); name one')
    return stored if method is None else method


async def _choose(steps: AxisSteps, method: int) -> None:
    """Write a method; an answer that is late may still be that of a drive that has taken it."""
    axis = steps.axis
    try:
        await axis.node.objects.write_object(axis.view.at(Index.HOMING_METHOD), 0, method)
    except (SdoError, CodecError) as error:
        raise DriveError(f'{axis.name} does not take homing method {method}: {error}') from error
