# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of I/O modules (CiA 401) and encoders (CiA 406): what their topics would lack."""

from __future__ import annotations

from canopen_core.standard import (
    ANALOG_EVENTS,
    ANALOG_INPUTS,
    DeviceProfile,
    EncoderObject,
    EVENT_DRIVEN,
    IO_GROUPS,
    object_address,
    profile_number,
)

from ..pdo import RPDO, TPDO
from .subject import Subject


def check_io_device(subject: Subject) -> None:
    """Check a device by its profile in 0x1000."""
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
            for way, pdo in subject.pdos()
            if way is direction
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
    _check_events(subject)


def _check_events(subject: Subject) -> None:
    """Warn about analogue inputs that are sent on change, which CiA 401 has disabled."""
    if subject.node.dictionary.get(ANALOG_EVENTS) is None or subject.value(ANALOG_EVENTS):
        return
    for direction, pdo in subject.pdos():
        on_change = pdo.transmission >= EVENT_DRIVEN and not subject.event_time(pdo)
        carries = any(mapped.index in ANALOG_INPUTS.indices for mapped in pdo.mapping)
        if direction is TPDO and on_change and carries:
            subject.findings.warning(
                subject.pdo_place(TPDO, pdo),
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
