# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The axes of a drive: keys of bus.yml for all of them, and for each channel."""

from __future__ import annotations

from dataclasses import replace
import re
from typing import Any

from canopen_core import Findings, Place, RefusedError
from canopen_core.standard import DriveState

from ..model.drive import DriveConfig, RecoveryPolicy
from ..read import scalars
from ..read.document import Item, YamlMap
from ..read.section import listing, read_section
from ..sections import CHANNEL_KEYS, SCALE_KEYS

ROS_NAME = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
SCALE_TOLERANCE = 0.01  # by which the product of the scales of both directions may miss 1
POLICIES = {policy.value: policy for policy in RecoveryPolicy}


def read_drive(section: YamlMap, values: dict[str, Any], findings: Findings) -> DriveConfig:
    """Build the settings that count for all axes of a drive from its drive keys by field."""
    if 'switching_state' in values:
        values['switching_state'] = _switching_state(section, values, findings)
    if 'recovery' in values:
        text, place = values['recovery'], section.entries['recovery'].place
        if text not in POLICIES:
            findings.error(place, f'unknown policy {text!r}', f'take {" or ".join(POLICIES)}')
        values['recovery'] = POLICIES.get(text, RecoveryPolicy.MANUAL)
    return _with_scales(DriveConfig(), section, values, findings)


def check_node_name(name: str, place: Place, findings: Findings) -> None:
    """Refuse a name of a device or axis that no ROS node can have."""
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
    """Return one record for each axis; what counts for all of them is in drive."""
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
    if not isinstance(part, YamlMap):
        findings.error(
            part.place,
            f'expected the keys of a channel, got {scalars.describe(part)}',
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
    """Return an axis with the values of a section, be it of its device or of its channel."""
    _check_one_rule(section, values, findings)
    axis = replace(drive, **_with_inverses(values))
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


def _switching_state(section: YamlMap, values: dict[str, Any], findings: Findings) -> DriveState:
    state = DriveState(values['switching_state'])
    if state is not DriveState.FAULT:
        return state
    findings.warning(
        section.entries['switching_state'].place,
        '8 is Fault, in which no drive switches its mode; taken as 5 (Operation enabled)',
        'write switching_state: 5',
    )
    return DriveState.OPERATION_ENABLED


def _check_one_rule(section: YamlMap, values: dict[str, Any], findings: Findings) -> None:
    """Refuse scales beside those of the factor group."""
    given = [key for key in SCALE_KEYS if key in section.entries]
    if given and values.get('scale_from_factor_group'):
        findings.error(
            section.entries['scale_from_factor_group'].place,
            f'the units are given twice: by the factor group of the drive, and by {given[0]}',
            'remove one of them',
        )


def _with_inverses(values: dict[str, Any]) -> dict[str, Any]:
    """Add the scales that bus.yml gives in the other direction only, of our own keys."""
    inverses = (
        ('scale_eff_from_dev', 'scale_eff_to_dev'),
        ('scale_acc_from_dev', 'scale_acc_to_dev'),
        ('scale_acc_to_dev', 'scale_acc_from_dev'),
    )
    added = {key: 1.0 / values[given] for key, given in inverses if given in values}
    return added | values


def _axis_name(item: Item, findings: Findings) -> str:
    try:
        name = scalars.text(item)
    except RefusedError as reason:
        findings.refuse(item.place, reason)
        return ''
    check_node_name(name, item.place, findings)
    return name
