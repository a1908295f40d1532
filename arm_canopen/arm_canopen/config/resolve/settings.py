# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading the sections of a bus.yml into their records, before the EDS files are consulted."""

from __future__ import annotations

import re

from ..findings import Findings
from ..model.drive import DriveConfig
from ..read.document import YamlMap
from ..read.section import read_section
from ..sections import (
    DEVICE_KEYS,
    DeviceSettings,
    DRIVE_KEYS,
    MASTER_KEYS,
    MasterSettings,
    OPTION_KEYS,
    Options,
)
from .axes import check_node_name, read_axes, read_drive
from .drivers import check_driver

NAMESPACE = re.compile(r'/?([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?')


def read_options(section: YamlMap, findings: Findings) -> Options:
    """Read the section ``options``."""
    return Options(**read_section(section, OPTION_KEYS, findings))


def read_master_settings(section: YamlMap, findings: Findings) -> MasterSettings:
    """Read the section ``master``."""
    settings = MasterSettings(**read_section(section, MASTER_KEYS, findings))
    _check_names(section, settings.namespace, findings)
    check_driver(section, settings.driver, findings, for_master=True)
    if 'node_id' not in section.entries:
        findings.error(section.place, "no 'node_id'", "write 'node_id: 1'")
    return settings


def read_device_settings(
    name: str, section: YamlMap, findings: Findings
) -> tuple[DeviceSettings, tuple[DriveConfig, ...]]:
    """Read the section of a device, apart from its PDOs and objects; return its axes, too."""
    values = read_section(section, DEVICE_KEYS + DRIVE_KEYS, findings)
    drive_fields = {key.field for key in DRIVE_KEYS}
    drive = read_drive(section, {k: values.pop(k) for k in drive_fields & values.keys()}, findings)
    settings = DeviceSettings(**values)
    check_node_name(name, section.place, findings)
    _check_names(section, settings.namespace, findings)
    check_driver(section, settings.driver, findings, for_master=False)
    return settings, read_axes(name, section, settings.num_channels, drive, findings)


def _check_names(section: YamlMap, namespace: str, findings: Findings) -> None:
    if not NAMESPACE.fullmatch(namespace):
        findings.error(
            section.entries['namespace'].place,
            f'{namespace!r} is no ROS namespace',
            "write it like '/left/arm'",
        )
