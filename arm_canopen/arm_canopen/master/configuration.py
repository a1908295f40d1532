# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is written to a device at boot, in which order, and whether a device has it already."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
import struct

from ..config.model import PdoConfig, SdoWrite
from ..exceptions import SdoAbortError, SdoError
from ..standard.cob_id import CAN_ID_MASK, COB_ID_INVALID, RTR_FORBIDDEN
from ..standard.objects import Index
from .events import EventKind, Severity
from .remote_node import RemoteNode

ONCE = (Index.STORE_PARAMETERS, Index.RESTORE_PARAMETERS)
"""A device would store or restore its parameters as often as it is asked."""
FIRST_SLOT = 1  # sub-index of 0x1016
_PDO_KINDS = (
    (Index.RPDO_COMMUNICATION, Index.RPDO_MAPPING),
    (Index.TPDO_COMMUNICATION, Index.TPDO_MAPPING),
)


class Configurator:
    """Brings the configuration of bus.yml into one device, or compares the two."""

    def __init__(
        self,
        node: RemoteNode,
        *,
        sdo_timeout: float,
        master_id: int,
        master_heartbeat_timeout: float,
        on_write: Callable[[str], None],
    ) -> None:
        """Take what is needed.

        Args:
            node: The device.
            sdo_timeout: How long each SDO answer may take in [s].
            master_id: Node id of the master, which the device shall watch.
            master_heartbeat_timeout: How long the device waits for the master's heartbeat in [s];
                0 when the master sends none.
            on_write: Told each object before it is written.
        """
        self._node = node
        self._sdo_timeout = sdo_timeout
        self._master_id = master_id
        self._master_heartbeat_timeout = master_heartbeat_timeout
        self._on_write = on_write

    async def apply(self) -> None:
        """Write everything; the device must not process PDOs meanwhile.

        Raises:
            SdoError: The device refused something, or does not answer.
        """
        await self._write_parameter_values()
        await self.write_error_control()
        for pdo, communication, mapping in self._pdos():
            await self._configure(pdo, communication, mapping)
        for write in self._node.config.sdo_writes:
            await self.write(write)

    async def _write_parameter_values(self) -> None:
        config = self._node.config
        try:
            for write in config.parameter_writes:
                await self.write(write)
        except SdoAbortError as error:
            raise SdoError(
                f'{error}; it is a ParameterValue of {config.eds.name}: correct or remove it there'
            ) from error

    async def write_error_control(self) -> None:
        """Have the device send its heartbeat or be guarded, and watch the master.

        Raises:
            SdoError: The device refused something, or does not answer.
        """
        for write in self._life_sign_writes():
            await self.write(write)
        await self._write_consumer()

    async def differences(self) -> list[str]:
        """Compare the PDOs of a device that runs with those of bus.yml; in words.

        Raises:
            SdoError: The device does not answer.
        """
        found = []
        for pdo, communication, mapping in self._pdos():
            if not pdo.configured:
                continue
            for (index, subindex), wanted in _final_values(pdo, communication, mapping):
                present = await self.read_number(index, subindex)
                if (index, subindex) == (communication + pdo.number - 1, 1):
                    present &= COB_ID_INVALID | CAN_ID_MASK if pdo.enabled else COB_ID_INVALID
                if present != wanted:
                    place = f'0x{index:04X}:{subindex:02X}'
                    found.append(f'{place} is 0x{present:X} instead of 0x{wanted:X}')
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

    def _pdos(self) -> Iterator[tuple[PdoConfig, int, int]]:
        config = self._node.config
        for pdos, (communication, mapping) in zip(
            (config.rpdos, config.tpdos), _PDO_KINDS, strict=True
        ):
            for pdo in pdos:
                yield pdo, communication, mapping

    def _life_sign_writes(self) -> Iterator[SdoWrite]:
        config = self._node.config
        if self._is_writable(Index.PRODUCER_HEARTBEAT, 0):
            yield _u16(Index.PRODUCER_HEARTBEAT, 0, round(config.heartbeat_producer * 1000))
        if config.guarded:
            yield _u16(Index.GUARD_TIME, 0, round(config.guard_time * 1000))
            yield _u8(Index.LIFE_TIME_FACTOR, 0, config.life_time_factor)

    async def _write_consumer(self) -> None:
        """Have the device watch the master, in an entry of 0x1016 that watches nobody else."""
        node = self._node
        watched = round(self._master_heartbeat_timeout * 1000)  # [ms]
        wanted = bool(watched and node.config.heartbeat_consumer)
        slot, is_ours = await self._find_slot()
        node.watch_slot = slot if wanted else 0
        if slot and (wanted or is_ours):
            entry = self._master_id << 16 | watched if wanted else 0
            await self.write(_u32(Index.CONSUMER_HEARTBEAT, slot, entry))
        elif wanted:
            text = 'watches other devices in all entries of 0x1016, and not the master'
            node.report(EventKind.BOOT, Severity.WARNING, text)

    async def _find_slot(self) -> tuple[int, bool]:
        """Return the entry of 0x1016 for the master, 0 for none, and whether it names it."""
        subindex = FIRST_SLOT
        while self._is_writable(Index.CONSUMER_HEARTBEAT, subindex):
            try:
                entry = await self.read_number(Index.CONSUMER_HEARTBEAT, subindex)
            except SdoAbortError:
                # it cannot be read; a later one is promised by the EDS only
                return subindex if subindex == FIRST_SLOT else 0, False
            is_ours = entry >> 16 & 0x7F == self._master_id
            if is_ours or not entry & 0xFFFF:
                return subindex, is_ours
            subindex += 1
        return 0, False

    def _is_writable(self, index: int, subindex: int) -> bool:
        entry = self._node.config.dictionary.get(index, subindex)
        return entry is not None and entry.access.writable

    async def _configure(self, pdo: PdoConfig, communication: int, mapping: int) -> None:
        if not pdo.configured:
            return
        # the identifier may not change while the PDO is valid, so it is disabled as it stands
        index = communication + pdo.number - 1
        present = await self.read_number(index, 1)
        await self.write(_u32(index, 1, present | COB_ID_INVALID))
        # a device without remote frames refuses a COB-ID that allows them, so the bit is kept
        rtr = present & RTR_FORBIDDEN if communication == Index.TPDO_COMMUNICATION else 0
        for write in pdo_writes(pdo, communication, mapping, cob_id_flags=rtr):
            await self.write(write)


def pdo_writes(
    pdo: PdoConfig, communication: int, mapping: int, *, cob_id_flags: int = 0
) -> Iterator[SdoWrite]:
    """List the writes that configure a PDO which is disabled already (CiA 301, 7.5.2.36).

    Parameters, clear the mapping, map, set the count, enable. A mapping that the device has for
    ever is left alone.

    Args:
        pdo: The PDO.
        communication: Index of the first communication parameter (0x1400 or 0x1800).
        mapping: Index of the first mapping parameter (0x1600 or 0x1A00).
        cob_id_flags: Bits of the COB-ID object beside the identifier.
    """
    if not pdo.enabled:
        return
    communication += pdo.number - 1
    yield _u8(communication, 2, pdo.transmission)
    if pdo.inhibit_time is not None:
        yield _u16(communication, 3, round(pdo.inhibit_time * 10_000))  # [100 us]
    if pdo.event_time is not None:
        yield _u16(communication, 5, round(pdo.event_time * 1000))  # [ms]
    if pdo.sync_start is not None:
        yield _u8(communication, 6, pdo.sync_start)
    if not pdo.fixed_mapping:
        yield from _mapping_writes(pdo, mapping + pdo.number - 1)
    yield _u32(communication, 1, pdo.cob_id | cob_id_flags)


def _mapping_writes(pdo: PdoConfig, index: int) -> Iterator[SdoWrite]:
    yield _u8(index, 0, 0)
    for subindex, mapped in enumerate(pdo.mapping, start=1):
        yield _u32(index, subindex, mapped.word)
    yield _u8(index, 0, len(pdo.mapping))


def _final_values(
    pdo: PdoConfig, communication: int, mapping: int
) -> Iterable[tuple[tuple[int, int], int]]:
    """Return what the objects of a PDO hold when it is configured, by index and sub-index."""
    if not pdo.enabled:
        return [((communication + pdo.number - 1, 1), COB_ID_INVALID)]
    values = {  # of an object that is written twice, the last value
        (write.index, write.subindex): int.from_bytes(write.data, 'little')
        for write in pdo_writes(pdo, communication, mapping)
    }
    return values.items()


def _u8(index: int, subindex: int, value: int) -> SdoWrite:
    return SdoWrite(index, subindex, struct.pack('<B', value))


def _u16(index: int, subindex: int, value: int) -> SdoWrite:
    return SdoWrite(index, subindex, struct.pack('<H', value))


def _u32(index: int, subindex: int, value: int) -> SdoWrite:
    return SdoWrite(index, subindex, struct.pack('<I', value))
