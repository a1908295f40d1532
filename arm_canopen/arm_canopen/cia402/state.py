# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state of one axis of a CiA 402 drive, as its TPDOs and SDOs show it, and how old that is."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import math
from typing import NamedTuple

from canopen_core import CodecError, DriveError, SdoError
from canopen_core.standard import (
    AXIS_OFFSET,
    drive_state,
    DriveState,
    error_code_text,
    Index,
    mode_title,
    OperationMode,
    Statusword,
    statusword_text,
    TARGET_OBJECTS,
)

from ..config.model.drive import DriveConfig
from ..master.process_image import InputReader, ReceivedTpdo
from ..master.remote_node import node_status, NodeStatus, RemoteNode
from ..master.scheduler import Scheduler
from .parameters import DriveParameters, OFFSET_OBJECTS, ParameterCache
from .units import clamp, INT16_MAX, INT32_MAX, Units

FAULTY = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
EMCY_AGE_MAX = 0.2  # [s] largest age of an EMCY that belongs to a fault
POWERED = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
"""States in which it may move under power, and falls or coasts when that goes."""
LOOK_PERIOD = 0.02  # [s] between two readings by SDO of what TPDOs do not show
LOOK_AGE_MAX = 0.5  # [s] largest age of such a reading
REST_SHARE = 0.002  # share of the profile velocity below which an axis counts as standing
REST_TIME = 0.004  # [s] within which an axis that counts as standing could stop
NOISE_DEV = 2  # units of 0x606C, and increments within the window, that noise of sensors may be
UNDECODED_MAX = 0.2  # [s] in which a statusword without a valid state counts as a lost TPDO
WINDOW = 0.1  # [s] of positions used for the velocity estimate
FLICKER_INC = 1  # [inc] by which an encoder at rest may change
WARNINGS = int(Statusword.WARNING | Statusword.INTERNAL_LIMIT)


@dataclass(frozen=True, slots=True)
class DriveStatus:
    """Snapshot of the state of one drive, for other threads and for display."""

    name: str  # name of the axis
    node: NodeStatus  # status of its device
    state: DriveState  # state of the power drive system
    mode: str  # mode of operation in words
    statusword: str  # 0x6041 in words
    warning: bool  # the statusword shows a warning or an internal limit
    error: str  # 0x603F in words, empty if unknown
    failure: str  # why the master stopped it, until it is enabled again; else empty
    fresh: bool  # state, position and velocity are recent enough to act on
    age: float  # age of the oldest of these values in [s]; infinite while unknown
    position: float  # actual position in user units
    velocity: float  # actual velocity in user units per second
    setpoint: float  # last commanded position in user units
    following_error: float  # set-point sent before the measurement minus position, in user units
    summary: str  # all of this in a sentence

    @property
    def faulted(self) -> bool:
        """Whether the drive is in Fault or Fault Reaction Active."""
        return self.state in FAULTY


class VelocityEstimate:
    """Estimate of the velocity from 0x6064 over a short window."""

    def __init__(self, poll_period: float = 0.0, *, on_change: bool = False) -> None:
        """Estimate over a window of its own length.

        Args:
            poll_period: Period of SDO polling in [s]; 0 if a PDO carries the positions.
            on_change: Positions are sent only on change, so the last one stays valid.
        """
        self.window = max(WINDOW, 2.5 * poll_period)  # length of the window in [s]
        self._on_change = on_change
        self._positions: deque[tuple[float, float]] = deque()

    def note(self, now: float, position_inc: float, stamp: float | None = None) -> None:
        """Add a position in [inc] at a steady time in [s].

        With ``on_change`` a position with a ``stamp`` as old as the window is still valid.
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


class Actual(NamedTuple):
    """Actual or held position of a drive, with velocity and torque."""

    # in [inc], as the drive reports it, so that no factor in bus.yml can change the holding target
    position_inc: int
    velocity: float = 0.0  # in user units per second; braking starts from it
    velocity_dev: int = 0  # the same in device units, as the drive reports it
    torque: int = 0  # 0x6077 in device units, 0 when it is unknown


class AxisState:
    """State of an axis as the master knows it, the only source of it for other classes.

    :meth:`observe` updates it once a cycle. Positions, velocities and efforts are in user units; a
    name with ``_inc`` or ``_dev`` is in device units.
    """

    def __init__(
        self,
        node: RemoteNode,
        scheduler: Scheduler,
        config: DriveConfig,
        warn: Callable[[str], None],
    ) -> None:
        """Bind each object to its PDO; objects that no PDO carries are read by SDO."""
        self.node = node  # the device
        self.config = config  # settings of the axis
        self.name = config.name or node.name  # of its channel for a device with several axes
        self.units = Units(config)
        self.cache = ParameterCache(node, config, self.units, scheduler, warn)
        self.state = DriveState.UNKNOWN  # state of the power drive system
        self.statusword = 0  # last 0x6041 with a valid state
        self.mode = 0  # displayed mode (0x6061); 0 while unknown
        # 0x6041 if it shows no valid state (no row of CiA 402-2, table 31); state and statusword
        # then keep their last values, and are soon no longer fresh
        self.undecoded: int | None = None
        self._decoded_at = -math.inf
        self.fresh = False  # the TPDOs with all of this are recent enough to act on
        # actual position, and 0x6064; the last values of a lost drive, NaN before the first
        self.position = self.position_inc = math.nan
        self.velocity_dev: float | None = None  # 0x606C; None without a PDO, or while unknown
        self.error = ''  # 0x603F in words at the last fault
        self.held_torque = 0  # 0x6077 by SDO for entering a torque mode, without a TPDO
        self._scheduler = scheduler
        self._looked: tuple[int, float] | None = None  # statusword and position, by SDO
        self._looked_at = -math.inf
        self._looking = 0  # number of tasks that poll by SDO
        self._confirmed: int | None = None  # positions received until SDO showed the last one
        objects, image = node.objects, node.image
        self._statusword = objects.reader(self.at(Index.STATUSWORD))
        self._mode = objects.reader(self.at(Index.MODE_OF_OPERATION_DISPLAY))
        self._position = objects.reader(self.at(Index.POSITION_ACTUAL))
        self._velocity = image.reader(self.at(Index.VELOCITY_ACTUAL))
        self._torque = image.reader(self.at(Index.TORQUE_ACTUAL))
        # several objects come in one TPDO, which is looked at once; a mode that is read by SDO
        # does not count: the cycle needs no SDO
        mode_in_pdo = image.reader(self.at(Index.MODE_OF_OPERATION_DISPLAY))
        readers = [self._statusword, self._position, self._velocity, self._torque, mode_in_pdo]
        self._sources = list(
            dict.fromkeys(reader.source for reader in readers if reader is not None)
        )
        polled = image.reader(self.at(Index.POSITION_ACTUAL)) is None
        source = self._position.source
        self._estimate = VelocityEstimate(
            node.config.poll_period if polled else 0.0,
            on_change=isinstance(source, ReceivedTpdo) and not source.synchronous,
        )

    def at(self, index: int) -> int:
        """Return the index of an object of the profile for this axis."""
        return index + AXIS_OFFSET * self.config.channel

    @property
    def parameters(self) -> DriveParameters:
        """Parameters that the drive reported."""
        return self.cache.parameters

    @property
    def seen(self) -> bool:
        """Whether its state, by TPDO or SDO, is recent enough to judge a stop."""
        return self.fresh or self._looks

    @property
    def _looks(self) -> bool:
        """Whether :meth:`look` has read the state recently, while TPDOs do not show it."""
        if self.fresh or self._looked is None:
            return False
        return self._scheduler.now - self._looked_at <= LOOK_AGE_MAX

    @property
    def age(self) -> float:
        """Age of the oldest value of its state in [s]; infinite while unknown."""
        return math.inf if self.state is DriveState.UNKNOWN else self.silence

    @property
    def silence(self) -> float:
        """Time since the arrival of the oldest of its TPDOs in [s]."""
        return self._scheduler.now - min(source.timestamp for source in self._sources)

    @property
    def position_age(self) -> float:
        """Age of 0x6064 in [s]."""
        return self._scheduler.now - self._position.source.timestamp

    @property
    def positions_received(self) -> int:
        """Number of TPDOs with 0x6064 received."""
        return self._position.source.count

    @property
    def velocity(self) -> float:
        """Actual velocity, estimated from positions if no PDO carries it."""
        reported = self.velocity_dev
        return self.rate if reported is None else self.units.velocity.from_device(reported)

    @property
    def rate(self) -> float:
        """Velocity estimated from the actual position, delayed by a few cycles."""
        return self.units.distance.from_device(self._estimate.rate)

    @property
    def speed(self) -> float:
        """Greatest speed by any measurement."""
        return max(abs(self.velocity), abs(self.rate))

    @property
    def stands(self) -> bool:
        """Whether feedback confirms that the axis stands, apart from encoder noise.

        Both 0x606C and the rate of the position have to be known and slow; each has its own
        noise threshold.
        """
        rest = self.rest_speed
        if not self.speed_known or abs(self.rate) > rest:
            return False
        return abs(self.velocity_dev or 0.0) <= NOISE_DEV or abs(self.velocity) <= rest

    @property
    def speed_known(self) -> bool:
        """Whether feedback covers enough time to distinguish motion from rest."""
        return self.seen and self._estimate.known and not self._may_have_moved

    @property
    def _may_have_moved(self) -> bool:
        """Whether its last position is neither recent nor confirmed by SDO, while it is polled."""
        position = self._position
        return (
            self._looking > 0
            and isinstance(position, InputReader)
            and position.source.loss_unnoticed
            and self._confirmed != position.source.count
            and self.position_age > WINDOW
        )

    @property
    def rest_speed(self) -> float:
        """Speed up to which the axis counts as standing.

        It follows from the limits of the axis, and is not below the encoder resolution.
        """
        profile, units = self.parameters.profile, self.units
        noise = abs(units.distance.from_device(NOISE_DEV / self._estimate.window))
        slow = min(REST_SHARE * profile.velocity, REST_TIME * profile.deceleration)
        return max(slow, noise)

    @property
    def torque_dev(self) -> float:
        """0x6077; 0 when no PDO carries it."""
        return (self._torque.value or 0) if self._torque is not None else 0

    @property
    def shows_torque(self) -> bool:
        """Whether a PDO carries 0x6077."""
        return self._torque is not None

    @property
    def effort(self) -> float:
        """Actual torque."""
        return self.units.effort.from_device(self.torque_dev)

    @property
    def ready(self) -> bool:
        """Whether state and parameters are known."""
        return self.fresh and self.cache.known and self.state is not DriveState.UNKNOWN

    def statusword_came(self, since: float) -> bool:
        """Return whether 0x6041 arrived since a time in [s]; True if it is sent on change."""
        source = self._statusword.source
        return source.timestamp > since or source.stale_after == math.inf

    def held_target(self, mode: OperationMode) -> int | None:
        """Return target plus offset of a mode in the RPDOs, in device units, else None."""
        index, subindex = TARGET_OBJECTS[mode]
        value = self.node.image.commanded(self.at(index), subindex)
        offset = OFFSET_OBJECTS.get(mode)
        if value is None:
            return None
        return int(value) + (0 if offset is None else self.offset(offset))

    def offset(self, index: Index) -> int:
        """Return an offset that the drive adds to a target: from the RPDOs, else as read."""
        value = self.node.image.commanded(self.at(index))
        return self.parameters.offsets.get(index, 0) if value is None else int(value)

    def error_of_emcy(self) -> str:
        """Return the error of a recent EMCY, used until 0x603F is read; empty for none."""
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
        if self.undecoded is not None or self.state is not DriveState.UNKNOWN:
            parts = [self.word_text]
            if node.operational:
                parts.append(f'mode {mode_title(self.mode)}')
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

    @property
    def shown_state(self) -> DriveState:
        """State in the last 0x6041; UNKNOWN if it shows no valid state."""
        return self.state if self.undecoded is None else DriveState.UNKNOWN

    @property
    def word_text(self) -> str:
        """Last received 0x6041 in words."""
        if self.undecoded is None:
            return statusword_text(self.statusword)
        before = self.state.title
        return f'{statusword_text(self.undecoded)}, no state of CiA 402 (before: {before})'

    async def read_error_code(self) -> None:
        """Read 0x603F, so that messages can name the error."""
        index = self.at(Index.ERROR_CODE)
        if self.state not in FAULTY or (index, 0) not in self.node.config.dictionary:
            return
        try:
            code = await self.node.objects.read_object(index)
        except (SdoError, CodecError):
            return  # the statusword shows the fault; only its code stays unknown
        self.error = error_code_text(int(code)) if isinstance(code, int) else ''

    def observe(self) -> None:
        """Update state and position from the process image, or the last reading by SDO."""
        now = self._scheduler.now
        shown = position = None
        self.fresh = False
        if self.node.operational:
            word, position = self._statusword.value, self._position.value
            mode = self._mode.value
            if word is not None and position is not None and mode is not None:
                shown, self.mode = (int(word), position), int(mode)
                self.fresh = True
                for source in self._sources:  # in every cycle: half of what any() costs
                    if source.stale(now):
                        self.fresh = False
                        break
        if self.fresh and shown is not None:
            self._estimate.note(now, shown[1], self._position.source.timestamp)
        elif self._looks:
            shown = self._looked
        else:
            self._estimate.clear()
        if shown is None:
            self.state, self.statusword, self.mode = DriveState.UNKNOWN, 0, 0
            self.velocity_dev = self.undecoded = None
            if position is not None:  # it may come before the statusword
                self.position_inc = position
                self.position = self.units.position.from_device(position)
            return
        word, self.position_inc = shown
        looked = shown is self._looked
        self.velocity_dev = None if looked or self._velocity is None else self._velocity.value
        self.position = self.units.position.from_device(self.position_inc)
        self._decode(word)

    def _decode(self, word: int) -> None:
        """Decode a statusword; keep the last state if it shows none, which soon becomes stale."""
        now = self._scheduler.now
        if word != self.statusword or self.state is DriveState.UNKNOWN:
            state = drive_state(word)
            if state is DriveState.UNKNOWN:
                self.undecoded = word
                self.fresh = self.fresh and now - self._decoded_at <= UNDECODED_MAX
                return
            self.state, self.statusword = state, word
        self.undecoded, self._decoded_at = None, now

    def lose_sight(self) -> None:
        """Forget the state; keep the last position."""
        self.state, self.statusword, self.mode = DriveState.UNKNOWN, 0, 0
        self.fresh, self.velocity_dev, self.undecoded = False, None, None
        self._decoded_at = -math.inf
        self._looked = None
        self._estimate.clear()

    async def look(self) -> DriveState:
        """Read statusword and position by SDO, and return the state.

        An object that the device does not answer stays unknown.
        """
        objects, begin = self.node.objects, self._scheduler.now
        try:
            word = await objects.read_object(self.at(Index.STATUSWORD))
            position_inc = await objects.read_object(self.at(Index.POSITION_ACTUAL))
        except (SdoError, CodecError):
            return DriveState.UNKNOWN
        if not (isinstance(word, int) and isinstance(position_inc, int)):
            return DriveState.UNKNOWN
        self._looked, self._looked_at = (word, position_inc), begin
        if not self.fresh:
            self._estimate.note(self._scheduler.now, position_inc)
        state = drive_state(word)
        return self.state if state is DriveState.UNKNOWN else state  # it may still be powered

    async def confirm(self) -> bool:
        """Read by SDO the values that lost TPDOs may have carried; return whether any differs.

        The values read of state, mode, position and velocity replace those of the last TPDOs.
        """
        differs = False
        for index, reader in (
            (Index.STATUSWORD, self._statusword),
            (Index.MODE_OF_OPERATION_DISPLAY, self._mode),
            (Index.POSITION_ACTUAL, self._position),
            (Index.VELOCITY_ACTUAL, self._velocity),
        ):
            if not (isinstance(reader, InputReader) and reader.source.loss_unnoticed):
                continue
            count = reader.source.count
            try:
                value = await self.node.objects.read_object(self.at(index))
            except (SdoError, CodecError):
                continue
            if reader is self._position:
                self._confirmed = count if value == reader.value else None
            if not isinstance(value, int) or reader.source.count != count:
                continue  # a TPDO received meanwhile is at least as new
            if reader.value not in (None, value):
                reader.correct(value)
                differs = True
                if reader is self._position:  # the way between both was not seen
                    reader.source.timestamp = self._scheduler.now
                    self._estimate.clear()
        return differs

    @contextmanager
    def looking(self) -> Iterator[None]:
        """Poll by SDO while TPDOs do not show the state, or may be lost.

        If a lost position TPDO goes unnoticed, only SDO can confirm that the axis stands.
        """
        self._looking += 1
        self._confirmed = None
        task = self._scheduler.background(self._look_on())
        try:
            yield
        finally:
            self._looking -= 1
            task.cancel(SdoError('nothing more to see'))

    async def _look_on(self) -> None:
        while True:
            await self._scheduler.timer(LOOK_PERIOD)
            await (self.confirm() if self.fresh else self.look())

    def actual(self) -> Actual:
        """Return the actual position, and the velocity at which braking starts.

        The velocity is the lesser of 0x606C and the rate of 0x6064: a wrong one must not
        set an axis in motion that stands.

        Raises:
            DriveError: The position is not known.
        """
        position_inc = self._position.value
        if position_inc is None:
            raise DriveError(f'{self.name}: its position (0x6064) is not known yet')
        velocity, reported = self.rate, self.velocity_dev
        velocity_dev = self.units.velocity.raw(velocity)
        if reported is not None:
            shown = self.units.velocity.from_device(reported)
            share = 0.0 if shown * velocity <= 0.0 else min(1.0, velocity / shown)
            velocity, velocity_dev = share * shown, share * reported
        return Actual(
            clamp(position_inc, INT32_MAX),
            velocity,
            clamp(velocity_dev, INT32_MAX),
            clamp(self.torque_dev or self.held_torque, INT16_MAX),
        )

    def status(
        self,
        setpoint: float,
        following_error: float,
        *,
        failure: str = '',
        summary: str = '',
    ) -> DriveStatus:
        """Return a snapshot that includes the commanded set-point."""
        return DriveStatus(
            name=self.name,
            node=node_status(self.node, self._scheduler.now),
            state=self.state,
            mode=mode_title(self.mode),
            statusword=self.word_text,
            warning=bool(self.statusword & WARNINGS),
            error=self.error,
            failure=failure,
            fresh=self.fresh,
            age=self.age,
            position=self.position,
            velocity=self.velocity,
            setpoint=setpoint,
            following_error=following_error,
            summary=summary or self.describe(),
        )
