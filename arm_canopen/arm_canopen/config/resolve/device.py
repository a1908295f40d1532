# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building a device's configuration from its section of bus.yml and its EDS."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ...standard.device_profile import drive_axes, is_drive, profile_number
from ...standard.dictionary import object_address, ObjectDictionary
from ...standard.objects import AXIS_OFFSET, Index
from ..findings import Findings, Place
from ..model.bus import NodeConfig
from ..model.drive import DriveConfig
from ..model.identity import Identity
from ..model.pdo_direction import RPDO, TPDO
from ..read.document import YamlMap
from ..read.eds import Eds
from ..read.section import texts
from ..sections import DeviceSettings, Options
from .eds_files import EdsFiles
from .parameter_values import parameter_writes
from .pdos import PdoDraft, PdoReader
from .sdo_list import read_writes
from .settings import read_device_settings

DRIVE_PROFILE = 'Cia402'  # in the names of the drivers of drives
DRIVE_OBJECTS = (Index.CONTROLWORD, Index.STATUSWORD)


@dataclass(frozen=True, slots=True)
class DeviceDraft:
    """A device before the COB-IDs of the whole bus are known."""

    # its configuration without PDOs; None when its EDS or its node id is missing
    config: NodeConfig | None
    section: YamlMap  # its section, defaults merged
    settings: DeviceSettings  # the values of the section
    pdos: list[PdoDraft] = field(default_factory=list)  # its PDOs, TPDOs first

    def place_of(self, key: str) -> Place:
        """Return the place of a key, that of the section when the key is absent."""
        item = self.section.entries.get(key)
        return item.place if item is not None else self.section.place


def read_device(
    name: str, section: YamlMap, options: Options, eds_files: EdsFiles, findings: Findings
) -> DeviceDraft:
    """Read everything about a device that does not depend on master and other devices."""
    settings, axes = read_device_settings(name, section, findings)
    eds = _find_eds(section, settings, options, eds_files, findings)
    names = texts(section, 'remappings', findings)
    node_id = settings.node_id or (eds.node_id if eds is not None else None)
    if not node_id and 'node_id' not in section.entries:
        findings.error(section.place, "no 'node_id'", "write 'node_id:' with 1 to 127")
    if eds is None:
        return DeviceDraft(None, section, settings)
    eds = replace(eds, dictionary=eds.dictionary.for_node(node_id or 0))
    config = NodeConfig(
        name=name,
        node_id=node_id or 0,
        driver=settings.driver,
        eds=eds.path,
        dictionary=eds.dictionary,
        namespace=settings.namespace,
        remappings=names,
        identity=_identity(settings, eds.dictionary),
        boot=settings.boot,
        mandatory=settings.mandatory,
        reset_communication=settings.reset_communication,
        retry_factor=settings.retry_factor or options.retry_factor,
        restore_configuration=settings.restore_configuration,
        sdo_timeout=settings.sdo_timeout,
        boot_timeout=settings.boot_timeout,
        poll_period=settings.poll_period,
        sdo_writes=read_writes(section, eds.dictionary, findings),
        parameter_writes=parameter_writes(eds, findings),
        axes=_placed(axes, eds.dictionary),
        line=section.place.line,
    )
    _check_profile(config, section, findings)
    _check_axes(config, section, findings)
    reader = PdoReader(name, section, eds, node_id or 0, findings=findings)
    pdos = reader.read(TPDO) + reader.read(RPDO)
    return DeviceDraft(config if node_id else None, section, settings, pdos if node_id else [])


def _find_eds(
    section: YamlMap,
    settings: DeviceSettings,
    options: Options,
    eds_files: EdsFiles,
    findings: Findings,
) -> Eds | None:
    item = section.entries.get('dcf')
    if item is None and DRIVE_PROFILE in settings.driver:
        return eds_files.default_drive(section, findings)
    if item is None:
        findings.error(section.place, "no 'dcf'", 'write dcf: with the EDS or DCF of the device')
        return None
    if not settings.dcf:
        return None
    folder = options.dcf_path if settings.dcf_path is None else settings.dcf_path
    return eds_files.find(settings.dcf, folder, item, findings)


def _identity(settings: DeviceSettings, dictionary: ObjectDictionary) -> Identity:
    """Return what is checked at boot.

    Revision and serial number count only if bus.yml names them: EDS files rarely have those of
    the firmware at hand, and the device would not boot although it fits.
    """
    return Identity(
        device_type=dictionary.number(Index.DEVICE_TYPE) or 0,
        vendor_id=dictionary.number(Index.IDENTITY, 1) or 0,
        product_code=dictionary.number(Index.IDENTITY, 2) or 0,
        revision_number=settings.revision_number,
        serial_number=settings.serial_number,
    )


def _check_profile(config: NodeConfig, section: YamlMap, findings: Findings) -> None:
    """Refuse the drive profile's driver for a device that is no drive."""
    if config.is_drive and not drive_axes(config.dictionary):
        missing = [index for index in DRIVE_OBJECTS if not config.dictionary.has_index(index)]
        names = ' and '.join(
            f'{object_address(index)} ({index.name.lower()})' for index in missing
        )
        findings.error(
            section.entries['driver'].place,
            f'{config.driver} is for CiA 402 drives, but the EDS has no {names}',
            "take 'ros2_canopen::ProxyDriver', or the EDS of the drive",
        )
    elif config.is_drive and not is_drive(config.dictionary):
        findings.warning(
            section.entries['driver'].place,
            f'{config.driver} is for CiA 402 drives, but 0x1000 of the EDS names profile '
            f'{profile_number(config.dictionary)}, whose objects from 0x6000 on are others',
            "take 'ros2_canopen::ProxyDriver', or correct 0x1000 in the EDS",
        )


def _check_axes(config: NodeConfig, section: YamlMap, findings: Findings) -> None:
    """Refuse more axes than the EDS has."""
    present = drive_axes(config.dictionary)
    if config.is_drive and 0 < len(present) < len(config.axes):
        words = (object_address(Index.CONTROLWORD + AXIS_OFFSET * axis) for axis in present)
        findings.error(
            section.entries['num_channels'].place,
            f'the EDS has {len(present)} of {len(config.axes)} axes, with the controlword '
            f'{", ".join(words)}',
            'correct num_channels, or use the EDS that fits the device',
        )


def _placed(
    axes: tuple[DriveConfig, ...], dictionary: ObjectDictionary
) -> tuple[DriveConfig, ...]:
    """Return the axes with the objects of those that the device has, in their order.

    Most have the first one at 0x6040; some have none there, or leave one out.
    """
    present = drive_axes(dictionary)
    if len(present) < len(axes):
        return axes
    return tuple(replace(axis, channel=at) for axis, at in zip(axes, present, strict=False))
