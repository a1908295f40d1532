# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments that bring-ups and demos share."""

from __future__ import annotations

import argparse
import math

import pytest

from process_supervisor.arguments import seconds_from


def test_times_of_the_command_line() -> None:
    """Short, negative, endless and senseless times are refused with what they must be."""
    assert seconds_from(5.0)('5') == 5.0
    assert seconds_from(0.0, finite=False)('inf') == math.inf
    for text, least, words in [('4.9', 5.0, 'at least 5'), ('0', 0.0, 'above 0')]:
        with pytest.raises(argparse.ArgumentTypeError, match=words):
            seconds_from(least)(text)
    for text in ('nan', 'inf', '-1', 'soon'):
        with pytest.raises(argparse.ArgumentTypeError, match=f'{text} is no number of seconds'):
            seconds_from(0.0)(text)
