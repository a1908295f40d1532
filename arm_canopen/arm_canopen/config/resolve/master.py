# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building the master's configuration from its section of bus.yml; checking driver classes."""

from __future__ import annotations

from dataclasses import replace
import difflib
from functools import partial

from canopen_core import Findings
from canopen_core.standard import TIME_PRODUCER

from ..keys import Key, keys_of, Kind, MILLISECONDS
from ..model.bus import CYCLE_PERIOD, Identity, MasterConfig, U16_MAX
from ..read.document import YamlMap
from ..read.section import attempt, convert, read_section, texts
from ..sections import MASTER_KEYS, MasterSettings, Options, U8_MAX
from .sdo_list import error_behaviours

MASTER_DRIVERS, DEVICE_DRIVERS = (
    [f'ros2_canopen::{cycle}{kind}Driver' for kind in kinds for cycle in ('', 'Lifecycle')]
    for kinds in (('Master',), ('Proxy', 'Cia402'))
)

CONFIG_KEYS = keys_of(MasterConfig)
BEHAVIOUR = Key(None, '', (0, U8_MAX), kind=Kind.INTEGER)  # reaction to one kind of error
TIME_PERIOD = 1.0  # [s] if only bit 30 of the COB-ID requests TIME
HEARTBEAT_TIME_MAX = U16_MAX / MILLISECONDS  # [s] 0x1016 holds 16 bits


def read_master(section: YamlMap, findings: Findings) -> tuple[MasterSettings, MasterConfig]:
    """Read the section ``master``; :func:`build_master` resolves what depends on others."""
    values = read_section(section, MASTER_KEYS, findings)
    own = {each.field: values.pop(each.field) for each in CONFIG_KEYS if each.field in values}
    settings = MasterSettings(**values)
    check_driver(section, settings.driver, findings, for_master=True)
    if 'node_id' not in section.entries:
        findings.error(section.place, "no 'node_id'", "write 'node_id: 1'")
    return settings, MasterConfig(node_id=settings.node_id or 0, **own)


def build_master(
    section: YamlMap,
    settings: MasterSettings,
    config: MasterConfig,
    options: Options,
    findings: Findings,
) -> MasterConfig:
    """Complete the master's configuration, except for its cycle period without SYNC."""
    time_period = settings.time_period  # bit 30 of its COB-ID also requests TIME
    if time_period is None:
        time_period = TIME_PERIOD if config.time_cob_id & TIME_PRODUCER else 0.0
    return replace(
        config,
        driver=settings.driver,
        namespace=settings.namespace,
        remappings=texts(section, 'remappings', findings),
        bitrate=round(config.bitrate),
        time_cob_id=config.time_cob_id | (TIME_PRODUCER if time_period else 0),
        time_period=time_period,
        cycle_period=config.sync_period or CYCLE_PERIOD,
        heartbeat_timeout=_heartbeat_timeout(section, settings, config, options, findings),
        error_behavior=_error_behaviour(section, findings),
        identity=Identity(
            0,
            settings.vendor_id,
            settings.product_code,
            settings.revision_number,
            settings.serial_number,
        ),
    )


def _heartbeat_timeout(
    section: YamlMap,
    settings: MasterSettings,
    config: MasterConfig,
    options: Options,
    findings: Findings,
) -> float:
    """Return the heartbeat consumer time for the master in [s]."""
    multiplier = settings.heartbeat_multiplier or options.heartbeat_multiplier
    timeout = config.heartbeat_producer * multiplier
    if timeout > HEARTBEAT_TIME_MAX:
        findings.error(
            section.place_of('heartbeat_producer'),
            f'heartbeat_producer times heartbeat_multiplier is {timeout:g} s, devices wait at '
            f'most {HEARTBEAT_TIME_MAX} s',
            'make one of them smaller',
        )
    return timeout


def _error_behaviour(section: YamlMap, findings: Findings) -> dict[int, int]:
    """Read 0x1029 of the master: its reaction by kind of error (CiA 301, 7.5.2.28)."""
    given = (
        (subindex, attempt(partial(convert, BEHAVIOUR), item, findings))
        for subindex, item in error_behaviours(section, findings)
    )
    return {subindex: value for subindex, value in given if value is not None}


def check_driver(section: YamlMap, name: str, findings: Findings, *, for_master: bool) -> None:
    """Check the driver class of the master or of a device; an empty name is none."""
    names = MASTER_DRIVERS if for_master else DEVICE_DRIVERS
    place = section.place_of('driver')
    if 'driver' not in section.entries:
        findings.error(place, "no 'driver'", f'write driver: with one of {", ".join(names)}')
    if not name or name in names:
        return
    close = difflib.get_close_matches(name, names, n=1)
    remedy = f'did you mean {close[0]!r}?' if close else f'take one of {", ".join(names)}'
    if name in MASTER_DRIVERS + DEVICE_DRIVERS:
        remedy = f'it is for {"devices" if for_master else "the master"}; take {names[0]!r} here'
    findings.error(place, f'unknown driver class {name!r}', remedy)
