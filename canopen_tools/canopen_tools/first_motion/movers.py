# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What moves the drive: its own profile in mode 1, or set-points of each cycle in 7 and 8."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
import math
import threading
import time
from typing import TypeAlias

from arm_canopen import AxisFeedback, CanopenMaster, Refusal
from arm_canopen.config import DriveConfig
from canopen_core import CanopenError, DriveError, ObjectError, SdoError
from canopen_core.standard import AXIS_OFFSET, Index
from first_motion import MotionPlan

PERMIT = 0.25  # [s] for which one permission holds
RAMP_TIME = 0.25  # [s] from rest to full speed, and back
NEAR = 0.01  # share of a full step within which the target counts as reached


class SlowMotion:
    """A motion source that goes to a target only while its permission is young.

    Who permits is another thread. Should that stall, the joint stands within :data:`PERMIT` and
    :data:`RAMP_TIME`.
    """

    def __init__(self, axis: str, target: float, speed: float) -> None:
        """Begin at rest, towards a target in [rad] or [m], at most at speed [1/s]."""
        self.axes: Sequence[str] = (axis,)  # name of the drive
        self.problem = ''  # why the drive was taken away; empty while it follows
        self._target = target
        self._speed = speed
        self._position: float | None = None
        self._velocity = 0.0
        self._lock = threading.Lock()
        self._permitted_until = -math.inf

    def permit(self, until: float) -> None:
        """Allow motion until a steady time in [s]; one that has passed ends the motion."""
        with self._lock:
            self._permitted_until = until

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Answer the set-point of this cycle."""
        (axis,) = feedback
        if not axis.followable or self.problem:
            return (None,)
        if self._position is None:
            self._position = axis.setpoint
        with self._lock:
            permitted = now < self._permitted_until
        self._step(period, permitted=permitted)
        return (self._position,)

    def released(self, axis: str, refusal: Refusal) -> None:
        """The drive was taken away."""
        self.problem = self.problem or f'{axis} {refusal}'

    def _step(self, period: float, *, permitted: bool) -> None:
        """Advance by a cycle; the speed changes by its ramp, and ends at the target."""
        position = self._position or 0.0
        left = self._target - position
        change = self._speed / RAMP_TIME * period
        # the speed from which it can still stop at the target after this step
        fastest = min(
            self._speed, math.sqrt(change**2 + 2.0 * change * abs(left) / period) - change
        )
        wanted = math.copysign(fastest, left) if permitted else 0.0
        self._velocity += min(max(wanted - self._velocity, -change), change)
        step = self._velocity * period
        if abs(step) >= abs(left) or abs(left - step) < NEAR * self._speed * period:
            self._position, self._velocity = self._target, 0.0
        else:
            self._position = position + step


class ProfileMover:
    """Mode 1: the drive makes the way, with 0x6081 as its speed for that time."""

    def __init__(
        self, master: CanopenMaster, axis: DriveConfig, plan: MotionPlan, speed_dev: int
    ) -> None:
        """Write the speed, in velocity units of the drive.

        Raises:
            DriveError: The drive does not take the speed; nothing has moved.
        """
        self._drive = master.drive(axis.name)
        self._plan = plan
        self._index = Index.PROFILE_VELOCITY + AXIS_OFFSET * axis.channel
        self._pool = ThreadPoolExecutor(max_workers=2, thread_name_prefix='first_motion')
        self._orders: list[Future[str]] = []
        self._going: Future[str] | None = None
        self._halted = False
        self._failure = ''
        try:
            self._before = self._drive.sdo.read(self._index)
            self._drive.sdo.write(self._index, speed_dev)
        except (SdoError, ObjectError, DriveError) as error:
            raise DriveError(
                f'{axis.name}: its speed (0x{self._index:04X}) cannot be set, so the motion might '
                f'be fast: {error}'
            ) from error

    @property
    def busy(self) -> bool:
        """Whether an order has no answer yet."""
        for order in [order for order in self._orders if order.done()]:
            self._orders.remove(order)
            error = order.exception()
            ended_by_halt = self._halted and order is self._going
            if isinstance(error, CanopenError) and not ended_by_halt:
                self._failure = self._failure or str(error)
        return bool(self._orders)

    @property
    def problem(self) -> str:
        """Why an order failed."""
        return self._failure

    def go(self) -> None:
        """Order the target; the drive goes there by itself, and is halted when the key is up."""
        self._going = self._pool.submit(self._drive.set_target, self._plan.target)
        self._halted = False
        self._orders.append(self._going)

    def keep_going(self) -> None:
        """Do nothing; the drive goes on by itself."""

    def halt(self) -> None:
        """Order bit 8 of the controlword, also while a target is on its way."""
        self._halted = True
        self._orders.append(self._pool.submit(self._drive.halt))

    def close(self) -> None:
        """Write the speed of before."""
        self._pool.shutdown(wait=True)
        self._drive.sdo.write(self._index, self._before)


class CyclicMover:
    """Modes 7 and 8: the master makes the way, set-point by set-point."""

    def __init__(self, master: CanopenMaster, axis: DriveConfig, plan: MotionPlan) -> None:
        """Attach the source; it holds the joint where it is."""
        self._master = master
        self._source = SlowMotion(axis.name, plan.target, plan.speed)
        master.attach(self._source)

    @property
    def busy(self) -> bool:
        """Never: what is ordered takes effect in the next cycle."""
        return False

    @property
    def problem(self) -> str:
        """Why the drive was taken away."""
        return self._source.problem

    def go(self) -> None:
        """Permit the motion."""
        self.keep_going()

    def keep_going(self) -> None:
        """Renew the permission; to be called at least every 0.1 s."""
        self._source.permit(time.monotonic() + PERMIT)

    def halt(self) -> None:
        """Withdraw the permission."""
        self._source.permit(-math.inf)

    def close(self) -> None:
        """Detach the source."""
        self._master.detach(self._source)


Mover: TypeAlias = ProfileMover | CyclicMover
"""Moves an enabled drive to the target of a plan, and halts it; no call waits."""
