# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writes the boot plan to a device or compares both; reads the initial values of its RPDOs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

from canopen_core import BootError, CodecError, SdoAbortError, SdoError, SdoTimeoutError
from canopen_core.standard import (
    axis_of,
    AXIS_OFFSET,
    decode,
    Index,
    is_setting,
    MappedObject,
    Number,
    object_address,
    OFFSETS,
    OperationMode,
    pdo_object,
    TARGET_OBJECTS,
)

from ..config.model import BusConfig, SdoWrite
from ..config.model.boot_plan import (
    assumed_cob_ids,
    boot_writes,
    BootWrite,
    consumer_to_read,
    ERROR_CONTROL,
    held_after_boot,
    WATCH_KEY,
    watch_word,
)
from .events import EventKind, Severity
from .process_image import SentRpdo
from .remote_node import RemoteNode
from .remote_objects import start_value

UNWATCHED = (
    'so it goes on with its last command when the master dies. Give it a time that it takes (the '
    "master's heartbeat_producer times heartbeat_multiplier), or write heartbeat_consumer: false "
    'to its section of bus.yml, and have an emergency stop that needs no bus'
)


class Configurator:
    """Writes the boot plan to one device, or compares the two."""

    def __init__(
        self,
        node: RemoteNode,
        bus: BusConfig,
        *,
        on_write: Callable[[str], None],
    ) -> None:
        """``on_write`` is called with each object before it is written."""
        self._node = node
        self._bus = bus
        self._sdo_timeout = bus.master.boot_timeout
        self._on_write = on_write

    async def apply(self) -> None:
        """Write the whole boot plan; the device must not process PDOs meanwhile.

        Raises:
            SdoError: The device refused something that bus.yml requests, or does not answer.
        """
        for write in await self._writes():
            await self._bring(write)
        for write in assumed_cob_ids(self._node.config):
            present = await self._node.sdo.read(*write.address, self._sdo_timeout)
            if not write.fits(present):
                raise SdoError(
                    f'{write.place} of {self._node.name} is {write.text(present)}, the master '
                    f'takes {write.text()} by its node id: write {write.key}: {{cob_id: auto}} to '
                    'its section of bus.yml'
                )

    async def write_error_control(self) -> None:
        """Configure error control, TPDOs, and the supervision of the master by the device."""
        for write in await self._writes():
            if write.index in ERROR_CONTROL or write.key == WATCH_KEY or write.is_own_timer:
                await self._bring(write)

    async def differences(self) -> list[str]:
        """Compare the PDOs of a running device with bus.yml; return the differences in words.

        Raises:
            SdoError: The device does not answer.
        """
        found = []
        for write in held_after_boot(self._bus, self._node.config):
            if pdo_object(write.index) is None or write.is_own_timer:
                continue
            try:
                present = await self._node.sdo.read(*write.address, self._sdo_timeout)
            except SdoAbortError:
                if not write.fixed:
                    raise
                continue  # the device does not let it be read
            if not write.fits(present):
                found.append(f'{write.place} is {write.text(present)} instead of {write.text()}')
        return found

    async def write(self, write: SdoWrite) -> None:
        """Write an object.

        Raises:
            SdoError: The device refused, or does not answer.
        """
        self._on_write(object_address(write.index, write.subindex))
        address, config = (write.index, write.subindex), self._node.config
        timeout = config.write_timeout(*address, self._sdo_timeout)
        own = config.write_of(*address)
        repeat = is_setting(write.index) and (own is None or own.timeout is None)
        try:
            await self._node.sdo.write(*address, write.data, timeout, repeat=repeat)
        except SdoTimeoutError as error:
            if own is None:
                raise
            raise SdoTimeoutError(
                f'{error}; if it is slow at that, write timeout_ms: {round(5e3 * timeout)} to its '
                f'entry in {own.place.key or "sdo"}'
            ) from error

    async def read_number(self, index: int, subindex: int) -> int:
        """Read an object as an unsigned number.

        Raises:
            SdoError: The device refused, or does not answer.
        """
        data = await self._node.sdo.read(index, subindex, self._sdo_timeout)
        return int.from_bytes(data, 'little')

    async def _bring(self, write: BootWrite) -> None:
        """Write an object unless the device already holds the value or does not support it."""
        data = write.data
        if write.mask is not None:  # a COB-ID, of which the device keeps some bits
            present = await self.read_number(*write.address)
            data = write.over(present)
            if present == int.from_bytes(data, 'little'):
                return
        if write.is_own_timer:
            self._rely_on_timer(write.index, taken=True)
        try:
            await self.write(SdoWrite(*write.address, data))
        except SdoAbortError as error:
            if not (write.temporary or await self._holds(write)):
                self._refused(write, error)
                return
            # where the writes that follow need it, they are refused, too
        if write.key == WATCH_KEY:
            self._node.watch_slot = write.subindex if any(data) else 0

    def _refused(self, write: BootWrite, error: SdoAbortError) -> None:
        """Handle a refused write: raise an SdoError if bus.yml requests it, else continue."""
        if write.key == WATCH_KEY:
            reason = f'{error}: it does not take {write.text()}, {UNWATCHED}'
            if write.requested and any(write.data):
                raise SdoError(reason) from error
            self._warn(reason)
            return
        reason = f'{error}; {write.key} requests {write.text()}'
        if write.requested:
            raise SdoError(f'{reason}: correct or remove it there') from error
        self._warn(f'{reason} by default only, so it goes on with what it has')
        if write.is_own_timer:
            self._rely_on_timer(write.index, taken=False)

    def _rely_on_timer(self, index: int, *, taken: bool) -> None:
        """Set whether a TPDO is expected at the period of its event timer, until the next boot."""
        for entry in self._node.image.tpdos:
            if entry.config.number == index - Index.TPDO_COMMUNICATION + 1:
                entry.rely_on_timer(taken=taken)

    async def _holds(self, write: BootWrite) -> bool:
        """Return whether a device that refused a write already holds the value."""
        try:
            return write.fits(await self._node.sdo.read(*write.address, self._sdo_timeout))
        except SdoAbortError:
            return False

    async def _writes(self) -> list[BootWrite]:
        """Return the boot plan, adapted to the entries of 0x1016 in the device."""
        node = self._node
        node.watch_slot = 0
        writes = boot_writes(self._bus, node.config, await self._consumers())
        if watch_word(self._bus, node.config) and all(w.key != WATCH_KEY for w in writes):
            self._warn(f'watches others in all entries of 0x1016, and not the master, {UNWATCHED}')
        return writes

    async def _consumers(self) -> dict[int, int | None]:
        """Read the entries of 0x1016, up to the first one that is free."""
        held: dict[int, int | None] = {}
        while (subindex := consumer_to_read(self._bus, self._node.config, held)) is not None:
            held[subindex] = None
            with suppress(SdoAbortError):
                held[subindex] = await self.read_number(Index.CONSUMER_HEARTBEAT, subindex)
        return held

    def _warn(self, text: str) -> None:
        self._node.report(EventKind.BOOT, Severity.WARNING, text)


DUMMY_MAX = 0x001F  # objects below stand for gaps in a mapping (CiA 301, 7.4.7.1)
POSITION_TARGETS = {
    TARGET_OBJECTS[mode]
    for mode in (OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION)
}


async def preset_outputs(node: RemoteNode) -> None:
    """Set each RPDO of an operational device to the present values of its mapped objects.

    Raises:
        BootError: A mapped object cannot be read, so the RPDO might change its value.
    """
    for output, position, mapped in _mapped(node):
        try:
            value = await _present(node, mapped, node.config.sdo_timeout)
        except (SdoError, CodecError) as error:
            raise BootError(
                f'{node.name} cannot be taken over, as {_place(mapped)} in one of its RPDOs is '
                f'not known: {error}'
            ) from error
        output.values[position] = value


async def read_outputs(node: RemoteNode, timeout: float) -> None:
    """Set each RPDO of a configured device to the values in the device.

    Objects that the driver commands are left to it, except the mode of operation (some drives must
    not get mode 0) and position targets, which start at the actual position before any TPDO shows
    it. Unreadable values come from bus.yml or the EDS.

    Raises:
        SdoError: The device does not answer.
    """
    read: dict[tuple[int, int], Number | None] = {}  # several targets start with one position
    for output, position, mapped in _mapped(node):
        value, source = None, _source(node, mapped)
        if source is not None:
            address = source.index, source.subindex
            entry = node.config.dictionary.get(*address)
            if address not in read and (entry is None or entry.access.readable):
                read[address] = None
                with suppress(SdoAbortError, CodecError):
                    read[address] = await _present(node, source, timeout)
            value = read.get(address)
        output.values[position] = start_value(node.config, mapped) if value is None else value


def _source(node: RemoteNode, mapped: MappedObject) -> MappedObject | None:
    """Return the object that holds the initial value; None if the driver sets it."""
    index = mapped.index
    first_axis, axis = axis_of(index)
    if node.config.is_drive and (first_axis, mapped.subindex) in POSITION_TARGETS:
        return replace(mapped, index=Index.POSITION_ACTUAL + AXIS_OFFSET * axis, subindex=0)
    if first_axis == Index.MODE_OF_OPERATION:
        return mapped
    offset = node.config.is_drive and first_axis in OFFSETS
    return None if offset or index in node.config.commanded_indices else mapped


def _mapped(node: RemoteNode) -> list[tuple[SentRpdo, int, MappedObject]]:
    return [
        (output, position, mapped)
        for output in node.image.rpdos
        for position, mapped in enumerate(output.config.mapping)
        if mapped.index > DUMMY_MAX
    ]


async def _present(node: RemoteNode, mapped: MappedObject, timeout: float) -> Number:
    value = decode(mapped.data_type, await node.sdo.read(mapped.index, mapped.subindex, timeout))
    if not isinstance(value, (int, float)):
        raise CodecError(f'{_place(mapped)} is no number')
    return value


def _place(mapped: MappedObject) -> str:
    return object_address(mapped.index, mapped.subindex)
