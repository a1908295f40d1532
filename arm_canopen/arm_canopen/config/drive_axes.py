# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The axes of a drive: what bus.yml says of all of them, and of each channel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..standard.drive import DriveState
from . import scalars
from .device_keys import CHANNEL_KEYS, SCALE_KEYS
from .document import Item, Mapping
from .drive_model import DriveConfig, RecoveryPolicy
from .findings import Findings, RefusedError
from .section import listing, read_section

POLICIES = {policy.value: policy for policy in RecoveryPolicy}


def read_drive(section: Mapping, values: dict[str, Any], findings: Findings) -> DriveConfig:
    """Build the settings that count for all axes of a drive.

    Args:
        section: Section of the device.
        values: Values of its drive keys by field.
        findings: Gets what is wrong.
    """
    if 'switching_state' in values:
        values['switching_state'] = _switching_state(section, values, findings)
    if 'recovery' in values:
        values['recovery'] = _policy(section.entries['recovery'], values['recovery'], findings)
    _check_one_rule(section, values, findings)
    return DriveConfig(**_with_inverse_effort(values))


def read_axes(
    name: str, section: Mapping, count: int, drive: DriveConfig, findings: Findings
) -> tuple[DriveConfig, ...]:
    """Return one record for each axis.

    Args:
        name: Name of the device.
        section: Its section.
        count: Number of axes.
        drive: What counts for all of them.
        findings: Gets what is wrong.
    """
    names = [name] if count == 1 else [f'{name}_{number}' for number in range(count)]
    given = listing(section, 'channel_names', findings)
    if given is not None:
        names = [_text(item, findings) for item in given.items]
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
    if len(set(names)) != count:
        place = section.entries['channel_names'].place
        findings.error(place, 'two channels have one name', 'give each a name of its own')
    return tuple(
        _axis(replace(drive, name=name, channel=channel), part, findings)
        for channel, (name, part) in enumerate(zip(names, parts, strict=True))
    )


def _axis(drive: DriveConfig, part: Item | None, findings: Findings) -> DriveConfig:
    if part is None:
        return drive
    if not isinstance(part, Mapping):
        findings.error(
            part.place,
            f'expected the keys of a channel, got {scalars.describe(part)}',
            "write '- {scale_pos_to_dev: 1000.0}' and the like",
        )
        return drive
    values = _with_inverse_effort(read_section(part, CHANNEL_KEYS, findings))
    _check_one_rule(part, values, findings)
    if any(key in part.entries for key in SCALE_KEYS):
        values['scale_from_factor_group'] = False
    return replace(drive, **values)


def _switching_state(section: Mapping, values: dict[str, Any], findings: Findings) -> DriveState:
    state = DriveState(values['switching_state'])
    if state is not DriveState.FAULT:
        return state
    findings.warning(
        section.entries['switching_state'].place,
        '8 is Fault, in which no drive switches its mode; taken as 5 (Operation enabled)',
        'write switching_state: 5',
    )
    return DriveState.OPERATION_ENABLED


def _check_one_rule(section: Mapping, values: dict[str, Any], findings: Findings) -> None:
    """Refuse scales beside those of the factor group."""
    given = [key for key in SCALE_KEYS if key in section.entries]
    if given and values.get('scale_from_factor_group'):
        findings.error(
            section.entries['scale_from_factor_group'].place,
            f'the units are given twice: by the factor group of the drive, and by {given[0]}',
            'remove one of them',
        )


def _with_inverse_effort(values: dict[str, Any]) -> dict[str, Any]:
    """Let an effort be read in the unit in which it is commanded, unless bus.yml says both."""
    scale = values.get('scale_eff_to_dev')
    return values if scale is None else {'scale_eff_from_dev': 1.0 / scale} | values


def _policy(item: Item, text: str, findings: Findings) -> RecoveryPolicy:
    if text not in POLICIES:
        findings.error(item.place, f'unknown policy {text!r}', f'take {" or ".join(POLICIES)}')
    return POLICIES.get(text, RecoveryPolicy.MANUAL)


def _text(item: Item, findings: Findings) -> str:
    try:
        return scalars.text(item)
    except RefusedError as reason:
        findings.refuse(item.place, reason)
        return ''
