# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Driver classes that bus.yml may name: those of ros2_canopen."""

from __future__ import annotations

from dataclasses import dataclass
import difflib

from ..findings import Findings
from ..read.document import YamlMap


@dataclass(frozen=True, slots=True)
class DriverClass:
    """A driver class of ros2_canopen."""

    name: str  # as bus.yml writes it
    package: str  # ROS package that has it upstream
    for_master: bool = False  # it drives the master, not a device


DRIVER_CLASSES: tuple[DriverClass, ...] = (
    DriverClass('ros2_canopen::MasterDriver', 'canopen_master_driver', for_master=True),
    DriverClass(
        'ros2_canopen::LifecycleMasterDriver',
        'canopen_master_driver',
        for_master=True,
    ),
    DriverClass('ros2_canopen::ProxyDriver', 'canopen_proxy_driver'),
    DriverClass('ros2_canopen::LifecycleProxyDriver', 'canopen_proxy_driver'),
    DriverClass('ros2_canopen::Cia402Driver', 'canopen_402_driver'),
    DriverClass('ros2_canopen::LifecycleCia402Driver', 'canopen_402_driver'),
)


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
    known = [driver for driver in DRIVER_CLASSES if driver.for_master == for_master]
    item = section.entries.get('driver')
    place = item.place if item is not None else section.place
    names = [driver.name for driver in known]
    if item is None:
        findings.error(place, "no 'driver'", f'write driver: with one of {", ".join(names)}')
    driver = next((driver for driver in known if driver.name == name), None)
    if driver is not None:
        _check_variant(section, driver, findings)
    elif name:
        findings.error(place, f'unknown driver class {name!r}', _remedy(name, names, for_master))


def _remedy(name: str, names: list[str], for_master: bool) -> str:
    base = BASE_CLASSES.get(name)
    if base is not None:
        return f'it is a base class of ros2_canopen; take {base}'
    if any(driver.name == name for driver in DRIVER_CLASSES):
        return f'it is for {"devices" if for_master else "the master"}; take {names[0]!r} here'
    close = difflib.get_close_matches(name, names, n=1)
    return f'did you mean {close[0]!r}?' if close else f'take one of {", ".join(names)}'


def _check_variant(section: YamlMap, driver: DriverClass, findings: Findings) -> None:
    package = section.entries.get('package')
    text = getattr(package, 'text', driver.package)
    if package is not None and text != driver.package:
        findings.warning(
            package.place,
            f'{driver.name} is in the package {driver.package!r}, not in {text!r}',
            'correct it; the class alone counts here',
        )
