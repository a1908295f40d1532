# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Why the drives of an arm do not follow, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from arm_canopen import AxisFeedback

CYCLIC_MODES = frozenset({7, 8})
"""Modes of operation that follow a stream of positions (CiA 402-2, 0x6061)."""

FAULTS = frozenset({'FAULT', 'FAULT_REACTION_ACTIVE'})
"""Names of the states of a faulted drive."""


PLURAL = {'is': 'are', 'has': 'have', 'was': 'were', 'does': 'do'}
"""Words with which reasons begin, as they are said of several drives."""


def why_not(feedback: Sequence[AxisFeedback], released: Mapping[str, str]) -> str:
    """Say why the arm cannot follow; empty when it can.

    Args:
        feedback: State of each drive.
        released: Drives that were taken away, with the reason.
    """
    reasons = [_reason(axis, released.get(axis.name, '')) for axis in feedback]
    return '; '.join(_joined([reason for reason in reasons if reason]))


def _reason(axis: AxisFeedback, released: str) -> tuple[str, str] | None:
    """Return what is wrong with a drive; names and remedies are apart, to join equal ones."""
    if not axis.online:
        return axis.name, 'is offline; look after its power and its cable'
    if axis.refusal is not None and axis.refusal.cause.name == 'SILENT':
        return axis.name, f'{axis.refusal.cause.value}; look after its power and its cable'
    if axis.state.name in FAULTS:
        return axis.name, 'has a fault; call its ~/recover'
    if axis.state.name != 'OPERATION_ENABLED':
        return axis.name, f'is in state {axis.state.title}; call its ~/init'
    if axis.mode not in CYCLIC_MODES:
        return axis.name, (
            f'is in mode {axis.mode}; call its ~/cyclic_position_mode or'
            ' ~/interpolated_position_mode'
        )
    if not axis.followable:
        return axis.name, 'is moved or halted by another client, or the master ends'
    if released:
        return axis.name, f'{released}; the next command takes it back'
    return None


def _joined(reasons: Sequence[tuple[str, str]]) -> list[str]:
    """Name drives with the same trouble together."""
    names: dict[str, list[str]] = {}
    for name, reason in reasons:
        names.setdefault(reason, []).append(name)
    return [
        f'{", ".join(axes)} {reason if len(axes) == 1 else _of_several(reason)}'
        for reason, axes in names.items()
    ]


def _of_several(reason: str) -> str:
    """Return what is said of one drive, said of several."""
    verb, rest = reason.split(' ', 1)
    return f'{PLURAL[verb]} {rest.replace(" its ", " their ")}'.replace('takes it', 'takes them')
