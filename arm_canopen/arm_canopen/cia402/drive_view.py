# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state of one axis of a CiA 402 drive, as its TPDOs and SDOs show it, and how old that is."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math

from canopen_core import CodecError, DriveError, SdoError
from canopen_core.standard import (
    drive_state,
    DriveState,
    error_code_text,
    Index,
    mode_title,
    statusword_text,
)

from ..config.model.drive import DriveConfig
from ..master.remote_node import RemoteNode
from ..master.scheduler import Scheduler
from .drive_objects import DriveObjects
from .modes import Actual
from .parameters import DriveParameters, ParameterCache
from .units import clamp, INT16_MAX, INT32_MAX, Units

FAULTY = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
EMCY_AGE_MAX = 0.2  # [s] of an EMCY that came with a fault
POWERED = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
"""States in which it may move under power, and falls or coasts when that goes."""
LOOK_PERIOD = 0.02  # [s] between two readings by SDO of what TPDOs do not show
LOOK_AGE_MAX = 0.5  # [s] of such a reading
REST_SHARE = 0.002  # share of the profile velocity below which an axis counts as standing
REST_TIME = 0.004  # [s] within which one that counts as standing could stop
NOISE_DEV = 2  # units of 0x606C, and increments within the window, that noise of sensors may be


WINDOW = 0.1  # [s] of positions that the estimate looks back on
FLICKER_INC = 1  # [inc] by which an encoder at rest may change


class VelocityEstimate:
    """The rate of 0x6064 over a short window."""

    def __init__(self, poll_period: float = 0.0, *, on_change: bool = False) -> None:
        """Estimate over a window of its own length.

        Args:
            poll_period: Of positions that are read by SDO in [s]; 0 where a PDO carries them.
            on_change: They come when they change, so that one which has not come is still true.
        """
        self.window = max(WINDOW, 2.5 * poll_period)  # its length in [s]
        self._on_change = on_change
        self._positions: deque[tuple[float, float]] = deque()

    def note(self, now: float, position_inc: float, stamp: float | None = None) -> None:
        """Add a position in [inc] at a steady time in [s].

        Where they come on change, one whose ``stamp`` is as old as the window is still true.
        """
        positions = self._positions
        if stamp is not None:
            if not positions or stamp > positions[-1][0]:
                now = stamp
            elif not self._on_change or now - positions[-1][0] <= self.window:
                return
        positions.append((now, position_inc))
        while len(positions) > 2 and positions[1][0] <= now - self.window:
            positions.popleft()

    def clear(self) -> None:
        """Forget all positions."""
        self._positions.clear()

    @property
    def known(self) -> bool:
        """Whether the positions span enough time to distinguish motion from rest."""
        if len(self._positions) < 2:
            return False
        return self._positions[-1][0] - self._positions[0][0] >= 0.5 * self.window

    @property
    def rate(self) -> float:
        """Rate in [inc/s]; 0 while there is nothing to compare."""
        if len(self._positions) < 2:
            return 0.0
        (begin, first), (end, last) = self._positions[0], self._positions[-1]
        if end <= begin or abs(last - first) <= FLICKER_INC:
            return 0.0
        return (last - first) / (end - begin)


class DriveView:
    """What the master knows of an axis; everybody who needs its state reads it here.

    Attributes:
        node: The device.
        config: Settings of the axis.
        name: Its name: that of the device, of its channel for one with several axes.
        units: Its units.
        objects: Its objects in the process image.
        state: State shown in the last cycle.
        statusword: 0x6041 as it was then.
        fresh: Its TPDOs showed its state in the last cycle, young enough to act on.
        observed: Actual position as it was then, in user units; NaN before the first.
        observed_inc: The same in [inc].
        error: 0x603F in words when it was faulted last, else empty.
        cache: Reads its parameters.
    """

    def __init__(
        self,
        node: RemoteNode,
        scheduler: Scheduler,
        config: DriveConfig,
        warn: Callable[[str], None],
    ) -> None:
        self.node = node
        self.config = config
        self.name = config.name or node.name
        self.units = Units(config)
        self.objects = DriveObjects(node, config.channel)
        self.state = DriveState.UNKNOWN
        self.statusword = 0
        self.fresh = False
        self.error = ''
        self.observed = self.observed_inc = math.nan
        self._looked: tuple[int, float] | None = None  # statusword and position, by SDO
        self._looked_at = -math.inf
        self._scheduler = scheduler
        self.cache = ParameterCache(node, config, self.units, scheduler, warn)
        self._estimate = VelocityEstimate(
            node.config.poll_period if self.objects.position_is_polled else 0.0,
            on_change=self.objects.position_comes_on_change,
        )

    @property
    def parameters(self) -> DriveParameters:
        """What it reported about itself."""
        return self.cache.parameters

    @property
    def seen(self) -> bool:
        """Whether its state is young enough to judge a stop by, from TPDOs or read by SDO."""
        return self.fresh or self._looks

    @property
    def _looks(self) -> bool:
        """Whether :meth:`look` has shown the state that TPDOs do not show."""
        if self.fresh or self._looked is None:
            return False
        return self._scheduler.now - self._looked_at <= LOOK_AGE_MAX

    @property
    def age(self) -> float:
        """Age of the oldest value of its state in [s]; infinite while there is none."""
        if self.state is DriveState.UNKNOWN:
            return math.inf
        return self._scheduler.now - self.objects.timestamp

    @property
    def position_age(self) -> float:
        """Age of 0x6064 in [s]."""
        return self._scheduler.now - self.objects.position_timestamp

    @property
    def position(self) -> float:
        """Actual position in user units: the last one of a lost drive, NaN before the first."""
        position_inc = None if self._looks else self.objects.position
        if position_inc is None:
            return self.observed
        return self.units.position.from_device(position_inc)

    @property
    def velocity(self) -> float:
        """Actual velocity in user units per second; from the positions where no PDO has it."""
        reported = None if self._looks else self.objects.velocity
        return self.rate if reported is None else self.units.velocity.from_device(reported)

    @property
    def rate(self) -> float:
        """Rate of the actual position in user units per second, a few cycles late."""
        return self.units.distance.from_device(self._estimate.rate)

    @property
    def speed(self) -> float:
        """Greatest speed that anything shows, in user units per second."""
        return max(abs(self.velocity), abs(self.rate))

    @property
    def stands(self) -> bool:
        """Whether the axis was seen to stand; a real encoder is never quite still.

        Both 0x606C and the rate of the position have to be slow, and seen; of each its own noise
        counts as rest.
        """
        rest = self.rest_speed
        if not self.speed_known or abs(self.rate) > rest:
            return False
        reported = 0.0 if self._looks else self.objects.velocity or 0.0
        return abs(reported) <= NOISE_DEV or abs(self.velocity) <= rest

    @property
    def speed_known(self) -> bool:
        """Whether it was seen for long enough to distinguish motion from rest."""
        return self.seen and self._estimate.known

    @property
    def rest_speed(self) -> float:
        """Rate of the position up to which the axis counts as standing, in user units per second.

        By its own limits, and not below what its encoder resolves.
        """
        profile, units = self.parameters.profile, self.units
        noise = abs(units.distance.from_device(NOISE_DEV / self._estimate.window))
        slow = min(REST_SHARE * profile.velocity, REST_TIME * profile.deceleration)
        return max(slow, noise)

    @property
    def effort(self) -> float:
        """Actual torque in user units."""
        return self.units.effort.from_device(self.objects.torque)

    @property
    def ready(self) -> bool:
        """Whether its state and its parameters are known."""
        return self.fresh and self.cache.known and self.state is not DriveState.UNKNOWN

    def error_of_emcy(self) -> str:
        """Return the error of an EMCY that came just now; empty for none, until 0x603F is read."""
        emergency = self.node.emergencies.since(self._scheduler.now - EMCY_AGE_MAX)
        return '' if emergency is None else error_code_text(emergency.code)

    def describe(self, *, halted: bool = False, failure: str = '') -> str:
        """Describe the axis in a sentence."""
        node = self.node
        if not node.online:
            detail = f' ({node.phase_detail})' if node.phase_detail else ''
            loss = f'; lost before: {node.loss}' if node.loss else ''
            shown = f'{statusword_text(self.statusword)} by SDO; ' if self._looks else ''
            return f'{shown}offline: {node.phase.value}{detail}{loss}'
        parts = ['no statusword' if node.left_operational else 'no statusword yet']
        if self.state is not DriveState.UNKNOWN:
            parts = [statusword_text(self.statusword)]
            if node.operational:
                parts.append(f'mode {mode_title(self.objects.mode_display)}')
            if not self.seen:
                parts.append(f'no TPDOs for {self.age:.1f} s')
        if halted:
            parts.append('halted')
        if self.error:
            parts.append(f'error {self.error}')
        if failure:
            parts.append(f'the master stopped it: {failure}')
        if node.emergencies.last is not None:
            parts.append(f'EMCY {node.emergencies.last}')
        if node.left_operational and node.nmt_state is not None:
            parts.append(f'NMT state {node.nmt_state.name}: start it by NMT')
        return '; '.join(parts)

    async def read_error_code(self) -> None:
        """Read 0x603F, so that the answer can name the error."""
        index = self.objects.at(Index.ERROR_CODE)
        if self.state not in FAULTY or (index, 0) not in self.node.config.dictionary:
            return
        try:
            code = await self.node.objects.read_object(index)
        except (SdoError, CodecError):
            return  # the statusword says that there is a fault, only its code stays unknown
        self.error = error_code_text(int(code)) if isinstance(code, int) else ''

    def observe(self) -> None:
        """Read state and position from the process image, or from the last look by SDO."""
        objects, now = self.objects, self._scheduler.now
        shown = objects.observe() if self.node.operational else None
        self.fresh = shown is not None and objects.fresh(now)
        if self.fresh and shown is not None:
            self._estimate.note(now, shown[1], objects.position_timestamp)
        elif self._looks:
            shown = self._looked
        else:
            self._estimate.clear()
        if shown is None:
            self.state, self.statusword = DriveState.UNKNOWN, 0
            return
        word, self.observed_inc = shown
        self.observed = self.units.position.from_device(self.observed_inc)
        if word != self.statusword or self.state is DriveState.UNKNOWN:
            self.state, self.statusword = drive_state(word), word

    def lose_sight(self) -> None:
        """Forget the state; the position stays the last one."""
        self.state, self.statusword, self.fresh = DriveState.UNKNOWN, 0, False
        self._looked = None
        self._estimate.clear()

    async def look(self) -> DriveState:
        """Read statusword and position by SDO, and return the state.

        What is not answered stays unknown.
        """
        objects, begin = self.node.objects, self._scheduler.now
        try:
            word = await objects.read_object(self.objects.at(Index.STATUSWORD))
            position_inc = await objects.read_object(self.objects.at(Index.POSITION_ACTUAL))
        except (SdoError, CodecError):
            return DriveState.UNKNOWN
        if not (isinstance(word, int) and isinstance(position_inc, int)):
            return DriveState.UNKNOWN
        self._looked, self._looked_at = (word, position_inc), begin
        if not self.fresh:
            self._estimate.note(self._scheduler.now, position_inc)
        return drive_state(word)

    @contextmanager
    def looking(self) -> Iterator[None]:
        """Read by SDO periodically while TPDOs do not show the state."""
        task = self._scheduler.background(self._look_on())
        try:
            yield
        finally:
            task.cancel(SdoError('nothing more to see'))

    async def _look_on(self) -> None:
        while True:
            await self._scheduler.timer(LOOK_PERIOD)
            if not self.fresh:
                await self.look()

    def actual(self) -> Actual:
        """Return where the drive is, and the velocity from which it has to be braked.

        The velocity is the lesser of 0x606C and the rate of 0x6064: a wrong one must not
        set an axis in motion that stands.

        Raises:
            DriveError: The position is not known.
        """
        objects = self.objects
        velocity, reported = self.rate, objects.velocity
        velocity_dev = self.units.velocity.raw(velocity)
        if reported is not None:
            shown = self.units.velocity.from_device(reported)
            share = 0.0 if shown * velocity <= 0.0 else min(1.0, velocity / shown)
            velocity, velocity_dev = share * shown, share * reported
        return Actual(
            clamp(self.position_inc(), INT32_MAX),
            velocity,
            clamp(velocity_dev, INT32_MAX),
            clamp(objects.torque, INT16_MAX),
        )

    def position_inc(self) -> float:
        """Return 0x6064 in [inc]; an unknown position is no position 0."""
        position_inc = self.objects.position
        if position_inc is None:
            raise DriveError(f'{self.name}: its position (0x6064) is not known yet')
        return position_inc
