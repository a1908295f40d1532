# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Completing a device by what depends on the master: heartbeats, and PDOs that fit the cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

from ...standard.dictionary import object_address, ObjectDictionary
from ...standard.objects import AXIS_OFFSET, Index
from ...standard.pdo import SYNCHRONOUS_MAX
from ..findings import Findings
from ..model.bus import NodeConfig, PdoConfig
from ..model.master import MasterConfig
from ..model.pdo_direction import Direction, RPDO, TPDO
from ..model.tpdo_freshness import with_event_timer
from ..units import MILLISECONDS
from .device import DeviceDraft
from .drive_types import check_drive_types
from .pdos import PdoDraft

CYCLIC_OBJECTS = ((RPDO, Index.CONTROLWORD, 'enabled'), (TPDO, Index.STATUSWORD, 'watched'))
"""What a drive cannot do without in its PDOs, as no SDO runs inside the cycle."""


def finish_device(
    draft: DeviceDraft,
    config: NodeConfig,
    master: MasterConfig,
    findings: Findings,
    *,
    multiplier: float,
    is_watched: bool,
) -> NodeConfig:
    """Complete a device whose PDOs have their final COB-IDs.

    The master waits multiplier periods for its heartbeat, where it is watched.
    """
    _check_period(draft, master, findings)
    _check_sync(draft.pdos, master, findings)
    if config.is_drive:
        _check_drive_pdos(draft, config, findings)
        check_drive_types(draft.pdos, findings)
    producer = _heartbeat_producer(draft, config.dictionary, findings)
    life_time_factor = draft.settings.life_time_factor
    if life_time_factor is None:
        life_time_factor = config.dictionary.number(Index.LIFE_TIME_FACTOR) or 0
    multiplier = draft.settings.heartbeat_multiplier or multiplier
    return replace(
        config,
        heartbeat_producer=producer,
        heartbeat_timeout=producer * multiplier if is_watched else 0.0,
        guard_time=_guard_time(draft, config.dictionary, producer, findings),
        life_time_factor=life_time_factor,
        heartbeat_consumer=_heartbeat_consumer(draft, config.dictionary, master, findings),
        tpdos=_tpdos(draft, config),
        rpdos=tuple(pdo.config for pdo in draft.pdos if pdo.direction is RPDO),
    )


def _tpdos(draft: DeviceDraft, config: NodeConfig) -> tuple[PdoConfig, ...]:
    tpdos = (pdo.config for pdo in draft.pdos if pdo.direction is TPDO)
    if not config.is_drive:
        return tuple(tpdos)
    return tuple(with_event_timer(pdo, config.dictionary) for pdo in tpdos)


def _heartbeat_producer(
    draft: DeviceDraft, dictionary: ObjectDictionary, findings: Findings
) -> float:
    """Return the period of the device's heartbeat in [s]."""
    entry = dictionary.get(Index.PRODUCER_HEARTBEAT)
    wanted = draft.settings.heartbeat_producer
    if entry is None:
        if wanted:
            findings.error(
                draft.place_of('heartbeat_producer'),
                'the device has no heartbeat: 0x1017 is not in its EDS',
                'remove the key, or use the EDS that fits the device',
            )
        return 0.0
    given = (dictionary.number(Index.PRODUCER_HEARTBEAT) or 0) / MILLISECONDS
    if wanted is None or wanted == given:
        return given
    if not entry.access.writable:
        findings.error(
            draft.place_of('heartbeat_producer'),
            f'the heartbeat is fixed at {given * 1e3:g} ms: 0x1017 is read-only in the EDS',
            'remove the key, the period of the EDS counts',
        )
    return wanted


def _guard_time(
    draft: DeviceDraft, dictionary: ObjectDictionary, producer: float, findings: Findings
) -> float:
    """Return the period of node guarding in [s]; a heartbeat replaces it (CiA 301, 7.2.8.2.2)."""
    entry = dictionary.get(Index.GUARD_TIME)
    wanted = draft.settings.guard_time
    if wanted and producer:
        findings.warning(
            draft.place_of('guard_time'),
            f'not used: the device sends a heartbeat every {producer * 1e3:g} ms',
            "remove the key, or write 'heartbeat_producer: 0'",
        )
        return 0.0
    if wanted and (entry is None or not entry.access.writable):
        findings.error(
            draft.place_of('guard_time'),
            'the device cannot be guarded: no writable 0x100C in its EDS',
            'remove the key, and set heartbeat_producer',
        )
    if wanted is None and not producer:
        return (dictionary.number(Index.GUARD_TIME) or 0) / MILLISECONDS
    return wanted or 0.0


def _heartbeat_consumer(
    draft: DeviceDraft, dictionary: ObjectDictionary, master: MasterConfig, findings: Findings
) -> bool:
    """Return whether the device watches the master; by default it does if it can."""
    entry = dictionary.get(Index.CONSUMER_HEARTBEAT, 1)
    capable = entry is not None and entry.access.writable
    wanted = draft.settings.heartbeat_consumer
    if wanted and not capable:
        findings.error(
            draft.place_of('heartbeat_consumer'),
            'the device cannot watch the master: no writable 0x1016:01 in its EDS',
            'remove the key, or use the EDS that fits the device',
        )
    if wanted and not master.heartbeat_producer:
        findings.error(
            draft.place_of('heartbeat_consumer'),
            'the master sends no heartbeat that the device could watch',
            "write 'heartbeat_producer: 200' into the section master",
        )
    return capable and master.heartbeat_producer > 0 and wanted is not False


def _check_period(draft: DeviceDraft, master: MasterConfig, findings: Findings) -> None:
    period = draft.settings.poll_period
    if 'period' in draft.section.entries and master.sync_period not in (0.0, period):
        findings.warning(
            draft.place_of('period'),
            f'SYNC is the clock: PDOs come every {master.sync_period * 1e3:g} ms, not every '
            f'{period * 1e3:g} ms; only objects that no PDO carries are read so often',
            'make period equal to sync_period',
        )


def _check_sync(pdos: Sequence[PdoDraft], master: MasterConfig, findings: Findings) -> None:
    """Warn about PDOs that wait for a SYNC that the master does not send."""
    for pdo in pdos:
        config = pdo.config
        synchronous = config.enabled and config.transmission <= SYNCHRONOUS_MAX
        if config.configured and synchronous and not master.sync_period:
            findings.warning(
                pdo.place,
                f'{pdo.title} waits for SYNC (transmission {config.transmission}), but the master '
                'sends none',
                "write 'sync_period: 10000' into the section master, or 'transmission: 255'",
            )


def _check_drive_pdos(draft: DeviceDraft, config: NodeConfig, findings: Findings) -> None:
    for axis, (direction, first, verb) in product(config.axes, CYCLIC_OBJECTS):
        index = first + AXIS_OFFSET * axis.channel
        if not _is_mapped(draft.pdos, direction, index):
            findings.warning(
                draft.section.place,
                f'no enabled {direction.title} carries {object_address(index)} '
                f'({first.name.lower()}); '
                f'{axis.name or "the drive"} cannot be {verb} in the cycle',
                f'map it below {direction.name}',
            )


def _is_mapped(pdos: Sequence[PdoDraft], direction: Direction, index: int) -> bool:
    return any(
        mapped.index == index
        for pdo in pdos
        if pdo.direction is direction and pdo.config.enabled
        for mapped in pdo.config.mapping
    )
