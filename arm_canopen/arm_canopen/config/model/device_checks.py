# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of single devices: conflicting PDOs, and drives with missing objects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from canopen_core import Findings, Place
from canopen_core.standard import (
    ANALOG_EVENTS,
    ANALOG_INPUTS,
    axis_of,
    AXIS_OFFSET,
    CYCLIC_MODES,
    DeviceProfile,
    EncoderObject,
    EVENT_DRIVEN,
    Index,
    IO_GROUPS,
    mode_title,
    object_address,
    OperationMode,
    profile_number,
    SYNCHRONOUS_MAX,
    TARGET_OBJECTS,
)

from ..keys import HUNDRED_MICROSECONDS, MILLISECONDS
from .bus import (
    BusConfig,
    Direction,
    longest_silence,
    loss_unnoticed,
    NodeConfig,
    PdoConfig,
    RPDO,
    TPDO,
)
from .drive import DriveConfig


@dataclass(frozen=True, slots=True)
class UsedMode:
    """A mode of operation that bus.yml names for an axis."""

    axis: DriveConfig
    mode: OperationMode
    key: str  # key of bus.yml that names it

    def at(self, index: int) -> int:
        """Return the index of a CiA 402 object, shifted to this axis."""
        return index + AXIS_OFFSET * self.axis.channel


@dataclass(frozen=True, slots=True)
class Subject:
    """A device under check."""

    bus: BusConfig
    node: NodeConfig
    findings: Findings  # collects the problems found

    def place(self, *names: str) -> Place:
        """Return the place of a key of the device, or of the nearest enclosing key."""
        place = self.bus.place_of(self.node.name, *names)
        return place if place.line else replace(place, line=self.node.line)

    def pdo_place(self, pdo: PdoConfig, *key: str) -> Place:
        """Return the place of a PDO, or of one of its keys."""
        return self.place(pdo.direction.name, str(pdo.number), *key)

    def object_place(self, index: int, subindex: int) -> Place:
        """Return the place that sets an object: the ``sdo`` list, or else the EDS."""
        write = self.node.write_of(index, subindex)
        if write is not None:
            return write.place
        entry = self.node.dictionary.get(index, subindex)
        line = entry.line if entry is not None else 0
        return Place(self.node.eds, line, f'[{index:04X}sub{subindex:X}]')

    def value(self, index: int, subindex: int = 0) -> int | None:
        """Return the value of an object after boot, None if no file defines it."""
        if self.node.dictionary.get(index, subindex) is None:
            return None
        value = self.node.value_after_boot(index, subindex)
        return value if isinstance(value, int) else None

    def used_modes(self) -> Iterator[UsedMode]:
        """Yield the modes of operation that bus.yml names for the axes of a drive."""
        for axis in self.node.axes if self.node.is_drive else ():
            for key in ('position_mode', 'velocity_mode', 'effort_mode'):
                number = getattr(axis, key)
                if number is not None:
                    yield UsedMode(axis, OperationMode(number), key)

    def pdos(self) -> list[PdoConfig]:
        """Return the enabled PDOs."""
        return [pdo for pdo in self.node.pdos if pdo.enabled and pdo.mapping]

    def carriers(self, direction: Direction, index: int, subindex: int = 0) -> list[PdoConfig]:
        """Return the enabled PDOs of a direction that carry an object."""
        return [
            pdo
            for pdo in self.pdos()
            if pdo.direction is direction
            and any((m.index, m.subindex) == (index, subindex) for m in pdo.mapping)
        ]

    def inhibit_time(self, pdo: PdoConfig) -> float:
        """Return the inhibit time of a TPDO in [s] from bus.yml, else the EDS; 0 for none."""
        if pdo.inhibit_time is not None:
            return pdo.inhibit_time
        return (self.value(pdo.communication, 3) or 0) / HUNDRED_MICROSECONDS

    def event_time(self, pdo: PdoConfig) -> float:
        """Return the event timer of a TPDO in [s] from bus.yml, else the EDS; 0 for none."""
        if pdo.event_time is not None:
            return pdo.event_time
        return (self.value(pdo.communication, 5) or 0) / MILLISECONDS


def object_name(index: int) -> str:
    """Return index and name of a standard object, such as ``0x607A (target position)``."""
    name = Index(axis_of(index)[0]).name.lower().replace('_', ' ')
    return f'{object_address(index)} ({name})'


RESTLESS = frozenset({Index.POSITION_ACTUAL, Index.VELOCITY_ACTUAL, Index.TORQUE_ACTUAL})
"""Objects that change all the time, also at rest."""
REMOTE_TYPES = (252, 253)
LATE_FACTOR = 1.5  # shortest deadline of an RPDO, in periods of its frames


def check_pdos(subject: Subject) -> None:
    """Check every enabled PDO."""
    for pdo in subject.pdos():
        if pdo.direction is TPDO and subject.node.is_drive:
            _check_loss(subject, pdo)
        if SYNCHRONOUS_MAX < pdo.transmission < 254:
            _check_reserved(subject, pdo)
        if pdo.sync_start:
            _check_sync_start(subject, pdo)
        if pdo.direction is not TPDO:
            _check_deadline(subject, pdo)
        elif pdo.transmission <= SYNCHRONOUS_MAX:
            _check_useless_times(subject, pdo)
        else:
            _check_events(subject, pdo)


def _check_loss(subject: Subject, pdo: PdoConfig) -> None:
    if loss_unnoticed(pdo, longest_silence(pdo, subject.bus.master.sync_period)):
        subject.findings.warning(
            subject.pdo_place(pdo, 'transmission'),
            f'the loss of TPDO {pdo.number} goes unnoticed (transmission {pdo.transmission}, '
            'no event timer or SYNC), and the drive is led by what it sent before',
            "write 'transmission: 1' (with SYNC), or 255 and 'event_timer: 100'",
        )


def _check_reserved(subject: Subject, pdo: PdoConfig) -> None:
    remote = pdo.transmission in REMOTE_TYPES
    what = 'waits for remote frames, which the master never sends' if remote else 'is reserved'
    subject.findings.warning(
        subject.pdo_place(pdo, 'transmission'),
        f'{pdo.title}: transmission type {pdo.transmission} {what}',
        "write 'transmission: 1' (with SYNC) or 255 (on events)",
    )


def _check_sync_start(subject: Subject, pdo: PdoConfig) -> None:
    overflow = subject.bus.master.sync_overflow
    place = subject.pdo_place(pdo, 'sync_start')
    if not overflow:
        subject.findings.warning(
            place,
            f'sync_start {pdo.sync_start} has no effect: the SYNC has no counter',
            "write 'sync_overflow: 240' into the section master, or remove it",
        )
    elif pdo.sync_start is not None and pdo.sync_start > overflow:
        subject.findings.error(
            place,
            f'sync_start {pdo.sync_start} never comes: the SYNC counts from 1 to {overflow}',
            f'take at most {overflow}, or a larger sync_overflow',
        )


def _check_deadline(subject: Subject, pdo: PdoConfig) -> None:
    cycle = subject.bus.master.cycle_period
    if pdo.event_time and pdo.event_time < LATE_FACTOR * cycle:
        subject.findings.warning(
            subject.pdo_place(pdo, 'event_deadline'),
            f'the device misses RPDO {pdo.number} after {pdo.event_time * 1e3:g} ms, but it comes '
            f'every {cycle * 1e3:g} ms: a frame that is a little late is a fault',
            f'take at least {2 * cycle * 1e3:g}',
        )


def _check_useless_times(subject: Subject, pdo: PdoConfig) -> None:
    for key, time in (('inhibit_time', pdo.inhibit_time), ('event_timer', pdo.event_time)):
        if time:
            subject.findings.warning(
                subject.pdo_place(pdo, key),
                f'{key} has no effect: TPDO {pdo.number} is sent with SYNC (transmission '
                f'{pdo.transmission})',
                "remove it, or write 'transmission: 255'",
            )


def _check_events(subject: Subject, pdo: PdoConfig) -> None:
    inhibit, timer = subject.inhibit_time(pdo), subject.event_time(pdo)
    if timer and inhibit > timer:
        subject.findings.warning(
            subject.pdo_place(pdo, 'inhibit_time'),
            f'inhibit_time {inhibit * 1e3:g} ms is longer than event_timer {timer * 1e3:g} ms',
            'make inhibit_time (unit 0.1 ms) the shorter one',
        )
    restless = [m for m in pdo.mapping if axis_of(m.index)[0] in RESTLESS]
    if restless and not inhibit:
        names = ' and '.join(object_name(mapped.index) for mapped in restless)
        subject.findings.warning(
            subject.pdo_place(pdo),
            f'TPDO {pdo.number} is sent on change (transmission {pdo.transmission}), and {names} '
            'never stands still: it may flood the bus',
            "write 'transmission: 1', or an inhibit_time",
        )


PERIOD_EXPONENTS = (-3, -4, -5, -6)
"""Units of 0x60C2:02 that are tried for a period, coarsest first."""


def check_drive(subject: Subject) -> None:
    """Check a device that uses the CiA 402 driver."""
    if not subject.node.is_drive:
        return
    for axis in subject.node.axes:
        _check_interpolation_period(subject, AXIS_OFFSET * axis.channel)
        _check_one_frame(subject, AXIS_OFFSET * axis.channel)
    for used in subject.used_modes():
        _check_target(subject, used)
        _check_support(subject, used)
        if used.mode in CYCLIC_MODES:
            _check_cyclic(subject, used)


def period_setting(period: float) -> tuple[int, int] | None:
    """Return value and exponent of 0x60C2 for a period in [s]; None if it does not fit."""
    for exponent in PERIOD_EXPONENTS:
        units = period * 10**-exponent
        if 1 <= round(units) <= 0xFF and abs(units - round(units)) < 1e-6 * units:
            return round(units), exponent
    return None


def _check_interpolation_period(subject: Subject, offset: int) -> None:
    """Check that the interpolation period (0x60C2) equals the period of the set-points."""
    index = Index.INTERPOLATION_PERIOD + offset
    wanted = subject.bus.master.sync_period
    value, exponent = subject.value(index, 1), subject.value(index, 2)
    if value is None or not wanted:
        return
    exponent = -3 if exponent is None else exponent
    period = value * 10.0**exponent if -9 <= exponent <= 3 else 0.0
    written = subject.node.write_of(index, 1) or subject.node.write_of(index, 2)
    cyclic = [used for used in subject.used_modes() if used.mode in CYCLIC_MODES]
    if abs(period - wanted) < 1e-6 * wanted or not (written or cyclic):
        return
    says = 'is' if written else 'is not written, by the EDS'
    setting = period_setting(wanted)
    remedy = (
        f'write value {setting[0]} to sub-index 1 and {setting[1]} to sub-index 2 below sdo'
        if setting
        else 'take a sync_period that 0x60C2 can hold, such as 10000'
    )
    place = (
        subject.object_place(index, written.subindex) if written else subject.place(cyclic[0].key)
    )
    subject.findings.warning(
        place,
        f'{object_address(index)} (interpolation period) {says} {period * 1e3:g} ms, but SYNC '
        'comes every '
        f'{wanted * 1e3:g} ms: in the modes 7 to 10 the drive would stop or jerk between two '
        'set-points',
        remedy,
    )


def _check_one_frame(subject: Subject, offset: int) -> None:
    """Check that one frame carries a command and its target, so that losses affect both."""
    controls = subject.carriers(RPDO, Index.CONTROLWORD + offset)
    modes = {used.mode for used in subject.used_modes()} or set(TARGET_OBJECTS)
    for index, subindex in dict.fromkeys(
        TARGET_OBJECTS[mode] for mode in TARGET_OBJECTS if mode in modes
    ):
        targets = subject.carriers(RPDO, index + offset, subindex)
        if not controls or not targets or any(pdo in controls for pdo in targets):
            continue
        subject.findings.warning(
            subject.pdo_place(targets[0]),
            f'{object_name(index + offset)} is in RPDO {targets[0].number}, the controlword that '
            f'belongs to it in RPDO {controls[0].number}: one of the frames may be late or lost',
            'map both into one RPDO',
        )


def _check_target(subject: Subject, used: UsedMode) -> None:
    index, subindex = TARGET_OBJECTS[used.mode]
    if subject.carriers(RPDO, used.at(index), subindex):
        return
    mode = f'mode {used.mode.value} ({mode_title(used.mode).lower()})'
    entry = subject.node.dictionary.get(used.at(index), subindex)
    if used.mode in CYCLIC_MODES or entry is None or not entry.access.writable:
        what = f'{mode} cannot be used: no enabled RPDO carries its target'
    else:
        what = f'the targets of {mode} go by SDO, later than by PDO: no enabled RPDO carries'
    subject.findings.warning(
        subject.place(used.key),
        f'{what} {object_name(used.at(index))}',
        'map it below rpdo, best beside the controlword',
    )


def _check_support(subject: Subject, used: UsedMode) -> None:
    index = used.at(Index.SUPPORTED_MODES)
    supported = subject.value(index)
    if supported and not supported & used.mode.support_bit:
        subject.findings.warning(
            subject.place(used.key),
            f'mode {used.mode.value} ({mode_title(used.mode).lower()}) is not among the modes '
            f'that the EDS names in {object_address(index)} (0x{supported:X})',
            'take another mode, or read the drive with `canopen read`: EDS files err here',
        )


def _check_cyclic(subject: Subject, used: UsedMode) -> None:
    """Check that a cyclic mode has SYNC, and a target and feedback in every cycle."""
    if not subject.bus.master.sync_period:
        subject.findings.warning(
            subject.place(used.key),
            f'mode {used.mode.value} ({mode_title(used.mode).lower()}) needs SYNC, but the master '
            'sends none',
            "write 'sync_period: 10000' into the section master",
        )
        return
    _check_target_time(subject, used)
    for index in (Index.STATUSWORD, Index.POSITION_ACTUAL):
        carriers = subject.carriers(TPDO, used.at(index))
        if not carriers and index is not Index.STATUSWORD:  # reading already warns in any mode
            subject.findings.warning(
                subject.place(used.key),
                f'no enabled TPDO carries {object_name(used.at(index))}; it is read by SDO, too '
                f'seldom for mode {used.mode.value}',
                'map it below tpdo',
            )
        if carriers and not any(pdo.transmission == 1 for pdo in carriers):
            kind = carriers[0].transmission
            how = f'with every {kind}th SYNC' if 1 < kind <= SYNCHRONOUS_MAX else 'on change'
            subject.findings.warning(
                subject.pdo_place(carriers[0], 'transmission'),
                f'{object_name(used.at(index))} comes only {how} (transmission {kind}), mode '
                f'{used.mode.value} needs it in every cycle',
                "write 'transmission: 1'",
            )


def _check_target_time(subject: Subject, used: UsedMode) -> None:
    index, subindex = TARGET_OBJECTS[used.mode]
    for pdo in subject.carriers(RPDO, used.at(index), subindex):
        if pdo.transmission > SYNCHRONOUS_MAX:
            subject.findings.warning(
                subject.pdo_place(pdo, 'transmission'),
                f'the target of mode {used.mode.value} takes effect when its frame arrives '
                f'(transmission {pdo.transmission}): the axes do not move at the same time',
                "write 'transmission: 1'",
            )


def check_io_device(subject: Subject) -> None:
    """Check a device against its device profile (0x1000)."""
    profile = 0 if subject.node.is_drive else profile_number(subject.node.dictionary)
    if profile == DeviceProfile.GENERIC_IO:
        _check_module(subject)
    elif profile == DeviceProfile.ENCODER:
        _check_encoder(subject)


def _check_module(subject: Subject) -> None:
    node, has_outputs = subject.node, False
    for group in IO_GROUPS:
        direction = RPDO if group.is_output else TPDO
        mapped = {
            (each.index, each.subindex)
            for pdo in subject.pdos()
            if pdo.direction is direction
            for each in pdo.mapping
        }
        entries = group.entries(node.dictionary, mapped)
        has_outputs |= group.is_output and bool(entries)
        missing = [entry for entry in entries if entry.address not in mapped]
        if missing:
            names = ', '.join(object_address(*entry.address) for entry in missing)
            subject.findings.warning(
                subject.place(direction.name),
                f'no enabled {direction.title} carries {names}: they are not in ~/{group.name}',
                f'map them below {direction.name}, or read and write them by SDO',
            )
    if has_outputs and not (node.heartbeat_consumer or node.life_guarding):
        subject.findings.warning(
            subject.place('heartbeat_consumer'),
            'the device does not watch the master (0x1016): its outputs stay as they are when the '
            'master ends',
            'write heartbeat_consumer: true where the device has 0x1016',
        )
    _check_input_events(subject)


def _check_input_events(subject: Subject) -> None:
    """Warn of analogue inputs sent on change: CiA 401 disables that by default (0x6423)."""
    if subject.node.dictionary.get(ANALOG_EVENTS) is None or subject.value(ANALOG_EVENTS):
        return
    for pdo in subject.pdos():
        on_change = pdo.transmission >= EVENT_DRIVEN and not subject.event_time(pdo)
        carries = any(mapped.index in ANALOG_INPUTS.indices for mapped in pdo.mapping)
        if pdo.direction is TPDO and on_change and carries:
            subject.findings.warning(
                subject.pdo_place(pdo),
                f'TPDO {pdo.number} is sent on change, but 0x6423 is FALSE: no change of an '
                'analogue input is sent',
                'write 1 to 0x6423 below sdo, or set an event_timer',
            )


def _check_encoder(subject: Subject) -> None:
    if not subject.bus.master.sync_period:
        subject.findings.warning(
            subject.place(),
            'the master sends no SYNC, with which ~/joint_states are published: there are none',
            "write 'sync_period: 10000' into the section master, or read ~/rpdo",
        )
    for index, subindex, lacks in (
        (EncoderObject.POSITION, 0, 'no ~/joint_states is published'),
        (EncoderObject.SPEED, 1, 'the velocity in ~/joint_states is NaN'),
    ):
        exists = subject.node.dictionary.get(index, subindex) is not None
        if exists and not subject.carriers(TPDO, index, subindex):
            subject.findings.warning(
                subject.place('tpdo'),
                f'no enabled TPDO carries {object_address(index, subindex)} '
                f'({index.name.lower()}): {lacks}',
                'map it below tpdo',
            )
