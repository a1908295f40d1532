# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The process image of one device: last values of its TPDOs, next values for its RPDOs.

Objects are looked up once, when a reader or writer is created; in the cycle values
are list look-ups. Objects that no PDO carries are read and written by SDO in the background.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math
import threading
from typing import Protocol, TypeAlias

from canopen_core import CodecError
from canopen_core.can import Frame
from canopen_core.standard import (
    DataType,
    integer_range,
    MappedObject,
    Number,
    object_address,
    PdoCodec,
    SYNCHRONOUS_MAX,
)

from ..config.model import PdoConfig
from ..config.model.bus import longest_silence, loss_unnoticed
from .scheduler import completed, Promise

REPEAT_SHARE = 0.5  # share of the deadline of an RPDO after which it is repeated
IN_THE_IMAGE = completed()  # a value sent with the PDOs of this cycle counts as delivered

StartValue: TypeAlias = Callable[[MappedObject], Number]
Limits: TypeAlias = tuple[Number, Number]
Listener: TypeAlias = 'Callable[[ReceivedTpdo], None]'


def limits_of(data_type: DataType) -> Limits:
    """Return the smallest and largest value of a data type."""
    return integer_range(data_type) or (-math.inf, math.inf)


class SyncRound:
    """Counts the TPDOs that answer one SYNC, over all devices."""

    def __init__(
        self, complete: Callable[[], None], window: float = 0.0, period: float = 0.0
    ) -> None:
        """``window`` is the synchronous window after SYNC in [s] (0x1007); 0 for no limit."""
        self.period = period  # time between two SYNCs in [s]; 0 where this master sends none
        self.pending = 0  # number of expected TPDOs not yet received
        self.late = 0  # number of TPDOs received after the synchronous window
        self.complete = complete  # called when the last one has arrived
        self._window = window
        self._sync_time = 0.0

    def start(self, now: float) -> None:
        """Start a round before a SYNC; each expected :class:`ReceivedTpdo` adds itself."""
        self.pending = 0
        self._sync_time = now

    def answer(self, timestamp: float) -> None:
        """Count an expected TPDO; ``timestamp`` is its steady time of arrival in [s]."""
        self.late += 0.0 < self._window < timestamp - self._sync_time
        self.pending -= 1
        if self.pending == 0:
            self.complete()


class ReceivedTpdo:
    """One TPDO of the device."""

    def __init__(self, config: PdoConfig, sync: SyncRound) -> None:
        self.config = config  # its configuration
        self.codec = PdoCodec(config.mapping)  # its compiled mapping
        # last values in mapping order, None before the first
        self.values: tuple[Number, ...] | None = None
        self.timestamp = 0.0  # steady time of the last arrival in [s]
        self.excused = 0.0  # time since then in [s] without a SYNC that requests it
        self.count = 0  # number of PDOs received
        self.length_errors = 0  # number of PDOs that were too short
        self._listeners: tuple[Listener, ...] = ()  # replaced as a whole, by any thread
        self._listening = threading.Lock()
        # called with this object and the length if a PDO is too short
        self.on_short: Callable[[ReceivedTpdo, int], None] = lambda entry, length: None
        self.awaited = False  # it is expected after the last SYNC and has not arrived
        # age in [s] from which its values are too old to act on; infinite for a TPDO without a
        # period, which may be silent
        self.stale_after = longest_silence(config, sync.period)
        self._sync = sync
        self._unpack = self.codec.unpack

    @property
    def every_sync(self) -> bool:
        """Whether the device sends it after each SYNC."""
        return self.config.transmission == 1

    @property
    def synchronous(self) -> bool:
        """Whether the device sends it after every nth SYNC."""
        return 1 <= self.config.transmission <= SYNCHRONOUS_MAX

    def stale(self, now: float) -> bool:
        """Return whether its values are missing, or too old to act on, at a steady time in [s]."""
        return self.values is None or now - self.timestamp - self.excused > self.stale_after

    @property
    def loss_unnoticed(self) -> bool:
        """Whether it carries drive state and its loss would go unnoticed."""
        return loss_unnoticed(self.config, self.stale_after)

    def rely_on_timer(self, *, taken: bool) -> None:
        """Expect it at the period of its event timer; not if the device refused the timer."""
        silence = longest_silence(self.config, self._sync.period)
        self.stale_after = silence if taken else math.inf

    def listen(self, listener: Listener) -> None:
        """Call a listener with this TPDO at each arrival, in the thread of the cycle."""
        with self._listening:
            self._listeners = (*self._listeners, listener)

    def ignore(self, listener: Listener) -> None:
        """Remove a listener."""
        with self._listening:
            self._listeners = tuple(each for each in self._listeners if each != listener)

    def clear(self) -> None:
        """Forget the values, because the device restarted or is lost."""
        self.values = None
        self.awaited = False

    def expect(self) -> None:
        """Expect an answer to the SYNC that is about to be sent, if it answered before."""
        self.awaited = self.values is not None
        self._sync.pending += self.awaited

    def receive(self, frame: Frame) -> None:
        """Store a PDO from the bus."""
        try:
            self.values = self._unpack(frame.data)
        except CodecError:
            self.length_errors += 1
            self.on_short(self, len(frame.data))
            return
        self.timestamp, self.excused = frame.timestamp, 0.0
        self.count += 1
        for listener in self._listeners:
            listener(self)
        if self.awaited:
            self.awaited = False
            self._sync.answer(frame.timestamp)


class SentRpdo:
    """One RPDO of the device."""

    def __init__(self, config: PdoConfig, start: StartValue, *, cyclic: bool = True) -> None:
        self.config = config  # its configuration
        # it is sent in every cycle; otherwise when a client publishes one of its objects
        self.cyclic = cyclic
        self.due = False  # it was published and is sent with the next cycle
        # axes that are commanded by SDO; while there are any, it is not sent
        self.kept_back_by: set[object] = set()
        self.skips = False  # it is not sent in this cycle
        self._repeat_time = REPEAT_SHARE * (config.event_time or 0.0)
        self._left_at: float | None = None
        self._brought: list[Number] = []  # values when it was last sent
        self.codec = PdoCodec(config.mapping)  # its compiled mapping
        # next values in mapping order
        self.values: list[Number] = [start(mapped) for mapped in config.mapping]
        self._packed: list[Number] = []
        self._frame = Frame(config.cob_id)  # frame with these values

    @property
    def synchronous(self) -> bool:
        """Whether the device applies it at the next SYNC."""
        return self.config.transmission <= SYNCHRONOUS_MAX

    def leaves(self, now: float) -> bool:
        """Return whether it is to be sent in this cycle, at a time in [s].

        An RPDO with a deadline is repeated within it, once a client has published it.
        """
        if self.skips:
            self.skips = False
            return False
        if self.cyclic:
            return not self.kept_back_by
        repeat = self._left_at is not None and 0.0 < self._repeat_time <= now - self._left_at
        return self.due or repeat

    def sent(self, position: int) -> Number | None:
        """Return the last value sent at a mapping position since the boot, or None."""
        if self._left_at is None:
            return None
        return (self._brought if self.due else self.values)[position]

    def left(self, now: float) -> None:
        """Record that the published RPDO was sent, at a time in [s]."""
        self.due, self._left_at, self._brought = False, now, [*self.values]

    def reset(self) -> None:
        """Forget what was published, because the device restarted."""
        self.due, self._left_at, self.skips = False, None, False
        self.kept_back_by.clear()

    def frame(self) -> Frame:
        """Return the frame with the present values; reuse it while they are unchanged."""
        if self.values != self._packed:
            self._frame = Frame(self.config.cob_id, self.codec.pack(self.values))
            self._packed = self.values.copy()
        return self._frame


class Writer(Protocol):
    """Interface to write the next value of an object of the device."""

    @property
    def limits(self) -> Limits:
        """Smallest and largest value of the object."""

    @property
    def by_sdo(self) -> bool:
        """Whether it goes by SDO, because no RPDO carries it."""

    def write(self, value: Number) -> None:
        """Keep a value in the device, called each cycle; an SDO is sent only if it changed.

        Raises:
            CodecError: The object cannot hold it; the one before is kept.
        """

    def deliver(self, value: Number) -> Promise[None]:
        """Send a value once, even if unchanged; a newer value replaces one still waiting.

        Returns:
            Done when the device has it, or will have it with the PDOs of this cycle.

        Raises:
            CodecError: The object cannot hold it; the one before is kept.
        """


class InputReader:
    """Reads an object from a TPDO."""

    def __init__(self, source: ReceivedTpdo, position: int) -> None:
        self.source = source  # its TPDO
        self._position = position

    @property
    def value(self) -> Number | None:
        """Current value, None while unknown."""
        values = self.source.values
        return None if values is None else values[self._position]

    def correct(self, value: Number) -> None:
        """Replace the value by one read by SDO, because its TPDO was lost."""
        values = [*(self.source.values or ())]
        values[self._position : self._position + 1] = [value]
        self.source.values = tuple(values)


class OutputWriter:
    """Writes an object to every RPDO that carries it, so that none sends an old value.

    A value that cannot be encoded is refused here, where its source is known: in the RPDO it would
    block all other objects, including the controlword.
    """

    by_sdo = False  # it does not go by SDO

    def __init__(self, places: Sequence[tuple[SentRpdo, int]]) -> None:
        self._places = [(output.values, position) for output, position in places]
        output, position = places[0]
        self._mapped = output.config.mapping[position]
        # smallest and largest value of the object
        self.limits = limits_of(self._mapped.data_type)
        self._low, self._high = self.limits

    def write(self, value: Number) -> None:
        """Set the value for the next PDOs."""
        if not self._low <= value <= self._high:
            mapped = self._mapped
            raise CodecError(
                f'{object_address(mapped.index, mapped.subindex)} cannot hold {value} '
                f'({mapped.data_type.name}: {self._low:g} to {self._high:g})'
            )
        for values, position in self._places:
            values[position] = value

    def deliver(self, value: Number) -> Promise[None]:
        """Set the value for the next PDOs, sent in this cycle; raises as :meth:`write`."""
        self.write(value)
        return IN_THE_IMAGE


class ProcessImage:
    """All enabled PDOs of one device."""

    def __init__(
        self,
        tpdos: tuple[PdoConfig, ...],
        rpdos: tuple[PdoConfig, ...],
        sync: SyncRound,
        *,
        start: StartValue = lambda mapped: 0,
        cyclic: bool = True,
        send_last: Callable[[int], bool] = lambda index: False,
    ) -> None:
        """Compile the enabled PDOs.

        Args:
            tpdos: PDOs that the device sends.
            rpdos: PDOs that it receives.
            sync: The round that all TPDOs of the bus belong to.
            start: Returns the initial value of an object in an RPDO.
            cyclic: RPDOs are sent in every cycle; otherwise when published.
            send_last: Returns of an index whether RPDOs with that object leave after the others:
                commands, which must not overtake their data.
        """
        # PDOs that the device sends
        self.tpdos = [ReceivedTpdo(pdo, sync) for pdo in tpdos if pdo.enabled and pdo.mapping]
        used = [
            SentRpdo(pdo, start, cyclic=cyclic) for pdo in rpdos if pdo.enabled and pdo.mapping
        ]
        # PDOs that it receives, in the order of sending
        self.rpdos = sorted(
            used, key=lambda output: any(send_last(o.index) for o in output.config.mapping)
        )
        self._places: dict[tuple[int, int], list[tuple[SentRpdo, int]]] = {}  # RPDOs by object
        for output in self.rpdos:
            for position, mapped in enumerate(output.config.mapping):
                places = self._places.setdefault((mapped.index, mapped.subindex), [])
                places.append((output, position))

    def clear(self) -> None:
        """Forget the values that the device sent."""
        for entry in self.tpdos:
            entry.clear()
        for output in self.rpdos:
            output.reset()

    def skip_cycle(self, index: int, subindex: int = 0) -> None:
        """Skip the RPDOs with an object in this cycle; those of other axes are sent."""
        for output, _ in self._places.get((index, subindex), ()):
            output.skips = True

    def store(self, index: int, subindex: int, value: Number) -> list[SentRpdo]:
        """Write a value to the RPDOs that carry an object; return these RPDOs."""
        places = self._places.get((index, subindex), ())
        for output, position in places:
            output.values[position] = value
        return [output for output, _ in places]

    def reader(self, index: int, subindex: int = 0) -> InputReader | None:
        """Return a reader for an object, None when no TPDO carries it."""
        for entry in self.tpdos:
            for position, mapped in enumerate(entry.config.mapping):
                if (mapped.index, mapped.subindex) == (index, subindex):
                    return InputReader(entry, position)
        return None

    def writer(self, index: int, subindex: int = 0) -> OutputWriter | None:
        """Return a writer for an object, None when no RPDO carries it."""
        places = self._places.get((index, subindex))
        return OutputWriter(places) if places else None

    def is_applied_first(self, index: int, subindex: int, *, command: int) -> bool:
        """Return whether a value takes effect no later than a command in the same cycle.

        True if only one RPDO carries the command, and each RPDO with the value is either that one
        or event-driven and sent before it. The order in which a device applies several synchronous
        RPDOs at SYNC is not defined.
        """
        commands = [entry for entry, _ in self._places.get((command, 0), ())]
        if len(commands) != 1:
            return False
        before = self.rpdos[: self.rpdos.index(commands[0])]
        return all(
            entry is commands[0] or (entry in before and not entry.synchronous)
            for entry, _ in self._places.get((index, subindex), ())
        )

    def commanded(self, index: int, subindex: int = 0) -> Number | None:
        """Return the next value of an object in the RPDOs, None if none carries it."""
        for entry, position in self._places.get((index, subindex), ()):
            return entry.values[position]
        return None

    def sent(self, index: int, subindex: int) -> Number | None:
        """Return the last value of an object sent by RPDO since the boot, else None."""
        for entry, position in self._places.get((index, subindex), ()):
            if (value := entry.sent(position)) is not None:
                return value
        return None

    def mapped_output(self, index: int, subindex: int = 0) -> MappedObject | None:
        """Return the mapping entry of an object in an RPDO, None if not mapped."""
        for entry, position in self._places.get((index, subindex), ()):
            return entry.config.mapping[position]
        return None
