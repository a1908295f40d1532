# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A recording as a back end: states come in their order, and the last one stays."""

from __future__ import annotations

import pytest

from quad_description import JointSample, RecordedBackend, RobotState

STATES = [RobotState(JointSample((0.1 * tick,), None), time=0.02 * tick) for tick in range(3)]


def test_a_recording_plays_its_states() -> None:
    """A step goes on by one, and an observation by none; targets are kept."""
    with RecordedBackend(['joint'], STATES) as backend:
        assert backend.reset() is backend.observe() is STATES[0]
        assert not backend.finished
        assert backend.step((1.0,)) is STATES[1]
        assert backend.step(None) is backend.observe() is STATES[2]
        assert backend.finished
        assert backend.step((2.0,)) is STATES[2]
        assert backend.sent == [(1.0,), None, (2.0,)]
        assert backend.reset() is STATES[0]
        assert backend.sent == []


def test_nothing_recorded_is_refused() -> None:
    """There would be no state to begin with."""
    with pytest.raises(ValueError, match='at least one state'):
        RecordedBackend(['joint'], [])
