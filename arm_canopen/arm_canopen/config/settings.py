# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sections of bus.yml as records, before the EDS files are consulted."""

from __future__ import annotations

from dataclasses import dataclass
import re

from .device_keys import DEVICE_KEYS, DRIVE_KEYS
from .document import Mapping
from .drive_axes import check_node_name, read_axes, read_drive
from .drive_model import DriveConfig
from .drivers import check_driver
from .findings import Findings
from .master_keys import MASTER_KEYS, OPTION_KEYS
from .model import BOOT_TIMEOUT, POLL_PERIOD, RETRY_FACTOR, SDO_TIMEOUT
from .section import read_section, texts

NAMESPACE = re.compile(r'/?([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?')


@dataclass(frozen=True, slots=True)
class Options:
    """Section ``options``.

    Attributes:
        dcf_path: Folder of the EDS files, empty for none.
        heartbeat_multiplier: Heartbeat periods until a heartbeat counts as lost.
        retry_factor: Missing answers after which a guarded device counts as lost.
    """

    dcf_path: str = ''
    heartbeat_multiplier: float = 3.0
    retry_factor: int = RETRY_FACTOR


@dataclass(frozen=True, slots=True)
class MasterSettings:
    """Section ``master``; attributes as in :class:`.model.MasterConfig`.

    Attributes:
        watch_devices: The master supervises the devices' heartbeats.
        vendor_id: Part of ``identity``, as the three below.
        heartbeat_multiplier: Periods that devices wait for the master's heartbeat, None for the
            options' value.
    """

    node_id: int | None = None
    driver: str = ''
    namespace: str = ''
    bitrate: int = 1_000_000
    watch_devices: bool = True
    heartbeat_producer: float = 0.0
    heartbeat_multiplier: float | None = None
    sync_period: float = 0.0
    sync_window: float = 0.0
    sync_overflow: int = 0
    time_cob_id: int = 0x100
    time_period: float | None = None
    start: bool = True
    start_nodes: bool = True
    start_all_nodes: bool = False
    reset_all_nodes: bool = False
    stop_all_nodes: bool = False
    nmt_inhibit_time: float = 0.0
    emcy_inhibit_time: float = 0.0
    vendor_id: int = 0
    product_code: int = 0
    revision_number: int = 0
    serial_number: int = 0
    boot_time: float = 0.0
    boot_timeout: float = 2.0


@dataclass(frozen=True, slots=True)
class DeviceSettings:
    """Section of a device; attributes as in :class:`.model.NodeConfig`, None when not given.

    Attributes:
        dcf: EDS or DCF file, empty when not given.
        dcf_path: Its folder, None for that of the options.
        poll_period: ``period``; without SYNC it is the cycle, too.
        num_channels: Number of axes.
    """

    node_id: int | None = None
    driver: str = ''
    namespace: str = ''
    dcf: str = ''
    dcf_path: str | None = None
    poll_period: float = POLL_PERIOD
    sdo_timeout: float = SDO_TIMEOUT
    boot_timeout: float = BOOT_TIMEOUT
    revision_number: int = 0
    serial_number: int = 0
    heartbeat_producer: float | None = None
    heartbeat_consumer: bool | None = None
    heartbeat_multiplier: float | None = None
    guard_time: float | None = None
    life_time_factor: int | None = None
    retry_factor: int | None = None
    boot: bool = True
    mandatory: bool = False
    reset_communication: bool = True
    restore_configuration: int = 0
    num_channels: int = 1


def read_options(section: Mapping, findings: Findings) -> Options:
    """Read the section ``options``."""
    return Options(**read_section(section, OPTION_KEYS, findings))


def read_master_settings(section: Mapping, findings: Findings) -> MasterSettings:
    """Read the section ``master``."""
    settings = MasterSettings(**read_section(section, MASTER_KEYS, findings))
    _check_names(section, settings.namespace, findings)
    check_driver(section, settings.driver, findings, for_master=True)
    if 'node_id' not in section.entries:
        findings.error(section.place, "no 'node_id'", "write 'node_id: 1'")
    return settings


def read_device_settings(
    name: str, section: Mapping, findings: Findings
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


def remappings(section: Mapping, findings: Findings) -> dict[str, str]:
    """Read the ROS remappings of the master or a device."""
    return texts(section, 'remappings', findings)


def _check_names(section: Mapping, namespace: str, findings: Findings) -> None:
    if not NAMESPACE.fullmatch(namespace):
        findings.error(
            section.entries['namespace'].place,
            f'{namespace!r} is no ROS namespace',
            "write it like '/left/arm'",
        )
