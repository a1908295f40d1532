# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Booting one device: identity, configuration, error control, start (CiA 302-2, 8.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import struct

from ..config.model import Identity, PdoConfig, SdoWrite
from ..exceptions import BootError, SdoAbortError, SdoError, SdoTimeoutError
from ..standard.cob_id import COB_ID_INVALID, RTR_FORBIDDEN
from ..standard.nmt import NmtCommand
from ..standard.objects import Index
from .events import EventKind, Severity
from .remote_node import BootPhase, RemoteNode
from .scheduler import Promise, Scheduler

IDENTITY_SUBINDICES: tuple[tuple[str, int, str], ...] = (
    ('vendor_id', 1, 'vendor id'),
    ('product_code', 2, 'product code'),
    ('revision_number', 3, 'revision number'),
    ('serial_number', 4, 'serial number'),
)
"""Attribute of Identity, sub-index of 0x1018 and its name (CiA 301, 7.5.2.19)."""

ONCE = (Index.STORE_PARAMETERS, Index.RESTORE_PARAMETERS)


class BootProcess:
    """Brings one device to operational, again and again until it is.

    A device is noticed by its boot-up message or by its answer to a read of 0x1000, whatever comes
    first, so one that missed the reset is found too.
    """

    def __init__(
        self,
        node: RemoteNode,
        scheduler: Scheduler,
        send_nmt: Callable[[NmtCommand, int], None],
        *,
        sdo_timeout: float,
        start: bool,
        master_id: int,
        master_heartbeat_timeout: float,
    ) -> None:
        """Take what is needed of the network.

        Args:
            node: The device.
            scheduler: Time.
            send_nmt: Sends an NMT command to a node id.
            sdo_timeout: How long each SDO answer may take in [s].
            start: Start the device when it is configured.
            master_id: Node id of the master, which the device shall watch.
            master_heartbeat_timeout: How long the device waits for the master's heartbeat in [s];
                0 when the master sends none.
        """
        self._node = node
        self._scheduler = scheduler
        self._send_nmt = send_nmt
        self._sdo_timeout = sdo_timeout
        self._start = start
        self._master_id = master_id
        self._master_heartbeat_timeout = master_heartbeat_timeout
        self._told = ''

    async def run(self, *, announced: bool, pause: float = 0.0) -> None:
        """Boot the device; returns when it is operational.

        Args:
            announced: A boot-up message came, so there is no need to look for the device.
            pause: Time to wait before in [s].
        """
        if pause > 0.0:
            self._enter(BootPhase.WAITING)
            await self._scheduler.timer(pause)
        while not await self._attempt(announced=announced):
            announced = False
            await self._scheduler.timer(self._node.config.boot_timeout)

    async def _attempt(self, *, announced: bool) -> bool:
        try:
            if not announced:
                self._enter(BootPhase.WAITING)
                while not await self._answers():
                    self._tell_once(
                        'no answer yet: neither a boot-up message nor an answer to 0x1000; is it '
                        'powered, wired, terminated, on this bit rate and on node id '
                        f'{self._node.config.node_id}?'
                    )
            await self._boot()
        except (BootError, SdoError) as error:
            self._fail(str(error))
            return False
        return True

    async def _answers(self) -> bool:
        """Ask for 0x1000; any answer will do."""
        try:
            await self._node.sdo.read(Index.DEVICE_TYPE, 0, self._node.config.boot_timeout)
        except SdoTimeoutError:
            return False
        except SdoAbortError:
            return True
        return True

    async def _boot(self) -> None:
        node = self._node
        self._enter(BootPhase.IDENTITY)
        await self._check_identity(node.config.identity)
        # PDO parameters may only be written while the device does not process PDOs
        self._send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node.config.node_id)
        configured_at = self._scheduler.now
        for write in self._error_control_writes():
            await self._write(write)
        for pdo in node.config.rpdos:
            await self._configure(pdo, Index.RPDO_COMMUNICATION, Index.RPDO_MAPPING)
        for pdo in node.config.tpdos:
            await self._configure(pdo, Index.TPDO_COMMUNICATION, Index.TPDO_MAPPING)
        for write in node.config.sdo_writes:
            await self._write(write)
        # not waiting for the first heartbeat saves its period; its absence is noticed all the
        # same, and only a device that once was without it has to show it first
        if node.owes_heartbeat:
            await self._await_heartbeat(configured_at)
        self._enter(BootPhase.STARTING)
        if self._start:
            self._send_nmt(NmtCommand.START, node.config.node_id)
        node.go_online(self._scheduler.now)
        self._told = ''
        self._enter(BootPhase.OPERATIONAL)
        started = 'operational' if self._start else 'configured; start_nodes is false in bus.yml'
        node.report(EventKind.BOOT, Severity.INFO, started)

    async def _check_identity(self, expected: Identity) -> None:
        if expected.device_type:
            found = await self._read_u32(Index.DEVICE_TYPE, 0)
            self._compare('device type', expected.device_type, found, 'dcf (0x1000)')
        for attribute, subindex, title in IDENTITY_SUBINDICES:
            wanted = getattr(expected, attribute)
            if wanted:
                found = await self._read_u32(Index.IDENTITY, subindex)
                self._compare(title, wanted, found, attribute)

    def _compare(self, title: str, expected: int, found: int, key: str) -> None:
        if expected != found:
            raise BootError(
                f'{self._node.name} (node {self._node.config.node_id}) is another device: {title} '
                f'0x{found:08X}, expected 0x{expected:08X}; correct {key} in bus.yml or use the '
                'EDS of this device'
            )

    def _error_control_writes(self) -> Iterator[SdoWrite]:
        node = self._node.config
        if self._is_writable(Index.PRODUCER_HEARTBEAT, 0):
            period = round(node.heartbeat_producer * 1000)  # [ms]
            yield SdoWrite(Index.PRODUCER_HEARTBEAT, 0, struct.pack('<H', period))
        if self._is_writable(Index.CONSUMER_HEARTBEAT, 1):
            watched = (
                round(self._master_heartbeat_timeout * 1000) if node.heartbeat_consumer else 0
            )
            entry = self._master_id << 16 | watched if watched else 0
            yield SdoWrite(Index.CONSUMER_HEARTBEAT, 1, struct.pack('<I', entry))

    def _is_writable(self, index: int, subindex: int) -> bool:
        entry = self._node.config.dictionary.get(index, subindex)
        return entry is not None and entry.access.writable

    async def _configure(self, pdo: PdoConfig, communication: int, mapping: int) -> None:
        if not pdo.configured:
            return
        # the identifier may not change while the PDO is valid, so it is disabled as it stands
        present = await self._read_u32(communication + pdo.number - 1, 1)
        await self._write(_u32(communication + pdo.number - 1, 1, present | COB_ID_INVALID))
        # a device without remote frames refuses a COB-ID that allows them, so the bit is kept
        rtr = present & RTR_FORBIDDEN if communication == Index.TPDO_COMMUNICATION else 0
        for write in pdo_writes(pdo, communication, mapping, cob_id_flags=rtr):
            await self._write(write)

    async def _await_heartbeat(self, since: float) -> None:
        node = self._node
        timeout = node.config.heartbeat_timeout
        self._enter(BootPhase.ERROR_CONTROL)
        try:
            await self._scheduler.until(lambda: node.last_heartbeat > since, timeout)
        except TimeoutError:
            raise BootError(
                f'{node.name} (node {node.config.node_id}) sent no heartbeat within '
                f'{timeout * 1000:g} ms although 0x1017 was written; it is not started, because '
                'its loss would go unnoticed: does it support heartbeat_producer?'
            ) from None

    async def _write(self, write: SdoWrite) -> None:
        self._enter(BootPhase.CONFIGURING, f'0x{write.index:04X}:{write.subindex:02X}')
        address, timeout = (write.index, write.subindex), self._sdo_timeout
        # a device would store or restore its parameters as often as it is asked
        repeat = write.index not in ONCE
        await self._node.sdo.write(*address, write.data, timeout, repeat=repeat)

    def _read(self, index: int, subindex: int) -> Promise[bytes]:
        return self._node.sdo.read(index, subindex, self._sdo_timeout)

    async def _read_u32(self, index: int, subindex: int) -> int:
        return int.from_bytes(await self._read(index, subindex), 'little')

    def _enter(self, phase: BootPhase, detail: str = '') -> None:
        self._node.phase = phase
        self._node.phase_detail = detail

    def _fail(self, reason: str) -> None:
        step = self._node.phase.value
        self._enter(BootPhase.FAILED, f'{step}: {reason}')
        self._tell_once(f'boot failed while {step}: {reason}')

    def _tell_once(self, text: str) -> None:
        """Say a reason when it is new; it is tried again for ever, but not said again."""
        if text != self._told:
            self._told = text
            self._node.report(EventKind.BOOT_FAILED, Severity.WARNING, text)


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


def _u8(index: int, subindex: int, value: int) -> SdoWrite:
    return SdoWrite(index, subindex, struct.pack('<B', value))


def _u16(index: int, subindex: int, value: int) -> SdoWrite:
    return SdoWrite(index, subindex, struct.pack('<H', value))


def _u32(index: int, subindex: int, value: int) -> SdoWrite:
    return SdoWrite(index, subindex, struct.pack('<I', value))
