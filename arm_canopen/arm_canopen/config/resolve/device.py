# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building a device's configuration from its section of bus.yml and its EDS, with all its axes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import product
import math
import re
from typing import Any

from canopen_core import Findings, Place
from canopen_core.eds import Eds
from canopen_core.standard import (
    AXIS_OFFSET,
    DataType,
    DeviceProfile,
    drive_axes,
    DriveState,
    EncoderObject,
    Index,
    is_drive,
    is_signed,
    object_address,
    ObjectDictionary,
    profile_number,
    SYNCHRONOUS_MAX,
    UNSIGNED_BITS,
)

from ..keys import keys_of, MILLISECONDS
from ..model.bus import (
    Identity,
    MasterConfig,
    NodeConfig,
    RPDO,
    TPDO,
    with_event_timer,
)
from ..model.drive import DriveConfig, RecoveryPolicy
from ..read.document import EdsFiles, Item, YamlMap
from ..read.section import attempt, describe, listing, read_section, text, texts
from ..sections import (
    CHANNEL_KEYS,
    DEVICE_KEYS,
    DeviceSettings,
    DRIVE_KEYS,
    MasterSettings,
    Options,
    SCALE_KEYS,
)
from .master import check_driver
from .pdos import PdoReader
from .sdo_list import parameter_writes, read_writes

CONFIG_KEYS = keys_of(NodeConfig)
DRIVE_PROFILE = 'Cia402'  # part of the names of CiA 402 drivers
DRIVE_OBJECTS = (Index.CONTROLWORD, Index.STATUSWORD)
CYCLIC_OBJECTS = ((RPDO, Index.CONTROLWORD, 'enabled'), (TPDO, Index.STATUSWORD, 'watched'))
"""What a drive cannot do without in its PDOs, as no SDO runs inside the cycle."""


class DeviceReader:
    """Builds the configuration of one device."""

    def __init__(self, name: str, section: YamlMap, findings: Findings) -> None:
        """Read the keys of a section with merged defaults, except its PDOs and objects."""
        self.name = name
        self._section = section
        self._findings = findings
        values = read_section(section, DEVICE_KEYS + DRIVE_KEYS, findings)
        drive_values, self._values = (
            {key.field: values.pop(key.field) for key in keys if key.field in values}
            for keys in (DRIVE_KEYS, CONFIG_KEYS)
        )
        drive = read_drive(section, drive_values, findings)
        self.settings = DeviceSettings(**values)
        check_node_name(name, section.place, findings)
        check_driver(section, self.settings.driver, findings, for_master=False)
        self._axes = read_axes(name, section, self.settings.num_channels, drive, findings)

    def read(
        self,
        options: Options,
        eds_files: EdsFiles,
        master: MasterConfig,
        master_settings: MasterSettings,
    ) -> NodeConfig | None:
        """Return the device, its COB-IDs not yet assigned; None without EDS or node id."""
        settings, section, findings = self.settings, self._section, self._findings
        eds = self._find_eds(options, eds_files)
        remappings = texts(section, 'remappings', findings)
        node_id = settings.node_id or (eds.node_id if eds is not None else None)
        if not node_id and 'node_id' not in section.entries:
            findings.error(section.place, "no 'node_id'", "write 'node_id:' with 1 to 127")
        if eds is None:
            return None
        dictionary = eds.dictionary.for_node(node_id or 0)
        eds = replace(eds, dictionary=dictionary)
        producer = self._heartbeat_producer(dictionary)
        multiplier = settings.heartbeat_multiplier or options.heartbeat_multiplier
        life_time_factor = settings.life_time_factor
        if life_time_factor is None:
            life_time_factor = dictionary.number(Index.LIFE_TIME_FACTOR) or 0
        pdos = PdoReader(self.name, section, eds, node_id or 0, findings=findings)
        node = NodeConfig(
            name=self.name,
            node_id=node_id or 0,
            driver=settings.driver,
            eds=eds.path,
            dictionary=dictionary,
            namespace=settings.namespace,
            remappings=remappings,
            identity=self._identity(dictionary),
            heartbeat_producer=producer,
            heartbeat_timeout=producer * multiplier if master_settings.watch_devices else 0.0,
            heartbeat_consumer=self._heartbeat_consumer(dictionary, master),
            guard_time=self._guard_time(dictionary, producer),
            life_time_factor=life_time_factor,
            retry_factor=settings.retry_factor or options.retry_factor,
            tpdos=pdos.read(TPDO),
            rpdos=pdos.read(RPDO),
            sdo_writes=read_writes(section, dictionary, findings),
            parameter_writes=parameter_writes(eds, findings),
            axes=_placed(self._axes, dictionary),
            line=section.place.line,
            **self._values,
        )
        if node.is_drive:
            self._check_profile(node)
            self._check_axes(node)
        if profile_number(dictionary) == DeviceProfile.ENCODER:
            node = replace(node, axes=(self._encoder_axis(node),))
        if not node_id:
            return None
        self._check_period(master)
        self._check_sync(node, master)
        if node.is_drive:
            self._check_drive_pdos(node)
            tpdos = (with_event_timer(pdo, dictionary) for pdo in node.tpdos)
            node = replace(node, tpdos=tuple(tpdos))
        return node

    def _find_eds(self, options: Options, eds_files: EdsFiles) -> Eds | None:
        settings, section = self.settings, self._section
        item = section.entries.get('dcf')
        if item is None and DRIVE_PROFILE in settings.driver:
            return eds_files.default_drive(section, self._findings)
        if item is None:
            remedy = 'write dcf: with the EDS or DCF of the device'
            self._findings.error(section.place, "no 'dcf'", remedy)
            return None
        if not settings.dcf:
            return None
        folder = options.dcf_path if settings.dcf_path is None else settings.dcf_path
        return eds_files.find(settings.dcf, folder, item, self._findings)

    def _identity(self, dictionary: ObjectDictionary) -> Identity:
        """Return the identity to check at boot.

        Revision and serial number are checked only if bus.yml sets them: EDS files rarely have
        those of the actual firmware, so a suitable device would not boot.
        """
        return Identity(
            device_type=dictionary.number(Index.DEVICE_TYPE) or 0,
            vendor_id=dictionary.number(Index.IDENTITY, 1) or 0,
            product_code=dictionary.number(Index.IDENTITY, 2) or 0,
            revision_number=self.settings.revision_number,
            serial_number=self.settings.serial_number,
        )

    def _encoder_axis(self, node: NodeConfig) -> DriveConfig:
        """Return the scales of an encoder from bus.yml, else rad by its units per revolution."""
        axis, given = node.drive, self._section.entries
        units = node.value_after_boot(EncoderObject.UNITS_PER_REVOLUTION)
        if 'scale_pos_from_dev' not in given and units:
            axis = replace(axis, scale_pos_from_dev=math.tau / float(units))
        if 'scale_vel_from_dev' not in given:
            axis = replace(axis, scale_vel_from_dev=axis.scale_pos_from_dev)
        return axis

    def _heartbeat_producer(self, dictionary: ObjectDictionary) -> float:
        """Return the heartbeat period of the device in [s]."""
        entry, wanted = dictionary.get(Index.PRODUCER_HEARTBEAT), self.settings.heartbeat_producer
        given = (dictionary.number(Index.PRODUCER_HEARTBEAT) or 0) / MILLISECONDS
        if entry is None and wanted:
            self._findings.error(
                self._section.place_of('heartbeat_producer'),
                'the device has no heartbeat: 0x1017 is not in its EDS',
                'remove the key, or use the EDS that fits the device',
            )
        if entry is None or wanted is None or wanted == given:
            return given
        if not entry.access.writable:
            self._findings.error(
                self._section.place_of('heartbeat_producer'),
                f'the heartbeat is fixed at {given * 1e3:g} ms: 0x1017 is read-only in the EDS',
                'remove the key, the period of the EDS counts',
            )
        return wanted

    def _guard_time(self, dictionary: ObjectDictionary, producer: float) -> float:
        """Return the period of node guarding in [s]; a heartbeat replaces it (CiA 301, 7.2.8)."""
        entry, wanted = dictionary.get(Index.GUARD_TIME), self.settings.guard_time
        if wanted and producer:
            self._findings.warning(
                self._section.place_of('guard_time'),
                f'not used: the device sends a heartbeat every {producer * 1e3:g} ms',
                "remove the key, or write 'heartbeat_producer: 0'",
            )
            return 0.0
        if wanted and (entry is None or not entry.access.writable):
            self._findings.error(
                self._section.place_of('guard_time'),
                'the device cannot be guarded: no writable 0x100C in its EDS',
                'remove the key, and set heartbeat_producer',
            )
        if wanted is None and not producer:
            return (dictionary.number(Index.GUARD_TIME) or 0) / MILLISECONDS
        return wanted or 0.0

    def _heartbeat_consumer(self, dictionary: ObjectDictionary, master: MasterConfig) -> bool:
        """Return whether the device watches the master; by default True if it can."""
        entry, wanted = (
            dictionary.get(Index.CONSUMER_HEARTBEAT, 1),
            self.settings.heartbeat_consumer,
        )
        capable = entry is not None and entry.access.writable
        if wanted and not capable:
            self._findings.error(
                self._section.place_of('heartbeat_consumer'),
                'the device cannot watch the master: no writable 0x1016:01 in its EDS',
                'remove the key, or use the EDS that fits the device',
            )
        if wanted and not master.heartbeat_producer:
            self._findings.error(
                self._section.place_of('heartbeat_consumer'),
                'the master sends no heartbeat that the device could watch',
                "write 'heartbeat_producer: 200' into the section master",
            )
        return capable and master.heartbeat_producer > 0 and wanted is not False

    def _check_period(self, master: MasterConfig) -> None:
        period = self._values.get('poll_period', master.sync_period)
        if master.sync_period not in (0.0, period):
            self._findings.warning(
                self._section.place_of('period'),
                f'SYNC is the clock: PDOs come every {master.sync_period * 1e3:g} ms, not every '
                f'{period * 1e3:g} ms; only objects that no PDO carries are read so often',
                'make period equal to sync_period',
            )

    def _check_sync(self, node: NodeConfig, master: MasterConfig) -> None:
        """Warn about PDOs that wait for a SYNC that the master does not send."""
        for pdo in node.pdos:
            synchronous = pdo.enabled and pdo.transmission <= SYNCHRONOUS_MAX
            if pdo.configured and synchronous and not master.sync_period:
                self._findings.warning(
                    pdo.place,
                    f'{pdo.title} of {node.name} waits for SYNC (transmission '
                    f'{pdo.transmission}), but the master sends none',
                    "write 'sync_period: 10000' into the section master, or 'transmission: 255'",
                )

    def _check_profile(self, node: NodeConfig) -> None:
        """Refuse the CiA 402 driver for a device that is not a drive."""
        place = self._section.place_of('driver')
        if not drive_axes(node.dictionary):
            names = ' and '.join(
                f'{object_address(index)} ({index.name.lower()})'
                for index in DRIVE_OBJECTS
                if not node.dictionary.has_index(index)
            )
            self._findings.error(
                place,
                f'{node.driver} is for CiA 402 drives, but the EDS has no {names}',
                "take 'ros2_canopen::ProxyDriver', or the EDS of the drive",
            )
        elif not is_drive(node.dictionary):
            self._findings.warning(
                place,
                f'{node.driver} is for CiA 402 drives, but 0x1000 of the EDS names profile '
                f'{profile_number(node.dictionary)}, whose objects from 0x6000 on are others',
                "take 'ros2_canopen::ProxyDriver', or correct 0x1000 in the EDS",
            )

    def _check_axes(self, node: NodeConfig) -> None:
        """Refuse more axes than the EDS has."""
        present = drive_axes(node.dictionary)
        if 0 < len(present) < len(node.axes):
            words = (object_address(Index.CONTROLWORD + AXIS_OFFSET * axis) for axis in present)
            self._findings.error(
                self._section.place_of('num_channels'),
                f'the EDS has {len(present)} of {len(node.axes)} axes, with the controlword '
                f'{", ".join(words)}',
                'correct num_channels, or use the EDS that fits the device',
            )

    def _check_drive_pdos(self, node: NodeConfig) -> None:
        """Warn of objects missing in the PDOs of a drive; refuse signed ones mapped unsigned."""
        mapped = [(pdo, each) for pdo in node.pdos if pdo.enabled for each in pdo.mapping]
        for axis, (direction, first, verb) in product(node.axes, CYCLIC_OBJECTS):
            index = first + AXIS_OFFSET * axis.channel
            if not any(pdo.direction is direction and each.index == index for pdo, each in mapped):
                self._findings.warning(
                    self._section.place,
                    f'no enabled {direction.title} carries {object_address(index)} '
                    f'({first.name.lower()}); '
                    f'{axis.name or "the drive"} cannot be {verb} in the cycle',
                    f'map it below {direction.name}',
                )
        for pdo, each in mapped:
            unsigned = each.data_type in UNSIGNED_BITS or each.data_type is DataType.BOOLEAN
            if unsigned and is_signed(each.index, each.subindex):
                self._findings.error(
                    pdo.place,
                    f'{pdo.title} of {node.name} carries '
                    f'{object_address(each.index, each.subindex)} as {each.data_type.name}, which '
                    'holds no negative value',
                    'correct its DataType in the EDS (0x0003 INTEGER16, 0x0004 INTEGER32), or the '
                    'length in the default mapping',
                )


def _placed(axes: Iterable[DriveConfig], dictionary: ObjectDictionary) -> tuple[DriveConfig, ...]:
    """Assign the axes, in order, to the channels that the EDS has.

    Most devices have channel 0 at 0x6040; some start higher, or skip a channel.
    """
    axes, present = tuple(axes), drive_axes(dictionary)
    if len(present) < len(axes):
        return axes
    return tuple(replace(axis, channel=at) for axis, at in zip(axes, present, strict=False))


ROS_NAME = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
SCALE_TOLERANCE = 0.01  # largest deviation from 1 of the product of both scales
INVERSES = (
    ('scale_eff_from_dev', 'scale_eff_to_dev'),
    ('scale_acc_from_dev', 'scale_acc_to_dev'),
    ('scale_acc_to_dev', 'scale_acc_from_dev'),
)


def read_drive(section: YamlMap, values: dict[str, Any], findings: Findings) -> DriveConfig:
    """Build the settings common to all axes of a drive from the values of its keys by field."""
    if 'switching_state' in values:
        state = DriveState(values['switching_state'])
        if state is DriveState.FAULT:
            state = DriveState.OPERATION_ENABLED
            findings.warning(
                section.entries['switching_state'].place,
                '8 is Fault, in which no drive switches its mode; taken as 5 (Operation enabled)',
                'write switching_state: 5',
            )
        values['switching_state'] = state
    if 'recovery' in values:
        values['recovery'] = RecoveryPolicy(values['recovery'])
    return _with_scales(DriveConfig(), section, values, findings)


def check_node_name(name: str, place: Place, findings: Findings) -> None:
    """Refuse a device or axis name that is not a valid ROS node name."""
    if not ROS_NAME.fullmatch(name):
        findings.error(
            place,
            f'{name!r} is no name for a ROS node',
            'take letters, digits and underscores, and begin with a letter; rename a joint in its'
            ' URDF, SRDF and limits, too',
        )


def read_axes(
    name: str, section: YamlMap, count: int, drive: DriveConfig, findings: Findings
) -> tuple[DriveConfig, ...]:
    """Return the settings of each axis; ``drive`` has those common to all."""
    names = [name] if count == 1 else [f'{name}_{number}' for number in range(count)]
    given = listing(section, 'channel_names', findings)
    if given is not None:
        names = [_axis_name(item, findings) for item in given.items]
    channels = listing(section, 'channels', findings)
    parts = list(channels.items) if channels is not None else [None] * count
    for what, items, key in (('names', names, 'channel_names'), ('entries', parts, 'channels')):
        if len(items) != count:
            findings.error(
                section.entries[key].place,
                f'{len(items)} {what} for {count} channels (num_channels)',
                'give as many as there are channels',
            )
            return (drive,)
    return tuple(
        _axis(replace(drive, name=name, channel=channel), part, findings)
        for channel, (name, part) in enumerate(zip(names, parts, strict=True))
    )


def _axis(drive: DriveConfig, part: Item | None, findings: Findings) -> DriveConfig:
    if part is None:
        return drive
    if not isinstance(part, YamlMap):
        findings.error(
            part.place,
            f'expected the keys of a channel, got {describe(part)}',
            "write '- {scale_pos_to_dev: 1000.0}' and the like",
        )
        return drive
    values = read_section(part, CHANNEL_KEYS, findings)
    if any(key in part.entries for key in SCALE_KEYS):
        drive = replace(drive, scale_from_factor_group=False)
    return _with_scales(drive, part, values, findings)


def _with_scales(
    drive: DriveConfig, section: YamlMap, values: dict[str, Any], findings: Findings
) -> DriveConfig:
    """Return an axis with the values of a section, of its device or its channel, applied."""
    scales = [key for key in SCALE_KEYS if key in section.entries]
    if scales and values.get('scale_from_factor_group'):
        findings.error(
            section.entries['scale_from_factor_group'].place,
            f'the units are given twice: by the factor group of the drive, and by {scales[0]}',
            'remove one of them',
        )
    # keys not in ros2_canopen: derived if bus.yml sets the other direction only
    added = {key: 1.0 / values[given] for key, given in INVERSES if given in values}
    axis = replace(drive, **added | values)
    for what in ('pos', 'vel', 'acc', 'eff'):
        keys = (f'scale_{what}_to_dev', f'scale_{what}_from_dev')
        given = [section.entries[key].place for key in keys if key in section.entries]
        if not given:
            continue
        product = getattr(axis, keys[0]) * getattr(axis, keys[1])
        if abs(product - 1) > SCALE_TOLERANCE:
            findings.warning(
                given[0],
                f'{keys[0]} times {keys[1]} is {product:g}, not 1: targets and feedback have '
                'different units',
                'make one the inverse of the other',
            )
    return axis


def _axis_name(item: Item, findings: Findings) -> str:
    name = attempt(text, item, findings)
    if name is None:
        return ''
    check_node_name(name, item.place, findings)
    return name
