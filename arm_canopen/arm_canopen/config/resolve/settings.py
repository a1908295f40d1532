# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sections of bus.yml as records, before the EDS files are consulted.

A record has a value for each key that is absent: the default of the model where that has the
field, and None where other sections or the EDS decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import re

from ...standard.dictionary import ObjectDictionary
from ..findings import Findings
from ..model.bus import NodeConfig
from ..model.drive import DriveConfig
from ..model.identity import ANY_DEVICE
from ..model.master import MasterConfig
from ..read.device_keys import DEVICE_KEYS, DRIVE_KEYS
from ..read.document import YamlMap
from ..read.master_keys import MASTER_KEYS, OPTION_KEYS
from ..read.section import read_section
from .axes import check_node_name, read_axes, read_drive
from .drivers import check_driver

MASTER = MasterConfig(node_id=0)
DEVICE = NodeConfig('', 0, '', eds=Path(), dictionary=ObjectDictionary(()))
"""Master and device without keys."""
NAMESPACE = re.compile(r'/?([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?')


@dataclass(frozen=True, slots=True)
class Options:
    """Section ``options``."""

    dcf_path: str = ''  # folder of the EDS files, empty for none
    heartbeat_multiplier: float = 3.0  # heartbeat periods until a heartbeat counts as lost
    # missing answers after which a guarded device counts as lost
    retry_factor: int = DEVICE.retry_factor


@dataclass(frozen=True, slots=True)
class MasterSettings:
    """Section ``master``; attributes as in :class:`.model.MasterConfig`."""

    node_id: int | None = None
    driver: str = ''
    namespace: str = ''
    bitrate: int = MASTER.bitrate
    watch_devices: bool = True  # the master supervises the devices' heartbeats
    heartbeat_producer: float = MASTER.heartbeat_producer
    # periods that devices wait for the master's heartbeat, None for the options' value
    heartbeat_multiplier: float | None = None
    sync_period: float = MASTER.sync_period
    sync_window: float = MASTER.sync_window
    sync_overflow: int = MASTER.sync_overflow
    time_cob_id: int = MASTER.time_cob_id
    time_period: float | None = None
    start: bool = MASTER.start
    start_nodes: bool = MASTER.start_nodes
    start_all_nodes: bool = MASTER.start_all_nodes
    reset_all_nodes: bool = MASTER.reset_all_nodes
    stop_all_nodes: bool = MASTER.stop_all_nodes
    nmt_inhibit_time: float = MASTER.nmt_inhibit_time
    emcy_inhibit_time: float = MASTER.emcy_inhibit_time
    vendor_id: int = ANY_DEVICE.vendor_id  # part of ``identity``, as the three below
    product_code: int = ANY_DEVICE.product_code
    revision_number: int = ANY_DEVICE.revision_number
    serial_number: int = ANY_DEVICE.serial_number
    boot_time: float = MASTER.boot_time
    boot_timeout: float = MASTER.boot_timeout


@dataclass(frozen=True, slots=True)
class DeviceSettings:
    """Section of a device; attributes as in :class:`.model.NodeConfig`, None when not given."""

    node_id: int | None = None
    driver: str = ''
    namespace: str = ''
    dcf: str = ''  # EDS or DCF file, empty when not given
    dcf_path: str | None = None  # its folder, None for that of the options
    poll_period: float = DEVICE.poll_period  # ``period``; without SYNC it is the cycle, too
    sdo_timeout: float = DEVICE.sdo_timeout
    boot_timeout: float = DEVICE.boot_timeout
    revision_number: int = ANY_DEVICE.revision_number
    serial_number: int = ANY_DEVICE.serial_number
    heartbeat_producer: float | None = None
    heartbeat_consumer: bool | None = None
    heartbeat_multiplier: float | None = None
    guard_time: float | None = None
    life_time_factor: int | None = None
    retry_factor: int | None = None
    boot: bool = DEVICE.boot
    mandatory: bool = DEVICE.mandatory
    reset_communication: bool = DEVICE.reset_communication
    restore_configuration: int = DEVICE.restore_configuration
    num_channels: int = len(DEVICE.axes)  # number of axes


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
