# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Generates a bus.yml from EDS files: chooses modes, PDOs and units, and adds the reasons.

It never guesses what an EDS leaves open: the caller provides it, or an error names it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import json
import math

from arm_canopen.config import (
    Direction,
    FactorGroup,
    is_coarse,
    is_fixed,
    mapping_slots,
    NamedUnit,
    RPDO,
    RPM,
    TPDO,
)
from canopen_core import CanopenError
from canopen_core.eds import Eds
from canopen_core.standard import (
    AXIS_OFFSET,
    bit_length,
    CYCLIC_MODES,
    drive_axes,
    Index,
    is_drive,
    NODE_ID_MAX,
    NODE_ID_MIN,
    object_address,
    ObjectEntry,
    OperationMode,
    PDO_BITS_MAX,
    POSITION_MODES,
    profile_number,
    TARGET_OBJECTS,
)

TURN = 2.0 * math.pi  # one turn in [rad]
FAR = 10.0
"""Ratio of entered increments to those of the factor group above which the user is warned."""


class NewBusError(CanopenError):
    """No bus.yml can be generated; the message names the device and what is missing."""


@dataclass(frozen=True, slots=True)
class Units:
    """Position scale of a joint."""

    # increments of the drive per rad or m of the joint; negative for the other direction
    scale: float
    said: str  # the scale as text
    slides: bool = False  # prismatic joint: the scale is per m


@dataclass(frozen=True, slots=True)
class NewDevice:
    """A device of the generated bus."""

    name: str  # for a drive the name of its joint
    node_id: int
    eds: Eds  # its EDS
    # mode of operation; None selects the best one in the EDS
    mode: OperationMode | None = None
    units: Units | None = None  # entered by the user; None: from the factor group
    # turns of the shaft whose velocity the drive counts (in rpm or the angle unit of 0x60A9) per
    # turn or 1 m of the joint; None if the user did not enter it
    rpm: float | None = None

    @property
    def is_drive(self) -> bool:
        """Whether the device is a CiA 402 drive."""
        return is_drive(self.eds.dictionary)

    @property
    def factors(self) -> FactorGroup:
        """The factor group from the defaults of the EDS."""
        return FactorGroup.read(self.number)

    @property
    def has_open_units(self) -> bool:
        """Whether neither EDS nor user defines the increments per turn or metre of the joint."""
        return self.is_drive and self.units is None and not says_units(self.factors)

    @property
    def open_velocity(self) -> NamedUnit | None:
        """The unit in 0x60A9 if the shaft of the velocity is unknown; else None.

        By CiA 402-2 it is the shaft of the positions. If the user entered the position units, a
        turn may be one of the motor.
        """
        named, units = self.factors.velocity_unit, self.units
        if named is None or units is None or self.rpm is not None or named.counts:
            return None
        return None if named.slides and units.slides else named

    def number(self, index: int, subindex: int = 0) -> int:
        """Return an object's default in the EDS; 0 if unknown."""
        return self.eds.dictionary.number(index, subindex) or 0


def says_units(factors: FactorGroup) -> bool:
    """Return whether a factor group defines a turn of the joint: has a gear, and a fine scale."""
    scale = factors.position_scale
    return factors.gear is not None and bool(scale) and not is_coarse(scale)


def written_units(device: NewDevice) -> Units | None:
    """Return the units to write to bus.yml; None if the master reads them from the drive.

    The unit in the EDS's 0x60A8 is ignored: it is a default that manufacturers change by
    parameters.
    """
    factors = device.factors
    if device.units is not None or device.rpm is None or not says_units(factors):
        return device.units
    objects = ', '.join(f'0x{index:04X}' for index in factors.position_objects)
    return Units(factors.position_scale, f'{objects} of the EDS; per rad')


def velocity_scale(device: NewDevice, units: Units) -> tuple[float, str]:
    """Return the velocity scale, and its source as text."""
    one = '1 m' if units.slides else 'one turn'
    if (named := device.open_velocity) is not None:
        raise NewBusError(
            f'{device.name}: 0x60A9 of the EDS has {named.text} as unit, and does not say of which'
            f' shaft; give --rpm {device.name}=TURNS, turns of the motor for {one} of the joint,'
            ' 1 where the drive knows the gear, or correct 0x60A9 in the EDS by the manual'
        )
    factors = device.factors
    named, factor = factors.velocity_unit, factors.velocity_factor
    if device.rpm is not None:
        is_angle = named is not None and not named.slides and not named.counts
        unit = named if named is not None and is_angle else RPM
        velocity = device.rpm * (TURN if units.slides else 1.0) / unit.size
        why = f'{unit.text} by 0x60A9 of the EDS' if is_angle else 'rpm'
        why += f', {device.rpm:g} turns for {one} of the joint, as said'
    elif named is not None:
        velocity = (abs(units.scale) if named.counts else 1.0) / named.size
        why = f'0x60A9 of the EDS: its unit is {named.text}'
    elif factor:
        velocity, why = abs(units.scale) * factor, 'by 0x6096 of the EDS'
    else:
        turns = '60 * turns per m' if units.slides else '60 * turns of the motor per turn / (2 pi)'
        why = 'increments per second, where the manual says nothing else; rpm: '
        velocity, why = abs(units.scale), f'{why}{turns}, by --rpm {device.name}=TURNS'
    return math.copysign(velocity, units.scale), why


def contradiction(device: NewDevice) -> str:
    """Return a warning if the entered scale far exceeds the factor group's; else an empty text.

    They may differ by a gear that the drive does not know; if the entry is far less, the check
    of the file warns.
    """
    factors, units = device.factors, device.units
    if units is None or units.slides or not says_units(factors):
        return ''
    if abs(units.scale) / factors.position_scale < FAR:
        return ''
    return (
        f'its factor group has {factors.position_scale:g} per rad: try which it is by a first'
        ' motion on the page'
    )


BEST_FIRST = POSITION_MODES[::-1]
"""Modes for arms, the best first: cyclic set-points, else profiles of the drive."""
HEARTBEAT_MS = 1000  # heartbeat period of a device in [ms]


@dataclass(frozen=True, slots=True)
class _Wanted:
    """An object to map to a PDO, and what fails without it; empty if optional."""

    index: int
    subindex: int = 0
    lack: str = ''


FEEDBACK = (
    _Wanted(Index.STATUSWORD, lack='its state is not seen in the cycle'),
    _Wanted(Index.POSITION_ACTUAL, lack='its position is not seen in the cycle'),
    _Wanted(Index.MODE_OF_OPERATION_DISPLAY),
    _Wanted(Index.VELOCITY_ACTUAL),
    _Wanted(Index.ERROR_CODE),
)


def bus_text(devices: Sequence[NewDevice], period_ms: int) -> str:
    """Return the text of a bus.yml for one or more devices, with SYNC period_ms in [ms].

    Raises:
        NewBusError: A name or node id is duplicate, or an EDS lacks required data.
    """
    for what, values in (
        ('name', [device.name for device in devices]),
        ('node id', [str(device.node_id) for device in devices]),
    ):
        if twice := sorted({value for value in values if values.count(value) > 1}):
            raise NewBusError(f'{what} {twice[0]} is there twice; give each device its own')
    free = {*range(NODE_ID_MIN, NODE_ID_MAX + 1)} - {device.node_id for device in devices}
    lines = [
        '# Made by `canopen new`: what follows a # is why. After a change: canopen check bus.yml',
        'options:',
        '  dcf_path: "@BUS_CONFIG_PATH@"  # the EDS files lie beside this file',
        '',
        'master:',
        f'  node_id: {min(free, default=NODE_ID_MIN)}  # the lowest one that no device has',
        '  driver: "ros2_canopen::MasterDriver"',
        '  package: "canopen_master_driver"',
        f'  sync_period: {1000 * period_ms}  # [us]',
        '',
    ]
    kinds = [[*_kind(device, period_ms)] for device in devices]
    are_alike = len(devices) > 1 and all(kind == kinds[0] for kind in kinds)
    if are_alike:
        lines += ['defaults:  # of all devices', *(f'  {line}' for line in kinds[0]), '']
    lines.append('nodes:')
    for device, kind in zip(devices, kinds, strict=True):
        own = [f'node_id: {device.node_id}', *_units(device), *([] if are_alike else kind)]
        lines += [f'  {device.name}:', *(f'    {line}' for line in own)]
    return '\n'.join(lines) + '\n'


def _kind(device: NewDevice, period_ms: int) -> Iterator[str]:
    """Yield the lines that devices with the same EDS share."""
    dictionary = device.eds.dictionary
    yield f'dcf: {json.dumps(device.eds.path.name)}'
    kind = 'Cia402Driver' if device.is_drive else 'ProxyDriver'
    package = '402' if device.is_drive else 'proxy'
    what = 'a drive (CiA 402)' if device.is_drive else 'no drive'
    why = '0x1000 of the EDS' if profile_number(dictionary) else 'its objects 0x6040 and 0x6041'
    yield f'driver: "ros2_canopen::{kind}"  # {what}, by {why}'
    yield f'package: "canopen_{package}_driver"'
    if _writable(dictionary.get(Index.PRODUCER_HEARTBEAT)):
        yield f'heartbeat_producer: {HEARTBEAT_MS}  # [ms], so that its loss is noticed'
    if not device.is_drive:
        yield '# PDOs stay as the device has them'
        return
    axes = drive_axes(dictionary)
    if any(axes):
        words = (object_address(Index.CONTROLWORD + AXIS_OFFSET * axis) for axis in axes)
        raise NewBusError(
            f'{device.name}: {device.eds.path.name} has axes at {", ".join(words)}; write them '
            'by hand: num_channels and channel_names, one joint for each, and PDOs with their '
            'objects'
        )
    mode, reason = _mode(device)
    yield f'position_mode: {int(mode)}  # {mode.title.lower()}: {reason}'
    if mode in CYCLIC_MODES and dictionary.has_index(Index.INTERPOLATION_PERIOD):
        yield from _interpolation(device, period_ms)
    yield from _pdos(device, TPDO, FEEDBACK)
    index, subindex = TARGET_OBJECTS[mode]
    controls = (
        _Wanted(Index.CONTROLWORD, lack='it cannot be led through its states in the cycle'),
        _Wanted(index, subindex, 'it gets no set-points in the cycle'),
        _Wanted(Index.MODE_OF_OPERATION),
    )
    yield from _pdos(device, RPDO, controls)


def _mode(device: NewDevice) -> tuple[OperationMode, str]:
    bits = device.number(Index.SUPPORTED_MODES)
    if device.mode is not None:
        return device.mode, 'as asked'
    offered = [mode for mode in BEST_FIRST if bits & mode.support_bit]
    best = f'the best of 0x6502 in the EDS (0x{bits:08X})'
    for mode in offered:
        target = device.eds.dictionary.get(*TARGET_OBJECTS[mode])
        if target is not None and RPDO.mappable(target):
            return mode, f'{best} whose target can be mapped'
    if offered:
        return offered[0], best
    known = ', '.join(f'{int(mode)} ({mode.title.lower()})' for mode in BEST_FIRST)
    what = f'names no position mode in 0x6502 (0x{bits:08X})' if bits else 'has no 0x6502'
    raise NewBusError(
        f'{device.name}: {device.eds.path.name} {what}, the modes that the drive has; look'
        f' into its manual and choose with --mode {device.name}=8: {known}'
    )


def _interpolation(device: NewDevice, period_ms: int) -> Iterator[str]:
    parts = [device.eds.dictionary.get(Index.INTERPOLATION_PERIOD, sub) for sub in (1, 2)]
    if not all(map(_writable, parts)):
        yield f'# 0x60C2 cannot be written: see to it that the drive expects {period_ms} ms'
        return
    yield 'sdo:  # the drive expects a set-point with each SYNC'
    for subindex, value in ((1, period_ms), (2, -3)):
        yield f'  - {{index: 0x60C2, sub_index: {subindex}, value: {value}}}'


def _units(device: NewDevice) -> Iterator[str]:
    if not device.is_drive:
        return
    factors, units = device.factors, written_units(device)
    if units is not None:
        velocity, why = velocity_scale(device, units)
        yield f'scale_pos_to_dev: {units.scale!r}  # {units.said}'
        yield f'scale_pos_from_dev: {1.0 / units.scale!r}'
        yield f'scale_vel_to_dev: {velocity!r}  # {why}'
        yield f'scale_vel_from_dev: {1.0 / velocity!r}'
        yield _acceleration(device, velocity)
        if units.scale < 0.0:
            yield 'scale_eff_to_dev: -1.0  # torque turns with the position'
            yield 'scale_eff_from_dev: -1.0'
        if doubt := contradiction(device):
            yield f'# {doubt}'
    elif says_units(factors):
        turn = factors.position_scale * TURN
        yield f'scale_from_factor_group: true  # read from the drive; {turn:g} a turn by the EDS'
        if factors.acceleration_ratio is None:  # else also read from the drive
            yield _acceleration(device, factors.velocity_scale)
    else:
        raise NewBusError(
            f'{device.name}: {device.eds.path.name} does not say how far an increment of the joint'
            ' is (0x608F or 0x6092, with the gear in 0x6091); give'
            f' --turn {device.name}=INCREMENTS for a turn of the joint with its gear, or'
            f' --metre {device.name}=INCREMENTS'
        )


def _acceleration(device: NewDevice, velocity: float) -> str:
    """Return the line of the acceleration scale, from the velocity scale."""
    ratio, objects = device.factors.acceleration_ratio, device.factors.acceleration_objects
    why = 'velocity units per second, where the manual says nothing else for 0x6083'
    if ratio is not None:
        why = f'by {", ".join(f"0x{index:04X}" for index in objects)} of the EDS'
    return f'scale_acc_to_dev: {velocity * (ratio or 1.0)!r}  # {why}'


def _pdos(device: NewDevice, direction: Direction, wanted: Sequence[_Wanted]) -> Iterator[str]:
    """Yield the lines of a direction's PDOs: as few as hold the objects, the others disabled."""
    placed, left_out = _placed(device, direction, wanted)
    yield f'{direction.name}:'
    yield from left_out
    for number, entries in placed.items():
        yield f'  {number}:'
        yield '    cob_id: "auto"'
        yield '    transmission: 0x01  # with each SYNC'
        yield '    mapping:'
        for entry in entries:
            index, subindex = entry.address
            yield f'      - {{index: 0x{index:04X}, sub_index: {subindex}}}  # {entry.name}'
    for number in direction.numbers(device.eds.dictionary):
        if number not in placed:
            yield f'  {number}: {{enabled: false}}'


def _placed(
    device: NewDevice, direction: Direction, wanted: Sequence[_Wanted]
) -> tuple[dict[int, list[ObjectEntry]], list[str]]:
    """Return the objects of each PDO by number, and comment lines on omitted ones."""
    dictionary = device.eds.dictionary
    numbers = direction.numbers(dictionary)
    free = [number for number in numbers if not is_fixed(direction, number, dictionary)]
    following = ((number, mapping_slots(direction, number, dictionary)) for number in free)
    placed: dict[int, list[ObjectEntry]] = {}
    left_out = []
    number, bits, slots = 0, 0, 0
    for each in wanted:
        entry, what = dictionary.get(each.index, each.subindex), ''
        if entry is None:
            what = 'the EDS lacks it'
        elif not direction.mappable(entry):
            what = 'the EDS says it cannot be mapped'
        else:
            size = bit_length(entry.data_type) or PDO_BITS_MAX
            while size > bits or not slots:
                (number, slots), bits = next(following, (0, 1)), PDO_BITS_MAX
            if number:
                placed.setdefault(number, []).append(entry)
                bits, slots = bits - size, slots - 1
            else:
                what = f'the EDS has {len(free)} {direction.title}s that can be mapped'
        if what and each.lack:
            raise NewBusError(
                f'{device.name}: {device.eds.path.name}: 0x{each.index:04X}: {what}, and '
                f'{each.lack}; correct the EDS (PDOMapping, AccessType) by the manual'
            )
        if what:
            left_out.append(f'  # without 0x{each.index:04X}: {what}')
    return placed, left_out


def _writable(entry: ObjectEntry | None) -> bool:
    return entry is not None and entry.access.writable
