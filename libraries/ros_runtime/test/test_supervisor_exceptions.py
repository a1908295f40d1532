# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is said where something did not come in time."""

from __future__ import annotations

import pytest

from process_supervisor.exceptions import no_answer


@pytest.mark.parametrize(
    ('waited', 'text'), [(14.9987, '15 s'), (0.25, '0.2 s'), (120.0, '120 s'), (0.0, '0 s')]
)
def test_the_time_is_rounded_and_a_busy_machine_is_thought_of(waited: float, text: str) -> None:
    """The rest of a time-out is no round number, and its digits have no meaning."""
    message = str(no_answer('the answers of joint1/init', waited))
    assert message.startswith(f'waited {text} in vain for the answers of joint1/init; ')
    assert 'is this machine too busy?' in message
