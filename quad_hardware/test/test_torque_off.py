# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What became of torque off, by the reports that came after it."""

from __future__ import annotations

from collections.abc import Mapping

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_hardware.protocol import LEG_MOTORS
from quad_hardware.report import check_torque_off, DELAY, NO_LOAD, Report, TIMEOUT, TorqueOffResult

ASKED, SENT = 10.0, 10.01  # [s]
LATE = ASKED + TIMEOUT
LIMP = dict.fromkeys(LEG_MOTORS, 0.0)
WIRE = 0.001  # [s]


def report_of(loads: Mapping[int, float] | None, arrival: float) -> Report:
    """Return a report of loads [%]."""
    return Report(
        arrival=arrival, wire_time=WIRE, attitude=(0.0, 0.0, 0.0), acceleration=None,
        positions={}, velocities={}, loads=loads,
    )  # fmt: skip


@pytest.mark.parametrize(
    ('loads', 'found', 'in_the_end'),
    [
        (LIMP, TorqueOffResult.LIMP, TorqueOffResult.LIMP),
        ({**LIMP, 11: -NO_LOAD}, TorqueOffResult.LIMP, TorqueOffResult.LIMP),
        ({**LIMP, 11: -12.0}, None, TorqueOffResult.PULLS),
        ({**LIMP, 99: 12.0}, TorqueOffResult.LIMP, TorqueOffResult.LIMP),
        ({motor: 0.0 for motor in LEG_MOTORS if motor != 11}, None, TorqueOffResult.UNKNOWN),
        ({motor: 12.0 for motor in LEG_MOTORS if motor != 11}, None, TorqueOffResult.PULLS),
        (None, TorqueOffResult.NOT_REPORTED, TorqueOffResult.NOT_REPORTED),
        ({}, TorqueOffResult.NOT_REPORTED, TorqueOffResult.NOT_REPORTED),
    ],
)
def test_a_report_after_torque_off_shows_what_became_of_it(
    loads: Mapping[int, float] | None, found: TorqueOffResult | None, in_the_end: TorqueOffResult
) -> None:
    """Servos that pull may still let go; one that is not reported is not known to have."""
    report = report_of(loads, SENT + DELAY + 2.0 * WIRE)
    assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, report.arrival) is found
    assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, LATE) is in_the_end


@given(st.floats(-1.0, DELAY + 0.5 * WIRE), st.sampled_from([LIMP, None]))
def test_a_report_of_before_shows_nothing(after: float, loads: Mapping[int, float] | None) -> None:
    """It was made while the servos held, or may have been on its way when they let go."""
    report = report_of(loads, SENT + after)
    assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, SENT + 0.1) is None
    assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, LATE) is TorqueOffResult.UNKNOWN


def test_what_was_not_sent_let_nobody_go() -> None:
    """Whatever is reported meanwhile."""
    report = report_of(LIMP, ASKED + 0.3)
    assert check_torque_off(report, LEG_MOTORS, ASKED, None, ASKED + 0.3) is None
    assert check_torque_off(report, LEG_MOTORS, ASKED, None, LATE) is TorqueOffResult.UNSENT
    assert check_torque_off(None, LEG_MOTORS, ASKED, SENT, LATE) is TorqueOffResult.UNKNOWN
    assert [each for each in TorqueOffResult if each.succeeded] == [
        TorqueOffResult.LIMP,
        TorqueOffResult.NOT_REPORTED,
    ]
