# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether servos have let go: what they report after torque off was sent, not what was sent."""

from __future__ import annotations

from collections.abc import Collection
from enum import Enum

from .report import Report

TIMEOUT = 0.5  # [s] for servos to let go, and for a report that shows it
NO_LOAD = 1.0  # [%] of the stall torque
# [s] from torque off to a report that was made later: an adapter holds bytes for 16 ms either way
DELAY = 0.04


class TorqueOffResult(Enum):
    """What became of torque off, in words."""

    LIMP = 'the servos are without torque'
    PULLS = 'torque off was sent, and the servos still report load: keep clear, switch it off'
    UNKNOWN = (
        'torque off was sent, and not all servos report since then whether they let go: '
        'keep clear, switch it off'
    )
    UNSENT = 'torque off may not have been sent: keep clear, switch it off'
    NOT_REPORTED = 'torque off was sent; this protocol reports no load that would confirm it'

    @property
    def succeeded(self) -> bool:
        """Whether nothing that is reported speaks against it."""
        return self in {TorqueOffResult.LIMP, TorqueOffResult.NOT_REPORTED}


def check_torque_off(
    report: Report | None,
    motors: Collection[int],
    asked_at: float,
    sent_at: float | None,
    now: float,
) -> TorqueOffResult | None:
    """Return what became of torque off; None while a later report may show it.

    Args:
        report: The newest one that can be; None without.
        motors: Ids of those that have to let go.
        asked_at: When it was requested [s], on the clock of the reports' arrivals.
        sent_at: When it was given to the line [s]; None before.
        now: When this is asked [s].
    """
    found = TorqueOffResult.UNSENT if sent_at is None else TorqueOffResult.UNKNOWN
    if sent_at is not None and report is not None and _made_at(report) >= sent_at + DELAY:
        if not report.loads:
            return TorqueOffResult.NOT_REPORTED
        known = [abs(report.loads[motor]) for motor in motors if motor in report.loads]
        if max(known, default=0.0) > NO_LOAD:
            found = TorqueOffResult.PULLS
        elif len(known) == len(motors):
            return TorqueOffResult.LIMP
    return found if now - asked_at >= TIMEOUT else None


def _made_at(report: Report) -> float:
    """Return when a report was made at the latest [s], if no adapter held it back."""
    return report.arrival - report.wire_time
