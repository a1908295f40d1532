# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of a bus.yml as a whole, beyond what each file by itself allows.

``load_bus`` refuses what cannot be understood or cannot run. Here is looked for what runs and
disappoints: times that do not fit each other, objects that no PDO carries, a bus that is full.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from canopen_core import Findings, Problem

from ..bus import BusConfig
from .drive_units import axis_units, AxisUnits, check_units
from .drives import check_drive
from .io_devices import check_io_device
from .network import (
    check_heartbeats,
    check_identifiers,
    check_master,
    check_sync,
    check_writes,
)
from .pdos import check_pdos
from .subject import Subject
from .traffic import estimate_load, LoadEstimate

__all__ = ['Report', 'check_bus']

HIGH_LOAD = 0.7
"""Share of the time above which frames of low priority begin to wait noticeably."""

DEVICE_CHECKS: tuple[Callable[[Subject], None], ...] = (
    check_drive,
    check_io_device,
    check_units,
    check_pdos,
    check_heartbeats,
    check_sync,
    check_writes,
)


@dataclass(frozen=True, slots=True)
class Report:
    """What was found."""

    errors: tuple[Problem, ...]  # what cannot work
    warnings: tuple[Problem, ...]  # what works, and probably not as it was meant
    # what the bus will carry, None when the file could not be read
    load: LoadEstimate | None = None
    units: tuple[AxisUnits, ...] = ()  # what 1.0 means for each axis of a drive


def check_bus(
    config: BusConfig, bitrate: int | None = None, findings: Findings | None = None
) -> Report:
    """Check a bus as a whole.

    The bit rate in [bit/s] replaces that of bus.yml. Findings have what was found before.
    """
    findings = Findings() if findings is None else findings
    subjects = [Subject(config, node, findings) for node in config.nodes]
    check_master(config, findings)
    for subject in subjects:
        for check in DEVICE_CHECKS:
            check(subject)
    check_identifiers(subjects)
    load = estimate_load(config, bitrate)
    _check_load(config, load, findings)
    warnings = sorted(findings.warnings, key=lambda problem: (str(problem.file), problem.line))
    units = tuple(
        axis_units(subject, axis)
        for subject in subjects
        if subject.node.is_drive
        for axis in subject.node.axes
    )
    return Report(findings.errors, tuple(warnings), load, units)


def _check_load(config: BusConfig, load: LoadEstimate, findings: Findings) -> None:
    if load.load <= HIGH_LOAD:
        return
    place = config.place_of('master', 'sync_period')
    at = f'{load.frames_per_second:.0f} frames/s at {load.bitrate / 1000:g} kbit/s'
    remedy = 'make sync_period longer, map fewer or shorter PDOs, or raise the bit rate'
    if load.load > 1:
        message = f'the bus cannot carry this: {at} are a load of {load.load:.0%}'
        findings.error(place, message, remedy)
    else:
        message = f'{at} are a load of {load.load:.0%} ({load.load_worst:.0%} at worst)'
        findings.warning(place, message, remedy)
