# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building the master's configuration from its settings."""

from __future__ import annotations

from ...standard.cob_id import TIME_PRODUCER
from ..findings import Findings, RefusedError
from ..model.identity import Identity
from ..model.master import MasterConfig
from ..read.document import YamlMap
from ..read.scalars import integer, key_number
from ..read.section import block, texts
from ..read.shared_keys import U8_MAX, U16_MAX
from ..units import MILLISECONDS
from .settings import MASTER, MasterSettings, Options

TIME_PERIOD = 1.0  # [s] when only that bit requests it
TAKEN_OVER = (
    'driver',
    'namespace',
    'sync_period',
    'sync_window',
    'sync_overflow',
    'heartbeat_producer',
    'start',
    'start_nodes',
    'start_all_nodes',
    'reset_all_nodes',
    'stop_all_nodes',
    'nmt_inhibit_time',
    'emcy_inhibit_time',
    'boot_time',
    'boot_timeout',
)
"""Settings that are fields of the configuration, too."""
HEARTBEAT_TIME_MAX = U16_MAX / MILLISECONDS  # [s] 0x1016 holds 16 bits


def build_master(
    section: YamlMap,
    settings: MasterSettings,
    options: Options,
    device_periods: list[float],
    findings: Findings,
) -> MasterConfig:
    """Build the master's configuration; periods of devices in [s] count when there is no SYNC."""
    time_period = _time_period(settings)
    same = {field: getattr(settings, field) for field in TAKEN_OVER}
    return MasterConfig(
        node_id=settings.node_id or 0,
        remappings=texts(section, 'remappings', findings),
        bitrate=round(settings.bitrate),
        time_cob_id=settings.time_cob_id | (TIME_PRODUCER if time_period else 0),
        time_period=time_period,
        cycle_period=settings.sync_period or min(device_periods, default=MASTER.cycle_period),
        heartbeat_timeout=_heartbeat_timeout(section, settings, options, findings),
        error_behavior=_error_behaviour(section, findings),
        identity=Identity(
            0,
            settings.vendor_id,
            settings.product_code,
            settings.revision_number,
            settings.serial_number,
        ),
        **same,
    )


def _heartbeat_timeout(
    section: YamlMap, settings: MasterSettings, options: Options, findings: Findings
) -> float:
    """Return how long devices wait for the heartbeat of the master in [s]."""
    multiplier = settings.heartbeat_multiplier or options.heartbeat_multiplier
    timeout = settings.heartbeat_producer * multiplier
    if timeout > HEARTBEAT_TIME_MAX:
        item = section.entries.get('heartbeat_producer')
        findings.error(
            item.place if item is not None else section.place,
            f'heartbeat_producer times heartbeat_multiplier is {timeout:g} s, devices wait at '
            f'most {HEARTBEAT_TIME_MAX} s',
            'make one of them smaller',
        )
    return timeout


def _time_period(settings: MasterSettings) -> float:
    """Return how often TIME is sent in [s]; bit 30 of its COB-ID requests it, too."""
    if settings.time_period is not None:
        return settings.time_period
    return TIME_PERIOD if settings.time_cob_id & TIME_PRODUCER else 0.0


def _error_behaviour(section: YamlMap, findings: Findings) -> dict[int, int]:
    """Read 0x1029 of the master: what it does by kind of error (CiA 301, 7.5.2.28)."""
    given = block(section, 'error_behavior', findings)
    result: dict[int, int] = {}
    for name, item in given.entries.items() if given else ():
        subindex = key_number(name, U8_MAX)
        if subindex is None:
            findings.error(item.place, f'{name!r} is no sub-index', "write '1: 0' and the like")
            continue
        try:
            value = integer(item)
        except RefusedError as reason:
            findings.refuse(item.place, reason)
            continue
        if 0 <= value <= U8_MAX:
            result[subindex] = value
        else:
            findings.error(item.place, f'{value} is no error behaviour', 'take 0, 1 or 2')
    return result
