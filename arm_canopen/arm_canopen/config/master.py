# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building the master's configuration from its settings."""

from __future__ import annotations

from .document import Mapping
from .findings import Findings
from .model import MasterConfig
from .settings import MasterSettings, Options, remappings
from .shared_keys import MILLISECONDS, U16_MAX

HEARTBEAT_TIME_MAX = U16_MAX / MILLISECONDS  # [s] 0x1016 holds 16 bits


def build_master(
    section: Mapping,
    settings: MasterSettings,
    options: Options,
    device_periods: list[float],
    findings: Findings,
) -> MasterConfig:
    """Build the master's configuration.

    Args:
        section: Section ``master``.
        settings: What it says.
        options: Section ``options``.
        device_periods: ``period`` of every device in [s]; they count when there is no SYNC.
        findings: Gets times that do not fit together.
    """
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
    return MasterConfig(
        node_id=settings.node_id or 0,
        driver=settings.driver,
        namespace=settings.namespace,
        remappings=remappings(section, findings),
        bitrate=round(settings.bitrate),
        sync_period=settings.sync_period,
        sync_overflow=settings.sync_overflow,
        cycle_period=settings.sync_period or min(device_periods, default=0.01),
        heartbeat_producer=settings.heartbeat_producer,
        heartbeat_timeout=timeout,
        start_nodes=settings.start_nodes,
        boot_timeout=settings.boot_timeout,
    )
