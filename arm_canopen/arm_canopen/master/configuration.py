# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Brings the boot plan into a device, or tells whether the device has it already."""

from __future__ import annotations

from collections.abc import Callable
import struct

from ..config.boot_plan import (
    boot_writes,
    BootWrite,
    choose_slot,
    ERROR_CONTROL,
    final_values,
    is_requested,
    WATCH_KEY,
    watch_slots,
    watch_word,
)
from ..config.model import BusConfig, SdoWrite
from ..exceptions import SdoAbortError, SdoError
from ..standard.objects import Index, PDO_COUNT_MAX
from .events import EventKind, Severity
from .remote_node import RemoteNode

ONCE = (Index.STORE_PARAMETERS, Index.RESTORE_PARAMETERS)
"""A device would store or restore its parameters as often as it is asked."""
PDO_OBJECTS = frozenset(
    first + number
    for first in (
        Index.RPDO_COMMUNICATION,
        Index.RPDO_MAPPING,
        Index.TPDO_COMMUNICATION,
        Index.TPDO_MAPPING,
    )
    for number in range(PDO_COUNT_MAX)
)
LIFE_SIGNS = frozenset(index for index, _, _ in ERROR_CONTROL)
UNWATCHED = (
    'so it goes on with its last command when the master dies. Give it a time that it takes (the '
    "master's heartbeat_producer times heartbeat_multiplier), or write heartbeat_consumer: false "
    'to its section of bus.yml, and have an emergency stop that needs no bus'
)


class Configurator:
    """Brings the boot plan into one device, or compares the two."""

    def __init__(
        self,
        node: RemoteNode,
        bus: BusConfig,
        *,
        on_write: Callable[[str], None],
    ) -> None:
        """Take what is needed.

        Args:
            node: The device.
            bus: The bus that it belongs to.
            on_write: Told each object before it is written.
        """
        self._node = node
        self._bus = bus
        self._sdo_timeout = bus.master.boot_timeout
        self._on_write = on_write
        self._plan = [w for w in boot_writes(bus, node.config) if w.key != WATCH_KEY]

    async def apply(self) -> None:
        """Write everything; the device must not process PDOs meanwhile.

        Raises:
            SdoError: The device refused something that bus.yml asks for, or does not answer.
        """
        await self._watch_master()
        for write in self._plan:
            await self._bring(write)

    async def write_error_control(self) -> None:
        """Have the device send its heartbeat or be guarded, its TPDOs come, and watch the master.

        Raises:
            SdoError: As with :meth:`apply`.
        """
        await self._watch_master()
        for write in self._plan:
            if write.index in LIFE_SIGNS or write.is_own_timer:
                await self._bring(write)

    async def differences(self) -> list[str]:
        """Compare the PDOs of a device that runs with those of bus.yml; in words.

        Raises:
            SdoError: The device does not answer.
        """
        found = []
        for write in final_values(self._plan):
            if write.index not in PDO_OBJECTS or write.is_own_timer:
                continue
            present = await self.read_number(*write.address)
            mask = write.mask or (1 << 8 * len(write.data)) - 1
            wanted = int.from_bytes(write.data, 'little') & mask
            if present & mask != wanted:
                found.append(f'{write.place} is 0x{present & mask:X} instead of 0x{wanted:X}')
        return found

    async def write(self, write: SdoWrite) -> None:
        """Write an object.

        Raises:
            SdoError: The device refused, or does not answer.
        """
        self._on_write(f'0x{write.index:04X}:{write.subindex:02X}')
        address, repeat = (write.index, write.subindex), write.index not in ONCE
        await self._node.sdo.write(*address, write.data, self._sdo_timeout, repeat=repeat)

    async def read_number(self, index: int, subindex: int) -> int:
        """Read an object as an unsigned number.

        Raises:
            SdoError: The device refused, or does not answer.
        """
        data = await self._node.sdo.read(index, subindex, self._sdo_timeout)
        return int.from_bytes(data, 'little')

    async def _bring(self, write: BootWrite) -> None:
        """Write an object, unless the device has what is wanted, or cannot take it."""
        data = write.data
        if write.mask is not None:  # a COB-ID, whose value is not enough to tell what is right
            present = await self.read_number(*write.address)
            data = write.over(present)
            if present == int.from_bytes(data, 'little'):
                return
        if write.is_own_timer:
            self._rely_on_timer(write.index, taken=True)
        try:
            await self.write(SdoWrite(*write.address, data))
        except SdoAbortError as error:
            if write.temporary or await self._holds(write):
                return  # where the writes that follow need it, they are refused, too
            refused = f'{error}; {write.key} asks for 0x{data[::-1].hex().upper()}'
            if write.requested:
                raise SdoError(f'{refused}: correct or remove it there') from error
            self._warn(f'{refused} by default only, so it goes on with what it has')
            if write.is_own_timer:
                self._rely_on_timer(write.index, taken=False)

    def _rely_on_timer(self, index: int, *, taken: bool) -> None:
        """Await a TPDO by its event timer, or no more, until the next boot."""
        for entry in self._node.image.inputs:
            if entry.config.number == index - Index.TPDO_COMMUNICATION + 1:
                entry.rely_on_timer(taken=taken)

    async def _holds(self, write: BootWrite) -> bool:
        """Tell whether a device that refused to be written has the value already."""
        try:
            return write.fits(await self._node.sdo.read(*write.address, self._sdo_timeout))
        except SdoAbortError:
            return False

    async def _watch_master(self) -> None:
        """Have the device watch the master, in an entry of 0x1016 that watches nobody else."""
        node = self._node
        word = watch_word(self._bus, node.config)
        slot, is_ours = await self._find_slot()
        node.watch_slot = 0
        if not slot:
            if word:
                self._warn(
                    f'watches others in all entries of 0x1016, and not the master, {UNWATCHED}'
                )
            return
        if not (word or is_ours):
            return
        write = SdoWrite(Index.CONSUMER_HEARTBEAT, slot, struct.pack('<I', word))
        try:
            await self.write(write)
        except SdoAbortError as error:
            refused = f'{error}: it does not take 0x{word:08X}'
            if word and is_requested(self._bus, node.config, WATCH_KEY):
                raise SdoError(f'{refused}, {UNWATCHED}') from error
            self._warn(f'{refused}, {UNWATCHED}')
        else:
            node.watch_slot = slot if word else 0

    async def _find_slot(self) -> tuple[int, bool]:
        """Return the entry of 0x1016 for the master, 0 for none, and whether it names it."""
        for subindex in watch_slots(self._node.config):
            try:
                entry = await self.read_number(Index.CONSUMER_HEARTBEAT, subindex)
            except SdoAbortError:
                # it cannot be read; a later one is promised by the EDS only
                return (subindex, False) if subindex == 1 else (0, False)
            slot, is_ours = choose_slot({subindex: entry}, self._bus.master.node_id)
            if slot:
                return slot, is_ours
        return 0, False

    def _warn(self, text: str) -> None:
        self._node.report(EventKind.BOOT, Severity.WARNING, text)
