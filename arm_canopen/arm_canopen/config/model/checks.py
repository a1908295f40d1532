# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of a bus.yml as a whole, beyond what each file by itself allows.

``load_bus`` refuses files that are invalid or cannot run. The checks here find settings that run
but do not work as intended: mismatches between devices and master, and an overloaded bus. Checks
of single devices are in ``device_checks`` and ``drive_units``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
import math

from canopen_core import Findings, Place, Problem
from canopen_core.can import frame_bits, PAYLOAD_MAX, stuff_bits_mean, stuff_bits_worst
from canopen_core.standard import (
    AXIS_OFFSET,
    CAN_ID_MASK,
    COB_ID_INVALID,
    CobId,
    Index,
    object_address,
    SYNC_PRODUCER,
    SYNCHRONOUS_MAX,
)

from ..keys import MICROSECONDS
from .boot_plan import boot_writes, WATCH_KEY
from .bus import BusConfig, NodeConfig, PdoConfig, TPDO
from .device_checks import check_drive, check_io_device, check_pdos, Subject
from .drive_units import axis_units, AxisUnits, check_units

HIGH_LOAD = 0.7  # bus load above which frames of low priority are delayed noticeably


@dataclass(frozen=True, slots=True)
class Report:
    """Result of checking a bus."""

    errors: tuple[Problem, ...]  # settings that cannot work
    warnings: tuple[Problem, ...]  # settings that work but are probably unintended
    # estimated bus load, None if the file could not be read
    load: LoadEstimate | None = None
    units: tuple[AxisUnits, ...] = ()  # meaning of a target of 1.0 for each axis


def check_bus(
    config: BusConfig, bitrate: int | None = None, findings: Findings | None = None
) -> Report:
    """Check a bus as a whole.

    ``bitrate`` in [bit/s] overrides bus.yml; ``findings`` holds the problems found so far.
    """
    findings = Findings() if findings is None else findings
    subjects = [Subject(config, node, findings) for node in config.nodes]
    check_master(config, findings)
    for subject in subjects:
        for check in DEVICE_CHECKS:
            check(subject)
    check_identifiers(subjects)
    load = estimate_load(config, bitrate)
    _check_load(config, load, findings)
    warnings = sorted(findings.warnings, key=lambda problem: (str(problem.file), problem.line))
    units = tuple(
        axis_units(subject, axis)
        for subject in subjects
        if subject.node.is_drive
        for axis in subject.node.axes
    )
    return Report(findings.errors, tuple(warnings), load, units)


def _check_load(config: BusConfig, load: LoadEstimate, findings: Findings) -> None:
    if load.load <= HIGH_LOAD:
        return
    place = config.place_of('master', 'sync_period')
    at = f'{load.frames_per_second:.0f} frames/s at {load.bitrate / 1000:g} kbit/s'
    remedy = 'make sync_period longer, map fewer or shorter PDOs, or raise the bit rate'
    if load.load > 1:
        message = f'the bus cannot carry this: {at} are a load of {load.load:.0%}'
        findings.error(place, message, remedy)
    else:
        message = f'{at} are a load of {load.load:.0%} ({load.load_worst:.0%} at worst)'
        findings.warning(place, message, remedy)


LATE_FACTOR = 1.5  # shortest consumer time, in heartbeat periods


def check_master(config: BusConfig, findings: Findings) -> None:
    """Check the heartbeat of the master."""
    master = config.master
    producer, cycle = master.heartbeat_producer, master.cycle_period
    if not producer:
        findings.warning(
            config.place_of('master', 'heartbeat_producer'),
            'the master sends no heartbeat: no device notices when it dies',
            'write heartbeat_producer: 200',
        )
        return
    real = math.ceil(producer / cycle - 1e-9) * cycle
    if master.heartbeat_timeout < LATE_FACTOR * real:
        findings.warning(
            config.place_of('master', 'heartbeat_producer'),
            f'devices wait {master.heartbeat_timeout * 1e3:g} ms for the heartbeat of the master, '
            f'which comes every {real * 1e3:g} ms (with a cycle): one that is late is a fault',
            'take a larger heartbeat_multiplier, 3 is usual',
        )


def check_heartbeats(subject: Subject) -> None:
    """Check the heartbeat supervision between a device, the master and other nodes."""
    node = subject.node
    producer = node.heartbeat_producer
    if not producer and not node.uses_node_guarding:
        subject.findings.warning(
            subject.place('heartbeat_producer'),
            'the device sends no heartbeat, and has no guard_time: its loss goes unnoticed',
            'write heartbeat_producer: 100',
        )
    elif producer and not node.heartbeat_timeout:
        subject.findings.warning(
            subject.bus.place_of('master', 'heartbeat_consumer'),
            'the master does not watch the heartbeats of the devices',
            'remove heartbeat_consumer: false',
        )
    elif producer and node.heartbeat_timeout < LATE_FACTOR * producer:
        subject.findings.warning(
            subject.place('heartbeat_multiplier'),
            f'the master waits {node.heartbeat_timeout * 1e3:g} ms for a heartbeat that comes '
            f'every {producer * 1e3:g} ms: one that is late counts as a loss',
            'take a larger heartbeat_multiplier, 3 is usual',
        )
    _check_watches_master(subject)
    _check_first_boot(subject)
    _check_consumer_limit(subject)


def _check_watches_master(subject: Subject) -> None:
    node = subject.node
    if node.is_drive and subject.bus.master.heartbeat_producer and not node.heartbeat_consumer:
        if node.dictionary.get(Index.CONSUMER_HEARTBEAT, 1) is None:
            remedy = 'its EDS has no 0x1016:01; have an emergency stop that needs no bus'
        elif node.reset_communication:
            remedy = 'remove heartbeat_consumer: false'
        else:  # reset_communication: false demands that
            remedy = 'it waits for the next one to take it over; have an emergency stop'
        what = 'the drive does not watch the master, and goes on when that dies'
        subject.findings.warning(subject.place('heartbeat_consumer'), what, remedy)
    elif node.is_drive and node.heartbeat_consumer and not node.reset_communication:
        subject.findings.warning(
            subject.place('reset_communication'),
            'the drive shall be taken over as it runs, but watches the master: should that die, '
            'it stops by itself, and there is nothing to take over',
            'write heartbeat_consumer: false, or remove reset_communication: false',
        )


def _check_first_boot(subject: Subject) -> None:
    """Warn if a device that is powered up before the master would not boot without a reset."""
    node = subject.node
    producer = node.dictionary.get(Index.PRODUCER_HEARTBEAT)
    says_state = node.uses_node_guarding or node.dictionary.get(Index.GUARD_TIME) is not None
    if node.reset_communication or not node.boot or says_state or (producer and producer.default):
        return
    subject.findings.warning(
        subject.place('reset_communication'),
        'a device that is switched on before the master does not boot this way: its EDS has 0 in '
        '0x1017 and no node guarding, so its state is unknown, and it is left '
        'alone',
        'call ~/nmt_reset_node once after it was switched on, or remove reset_communication: '
        'false',
    )


def _check_consumer_limit(subject: Subject) -> None:
    """Check the 0x1016 entry written at boot against the limits of the EDS."""
    node = subject.node
    for write in boot_writes(subject.bus, node):
        entry = node.dictionary.get(*write.address)
        value = int.from_bytes(write.data, 'little')
        highest = entry.high_limit if entry is not None else None
        if write.key == WATCH_KEY and highest is not None and value > highest:
            subject.findings.warning(
                subject.place(WATCH_KEY),
                f'the device will refuse to watch the master: {write.place} takes at most '
                f'0x{int(highest):X} by its EDS, and 0x{value:X} is written (node id in bits 16 '
                'to 23, time in ms in bits 0 to 15)',
                'make heartbeat_producer or heartbeat_multiplier of the master smaller, or write '
                'heartbeat_consumer: false',
            )


def check_sync(subject: Subject) -> None:
    """Check that device and master use the same SYNC settings."""
    master = subject.bus.master
    sync = subject.value(Index.SYNC_COB_ID)
    if sync is not None and sync & SYNC_PRODUCER:
        subject.findings.error(
            subject.object_place(Index.SYNC_COB_ID, 0),
            f'the device sends SYNC itself (0x1005 is 0x{sync:08X}), the master does, too',
            'write 0x80 to 0x1005',
        )
    elif sync is not None and sync & CAN_ID_MASK != CobId.SYNC:
        subject.findings.warning(
            subject.object_place(Index.SYNC_COB_ID, 0),
            f'the device waits for SYNC on 0x{sync & CAN_ID_MASK:03X}, the master sends 0x080',
            'write 0x80 to 0x1005',
        )
    if not master.sync_period:
        return
    period = subject.value(Index.CYCLE_PERIOD)
    wanted = round(master.sync_period * MICROSECONDS)
    if period and period != wanted:
        subject.findings.warning(
            subject.object_place(Index.CYCLE_PERIOD, 0),
            f'the device expects SYNC every {period} us (0x1006), it comes every {wanted} us',
            f'write {wanted} to 0x1006',
        )
    window = subject.value(Index.SYNC_WINDOW)
    if window and window >= wanted:
        subject.findings.warning(
            subject.object_place(Index.SYNC_WINDOW, 0),
            f'the synchronous window of {window} us (0x1007) is as long as the SYNC period',
            f'take less than {wanted}',
        )
    overflow = subject.value(Index.SYNC_OVERFLOW)
    if overflow is not None and overflow != master.sync_overflow:
        subject.findings.warning(
            subject.object_place(Index.SYNC_OVERFLOW, 0),
            f'the device expects the SYNC counter to end at {overflow} (0x1019), the master '
            f'counts to {master.sync_overflow}; 0 is a SYNC without counter',
            f'write {master.sync_overflow} to 0x1019',
        )


def check_writes(subject: Subject) -> None:
    """Warn about objects that are written twice with different values."""
    last = {(w.index, w.subindex): w for w in subject.node.sdo_writes}
    for write in subject.node.sdo_writes:
        kept = last[write.index, write.subindex]
        if write.data != kept.data and write.place.line:
            subject.findings.warning(
                write.place,
                f'{object_address(write.index, write.subindex)} is written again in line '
                f'{kept.place.line} with another value',
                'keep one of them, unless the device needs both in this order',
            )


def check_identifiers(subjects: Sequence[Subject]) -> None:
    """Refuse COB-IDs used by two services, and EMCYs where the master does not listen."""
    owners: dict[int, tuple[str, Place]] = {}
    for subject in subjects:
        for pdo in subject.pdos():
            title = f'{pdo.title} of {subject.node.name}'
            owners.setdefault(pdo.cob_id, (title, subject.pdo_place(pdo, 'cob_id')))
    for subject in subjects:
        _check_emergency(subject)
        value = subject.value(Index.EMCY_COB_ID)
        is_written = subject.node.write_of(Index.EMCY_COB_ID, 0) is not None
        if not is_written or value is None or value & COB_ID_INVALID:
            continue
        cob_id, title = value & CAN_ID_MASK, f'EMCY of {subject.node.name}'
        place = subject.object_place(Index.EMCY_COB_ID, 0)
        other, where = owners.setdefault(cob_id, (title, place))
        if other != title:
            subject.findings.error(
                place,
                f'COB-ID 0x{cob_id:03X} of {title} is also that of {other} (line {where.line})',
                'give each an identifier of its own',
            )


def _check_emergency(subject: Subject) -> None:
    """Warn if the EMCY COB-ID of the EDS belongs to another node id; 0 and 0x80 are usual."""
    entry, node = subject.node.dictionary.get(Index.EMCY_COB_ID), subject.node
    if entry is None or entry.literal is None or node.write_of(Index.EMCY_COB_ID, 0) is not None:
        return
    cob_id = entry.literal & CAN_ID_MASK
    if cob_id not in (0, CobId.EMCY):
        own = CobId.EMCY + node.node_id
        subject.findings.warning(
            subject.object_place(Index.EMCY_COB_ID, 0),
            f'the EMCY COB-ID 0x{cob_id:03X} (0x1014) of the EDS is not that of node '
            f'{node.node_id}; the master listens at 0x{own:03X}',
            f'correct it to $NODEID+0x80, or write 0x{own:X} to 0x1014',
        )


POLLED = (Index.STATUSWORD, Index.MODE_OF_OPERATION_DISPLAY, Index.POSITION_ACTUAL)
"""State of an axis that the master reads by SDO where no TPDO carries it."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """Bus traffic of one service."""

    device: str  # name of the device, or of the master
    service: str  # such as ``TPDO 1``, ``SYNC``, ``heartbeat``
    cob_id: int  # COB-ID
    size: int  # payload of a frame in [byte]
    rate: float  # frames in [1/s]
    reason: str  # what determines the rate

    @property
    def bits(self) -> float:
        """Bits on the bus in [bit/s], with the stuff bits of random data."""
        return self.rate * (frame_bits(self.size) + stuff_bits_mean(self.size))

    @property
    def bits_worst(self) -> float:
        """Bits on the bus in [bit/s], with the largest possible number of stuff bits."""
        return self.rate * (frame_bits(self.size) + stuff_bits_worst(self.size))


@dataclass(frozen=True, slots=True)
class LoadEstimate:
    """Estimated bus load when every device is operational.

    It excludes EMCY, NMT and SDO transfers other than polling: they are rare, and have a small
    effect on cyclic traffic.
    """

    bitrate: int  # bit rate in [bit/s]
    traffic: tuple[Traffic, ...]  # all services with a rate

    @property
    def frames_per_second(self) -> float:
        """Total frame rate in [1/s]."""
        return sum(item.rate for item in self.traffic)

    @property
    def load(self) -> float:
        """Share of time that the bus is busy, with the stuff bits of random data."""
        return sum(item.bits for item in self.traffic) / self.bitrate

    @property
    def load_worst(self) -> float:
        """Share of time that the bus is busy, with the largest number of stuff bits."""
        return sum(item.bits_worst for item in self.traffic) / self.bitrate


def estimate_load(config: BusConfig, bitrate: int | None = None) -> LoadEstimate:
    """Estimate the load of a bus; ``bitrate`` in [bit/s] overrides bus.yml."""
    traffic = [*_master_traffic(config)]
    for node in config.nodes:
        subject = Subject(config, node, Findings())
        traffic += _periodic(
            node.name, 'heartbeat', CobId.HEARTBEAT + node.node_id, 1, node.heartbeat_producer
        )
        for pdo in subject.pdos():
            size = min((sum(mapped.bits for mapped in pdo.mapping) + 7) // 8, PAYLOAD_MAX)
            rate, reason = _rate(subject, pdo)
            traffic.append(Traffic(node.name, pdo.title, pdo.cob_id, size, rate, reason))
        traffic += _guarding(node)
        traffic += _polling(subject)
    return LoadEstimate(bitrate or config.master.bitrate, tuple(traffic))


def _periodic(
    device: str, service: str, cob_id: int, size: int, period: float
) -> Iterator[Traffic]:
    """Yield a periodic service of a device; none for a ``period`` of 0 (in [s])."""
    if period > 0:
        yield Traffic(device, service, cob_id, size, 1 / period, f'every {period * 1e3:g} ms')


def _master_traffic(config: BusConfig) -> Iterator[Traffic]:
    master = config.master
    name, heartbeat = master.name, CobId.HEARTBEAT + master.node_id
    time_id = master.time_cob_id & CAN_ID_MASK
    counter = 1 if master.sync_overflow else 0  # [byte]
    yield from _periodic(name, 'SYNC', CobId.SYNC, counter, master.sync_period)
    yield from _periodic(name, 'heartbeat', heartbeat, 1, master.heartbeat_producer)
    yield from _periodic(name, 'TIME', time_id, 6, master.time_period)


def _guarding(node: NodeConfig) -> Iterator[Traffic]:
    """Yield request and response of node guarding (CiA 301, 7.2.8.2.2)."""
    if node.uses_node_guarding:
        for size in (0, 1):
            cob_id = CobId.HEARTBEAT + node.node_id
            yield from _periodic(node.name, 'guarding', cob_id, size, node.guard_time)


def _polling(subject: Subject) -> Iterator[Traffic]:
    """Yield SDO request and response of polled drive objects, which no TPDO carries."""
    node, cycle = subject.node, subject.bus.master.cycle_period
    axes = node.axes if node.is_drive else ()
    indices = [index + AXIS_OFFSET * axis.channel for axis in axes for index in POLLED]
    for index in indices:
        if subject.carriers(TPDO, index) or node.dictionary.get(index, 0) is None:
            continue
        # answers arrive in the next cycle, which starts the next period
        rate = 1 / (node.poll_period + cycle)
        service, reason = f'SDO {object_address(index)}', 'polled, as no TPDO carries it'
        for cob_id in (CobId.SDO_REQUEST, CobId.SDO_RESPONSE):
            yield Traffic(node.name, service, cob_id + node.node_id, PAYLOAD_MAX, rate, reason)


def _rate(subject: Subject, pdo: PdoConfig) -> tuple[float, str]:
    """Return the rate of a PDO in [1/s], and the reason for it."""
    master = subject.bus.master
    if pdo.direction is not TPDO:
        if not subject.node.is_drive:
            return 0.0, 'when a value is sent'
        return 1 / master.cycle_period, 'every cycle'
    if pdo.transmission <= SYNCHRONOUS_MAX:
        if not master.sync_period:
            return 0.0, 'never, there is no SYNC'
        divisor = max(pdo.transmission, 1)
        reason = 'every SYNC' if divisor == 1 else f'every {divisor}th SYNC'
        return 1 / (master.sync_period * divisor), reason if pdo.transmission else (
            'with SYNC on change, taken as every SYNC'
        )
    if pdo.transmission < 254:
        return 0.0, 'on remote frames, which the master does not send'
    # sent on change: assume once per cycle, limited by the inhibit time
    inhibit, timer = subject.inhibit_time(pdo), subject.event_time(pdo)
    on_change = max(master.cycle_period, inhibit)
    if timer and timer <= on_change:
        return 1 / timer, f'event timer {timer * 1e3:g} ms'
    return 1 / on_change, f'on change, taken as every {on_change * 1e3:g} ms'


DEVICE_CHECKS: tuple[Callable[[Subject], None], ...] = (
    check_drive,
    check_io_device,
    check_units,
    check_pdos,
    check_heartbeats,
    check_sync,
    check_writes,
)
"""Checks of each device, in the order in which they report."""
