# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a drive reports, as the rows of a table."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

DRIVE_ROWS = {
    'nmt_state': 'NMT',
    'state': 'CiA 402',
    'mode': 'mode',
    'statusword': 'statusword',
    'error_code': 'error',
    'emergency': 'EMCY',
    'emergencies': 'EMCYs before',
    'position': 'position',
    'setpoint': 'set-point',
    'following_error': 'following error',
    'temperature': 'temperature',
    'missed_pdos': 'missed PDOs',
}
"""Values of the diagnostics of a drive that are shown, and what they are called."""
BUS_ROWS = {'bus_load': 'bus load [%]', 'frames_lost': 'frames lost', 'jitter_p99': 'jitter [s]'}
"""The same of the bus."""


def drive_html(message: str, values: Mapping[str, str], bus: Mapping[str, str]) -> str:
    """Return the table of a drive; what is not reported, or empty, has no row."""
    shown = [(title, values.get(key, '')) for key, title in DRIVE_ROWS.items()]
    shown += [(title, bus.get(key, '')) for key, title in BUS_ROWS.items()]
    rows = ''.join(
        f'<tr><td style="vertical-align:top;padding-right:1em">{escape(title)}</td>'
        f'<td>{escape(text)}</td></tr>'
        for title, text in shown
        if text
    )
    return (
        f'<div style="margin:0.3em 1em"><b>{escape(message)}</b>'
        f'<table style="font-variant-numeric:tabular-nums">{rows}</table></div>'
    )
