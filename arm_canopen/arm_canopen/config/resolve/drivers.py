# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Driver classes that bus.yml may name: those of ros2_canopen."""

from __future__ import annotations

import difflib

from canopen_core import Findings

from ..read.document import YamlMap

MASTER_PACKAGE = 'canopen_master_driver'
DRIVERS = {
    'ros2_canopen::MasterDriver': MASTER_PACKAGE,
    'ros2_canopen::LifecycleMasterDriver': MASTER_PACKAGE,
    'ros2_canopen::ProxyDriver': 'canopen_proxy_driver',
    'ros2_canopen::LifecycleProxyDriver': 'canopen_proxy_driver',
    'ros2_canopen::Cia402Driver': 'canopen_402_driver',
    'ros2_canopen::LifecycleCia402Driver': 'canopen_402_driver',
}
"""Package that has each driver class of ros2_canopen."""
BASE_CLASSES = {
    'ros2_canopen::CanopenDriver': (
        "'ros2_canopen::Cia402Driver' for a drive, 'ros2_canopen::ProxyDriver' for another device"
    ),
    'ros2_canopen::LifecycleCanopenDriver': (
        "'ros2_canopen::LifecycleCia402Driver' for a drive, 'ros2_canopen::LifecycleProxyDriver' "
        'for another device'
    ),
    'ros2_canopen::CanopenMaster': "'ros2_canopen::MasterDriver'",
    'ros2_canopen::LifecycleCanopenMaster': "'ros2_canopen::LifecycleMasterDriver'",
}
"""Classes that no bus.yml can name, and what is meant."""


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
    base = BASE_CLASSES.get(name)
    if base is not None:
        return f'it is a base class of ros2_canopen; take {base}'
    if name in DRIVERS:
        return f'it is for {"devices" if for_master else "the master"}; take {names[0]!r} here'
    close = difflib.get_close_matches(name, names, n=1)
    return f'did you mean {close[0]!r}?' if close else f'take one of {", ".join(names)}'
