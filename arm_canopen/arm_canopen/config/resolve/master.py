# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building the master's configuration from its section of bus.yml; driver classes, too."""

from __future__ import annotations

from dataclasses import replace
import difflib
import re

from canopen_core import Findings, RefusedError
from canopen_core.standard import TIME_PRODUCER

from ..keys import keys_of, MILLISECONDS
from ..model.bus import CYCLE_PERIOD, Identity, MasterConfig, U16_MAX
from ..read.document import YamlMap
from ..read.section import integer, read_section, texts
from ..sections import MASTER_KEYS, MasterSettings, Options, U8_MAX
from .sdo_list import error_behaviours

MASTER_PACKAGE = 'canopen_master_driver'
DRIVERS = {
    f'ros2_canopen::{cycle}{kind}Driver': package
    for kind, package in (
        ('Master', MASTER_PACKAGE),
        ('Proxy', 'canopen_proxy_driver'),
        ('Cia402', 'canopen_402_driver'),
    )
    for cycle in ('', 'Lifecycle')
}
"""Package that has each driver class of ros2_canopen."""

NAMESPACE = re.compile(r'/?([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?')
CONFIG_KEYS = keys_of(MasterConfig)
TIME_PERIOD = 1.0  # [s] when only that bit requests it
HEARTBEAT_TIME_MAX = U16_MAX / MILLISECONDS  # [s] 0x1016 holds 16 bits


def read_master(section: YamlMap, findings: Findings) -> tuple[MasterSettings, MasterConfig]:
    """Read the section ``master``; what other sections have a say in is left as it is."""
    values = read_section(section, MASTER_KEYS, findings)
    own = {each.field: values.pop(each.field) for each in CONFIG_KEYS if each.field in values}
    settings = MasterSettings(**values)
    check_namespace(section, settings.namespace, findings)
    check_driver(section, settings.driver, findings, for_master=True)
    if 'node_id' not in section.entries:
        findings.error(section.place, "no 'node_id'", "write 'node_id: 1'")
    return settings, MasterConfig(node_id=settings.node_id or 0, **own)


def check_namespace(section: YamlMap, namespace: str, findings: Findings) -> None:
    """Refuse a namespace that ROS does not know."""
    if not NAMESPACE.fullmatch(namespace):
        findings.error(
            section.entries['namespace'].place,
            f'{namespace!r} is no ROS namespace',
            "write it like '/left/arm'",
        )


def build_master(
    section: YamlMap,
    settings: MasterSettings,
    config: MasterConfig,
    options: Options,
    findings: Findings,
    *,
    device_periods: list[float],
) -> MasterConfig:
    """Complete the master's configuration; periods of devices in [s] count without SYNC."""
    time_period = settings.time_period  # bit 30 of its COB-ID requests TIME, too
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
        cycle_period=config.sync_period or min(device_periods, default=CYCLE_PERIOD),
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
    """Return how long devices wait for the heartbeat of the master in [s]."""
    multiplier = settings.heartbeat_multiplier or options.heartbeat_multiplier
    timeout = config.heartbeat_producer * multiplier
    if timeout > HEARTBEAT_TIME_MAX:
        item = section.entries.get('heartbeat_producer')
        findings.error(
            item.place if item is not None else section.place,
            f'heartbeat_producer times heartbeat_multiplier is {timeout:g} s, devices wait at '
            f'most {HEARTBEAT_TIME_MAX} s',
            'make one of them smaller',
        )
    return timeout


def _error_behaviour(section: YamlMap, findings: Findings) -> dict[int, int]:
    """Read 0x1029 of the master: what it does by kind of error (CiA 301, 7.5.2.28)."""
    result: dict[int, int] = {}
    for subindex, item in error_behaviours(section, findings):
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


def check_driver(section: YamlMap, name: str, findings: Findings, *, for_master: bool) -> None:
    """Check the driver class of the master or of a device, empty for none, and its package."""
    names = [known for known in DRIVERS if (DRIVERS[known] == MASTER_PACKAGE) == for_master]
    item = section.entries.get('driver')
    place = item.place if item is not None else section.place
    if item is None:
        findings.error(place, "no 'driver'", f'write driver: with one of {", ".join(names)}')
    if name and name not in names:
        findings.error(place, f'unknown driver class {name!r}', _remedy(name, names, for_master))
    package = section.entries.get('package')
    expected = DRIVERS.get(name) if name in names else None
    text = getattr(package, 'text', expected)
    if package is not None and expected is not None and text != expected:
        findings.warning(
            package.place,
            f'{name} is in the package {expected!r}, not in {text!r}',
            'correct it; the class alone counts here',
        )


def _remedy(name: str, names: list[str], for_master: bool) -> str:
    if name in DRIVERS:
        return f'it is for {"devices" if for_master else "the master"}; take {names[0]!r} here'
    close = difflib.get_close_matches(name, names, n=1)
    return f'did you mean {close[0]!r}?' if close else f'take one of {", ".join(names)}'
