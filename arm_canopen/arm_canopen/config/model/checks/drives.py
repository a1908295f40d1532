# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of drives: whether their PDOs, times and modes make the motion that is wanted."""

from __future__ import annotations

from canopen_core.standard import (
    AXIS_OFFSET,
    CYCLIC_MODES,
    Index,
    mode_title,
    object_address,
    SYNCHRONOUS_MAX,
    TARGET_OBJECTS,
)

from ..pdo import RPDO, TPDO
from .subject import object_name, Subject, UsedMode

PERIOD_EXPONENTS = (-3, -4, -5, -6)
"""Units of 0x60C2:02 that are tried for a period, coarsest first."""


def check_drive(subject: Subject) -> None:
    """Check a device that is driven by the CiA 402 driver."""
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
    """Return value and exponent of 0x60C2 for a period in [s] (CiA 402-2, 0x60C2).

    Returns:
        The two numbers, None when the object cannot hold the period.
    """
    for exponent in PERIOD_EXPONENTS:
        units = period * 10**-exponent
        if 1 <= round(units) <= 0xFF and abs(units - round(units)) < 1e-6 * units:
            return round(units), exponent
    return None


def _check_interpolation_period(subject: Subject, offset: int) -> None:
    """The time over which a drive interpolates is the time between two set-points."""
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
    """A command and its target shall not be torn apart by a lost or late frame."""
    controls = subject.carriers(RPDO, Index.CONTROLWORD + offset)
    modes = {used.mode for used in subject.used_modes()} or set(TARGET_OBJECTS)
    for index, subindex in dict.fromkeys(
        TARGET_OBJECTS[mode] for mode in TARGET_OBJECTS if mode in modes
    ):
        targets = subject.carriers(RPDO, index + offset, subindex)
        if not controls or not targets or any(pdo in controls for pdo in targets):
            continue
        together = all(pdo.transmission <= SYNCHRONOUS_MAX for pdo in (controls[0], targets[0]))
        when = (
            'both take effect with SYNC, but one of the frames may be lost'
            if together
            else 'they take effect at different times, and one of the frames may be lost'
        )
        subject.findings.warning(
            subject.pdo_place(RPDO, targets[0]),
            f'{object_name(index + offset)} is in RPDO {targets[0].number}, the controlword that '
            f'belongs to it in RPDO {controls[0].number}: {when}',
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
    """A mode with a target in every cycle needs SYNC, and feedback in every cycle."""
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
        if not carriers and index is not Index.STATUSWORD:  # of which reading warns for any mode
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
                subject.pdo_place(TPDO, carriers[0], 'transmission'),
                f'{object_name(used.at(index))} comes only {how} (transmission {kind}), mode '
                f'{used.mode.value} needs it in every cycle',
                "write 'transmission: 1'",
            )


def _check_target_time(subject: Subject, used: UsedMode) -> None:
    index, subindex = TARGET_OBJECTS[used.mode]
    for pdo in subject.carriers(RPDO, used.at(index), subindex):
        if pdo.transmission > SYNCHRONOUS_MAX:
            subject.findings.warning(
                subject.pdo_place(RPDO, pdo, 'transmission'),
                f'the target of mode {used.mode.value} takes effect when its frame arrives '
                f'(transmission {pdo.transmission}): the axes do not move at the same time',
                "write 'transmission: 1'",
            )
