# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a bus will carry: every frame of a configuration with its rate, and the load."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from canopen_core import Findings
from canopen_core.can import frame_bits, PAYLOAD_MAX, stuff_bits_mean, stuff_bits_worst
from canopen_core.standard import (
    AXIS_OFFSET,
    CAN_ID_MASK,
    CobId,
    Index,
    object_address,
    SYNCHRONOUS_MAX,
)

from ..bus import BusConfig, NodeConfig
from ..pdo import Direction, PdoConfig, TPDO
from .subject import Subject

POLLED = (Index.STATUSWORD, Index.MODE_OF_OPERATION_DISPLAY, Index.POSITION_ACTUAL)
"""State of an axis that the master reads by SDO where no TPDO carries it."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """Frames of one service."""

    device: str  # name of the device whose service it is, or of the master
    service: str  # what they are: ``TPDO 1``, ``SYNC``, ``heartbeat``
    cob_id: int  # their identifier
    size: int  # length of the payload in [byte]
    rate: float  # frames in [1/s]
    reason: str  # why so many

    @property
    def bits(self) -> float:
        """Bits on the bus in [bit/s], with the stuffing of random content."""
        return self.rate * (frame_bits(self.size) + stuff_bits_mean(self.size))

    @property
    def bits_worst(self) -> float:
        """Bits on the bus in [bit/s], with the most stuffing that is possible."""
        return self.rate * (frame_bits(self.size) + stuff_bits_worst(self.size))


@dataclass(frozen=True, slots=True)
class LoadEstimate:
    """What a bus will carry when every device is operational.

    SDO that polls nothing, EMCY and NMT come on top; they are rare, and let everything cyclic
    pass.
    """

    bitrate: int  # bit rate in [bit/s]
    traffic: tuple[Traffic, ...]  # all services with a rate

    @property
    def frames_per_second(self) -> float:
        """All frames in [1/s]."""
        return sum(item.rate for item in self.traffic)

    @property
    def load(self) -> float:
        """Share of the time that the bus is busy, with the stuffing of random content."""
        return sum(item.bits for item in self.traffic) / self.bitrate

    @property
    def load_worst(self) -> float:
        """The same with the most stuffing that is possible."""
        return sum(item.bits_worst for item in self.traffic) / self.bitrate


def estimate_load(config: BusConfig, bitrate: int | None = None) -> LoadEstimate:
    """Estimate the load of a bus; the bit rate in [bit/s] replaces that of bus.yml."""
    traffic = [*_master_traffic(config)]
    for node in config.nodes:
        subject = Subject(config, node, Findings())
        traffic += _periodic(
            node.name, 'heartbeat', CobId.HEARTBEAT + node.node_id, 1, node.heartbeat_producer
        )
        traffic += [_pdo_traffic(subject, direction, pdo) for direction, pdo in subject.pdos()]
        traffic += _guarding(node)
        traffic += _polling(subject)
    return LoadEstimate(bitrate or config.master.bitrate, tuple(traffic))


def _periodic(
    device: str, service: str, cob_id: int, size: int, period: float
) -> Iterator[Traffic]:
    """Yield what a device sends on time; a period of 0 is never."""
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
    """Yield question and answer of node guarding (CiA 301, 7.2.8.2.2)."""
    if node.uses_node_guarding:
        for size in (0, 1):
            cob_id = CobId.HEARTBEAT + node.node_id
            yield from _periodic(node.name, 'guarding', cob_id, size, node.guard_time)


def _polling(subject: Subject) -> Iterator[Traffic]:
    """Yield request and response of the objects of a drive that no TPDO carries."""
    node, cycle = subject.node, subject.bus.master.cycle_period
    axes = node.axes if node.is_drive else ()
    indices = [index + AXIS_OFFSET * axis.channel for axis in axes for index in POLLED]
    for index in indices:
        if subject.carriers(TPDO, index) or node.dictionary.get(index, 0) is None:
            continue
        # the answers are there in the next cycle, and the time to the next reading begins
        rate = 1 / (node.poll_period + cycle)
        service, reason = f'SDO {object_address(index)}', 'polled, as no TPDO carries it'
        for cob_id in (CobId.SDO_REQUEST, CobId.SDO_RESPONSE):
            yield Traffic(node.name, service, cob_id + node.node_id, PAYLOAD_MAX, rate, reason)


def _pdo_traffic(subject: Subject, direction: Direction, pdo: PdoConfig) -> Traffic:
    size = min((sum(mapped.bits for mapped in pdo.mapping) + 7) // 8, PAYLOAD_MAX)
    rate, reason = _rate(subject, direction, pdo)
    service = f'{direction.title} {pdo.number}'
    return Traffic(subject.node.name, service, pdo.cob_id, size, rate, reason)


def _rate(subject: Subject, direction: Direction, pdo: PdoConfig) -> tuple[float, str]:
    """Return how often a PDO is sent in [1/s], and why."""
    master = subject.bus.master
    if direction is not TPDO:
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
    return _event_rate(subject, pdo)


def _event_rate(subject: Subject, pdo: PdoConfig) -> tuple[float, str]:
    """On change is taken as once a cycle, as far as the inhibit time allows."""
    inhibit, timer = subject.inhibit_time(pdo), subject.event_time(pdo)
    on_change = max(subject.bus.master.cycle_period, inhibit)
    if timer and timer <= on_change:
        return 1 / timer, f'event timer {timer * 1e3:g} ms'
    return 1 / on_change, f'on change, taken as every {on_change * 1e3:g} ms'
