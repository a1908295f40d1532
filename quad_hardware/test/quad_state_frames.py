# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""State frames of protocol v2 from named values, and back."""

from __future__ import annotations

from types import SimpleNamespace

from quad_hardware.protocol import Frame, Kind, STATE

REST = {'battery': 100, 'acceleration': (0.0, 0.0, 9.8)}


def state_frame(**values: float | tuple[float, ...]) -> Frame:
    """Return a state frame; what is not given is zero, or that of a robot at rest."""
    runs = {part.name: (0,) * part.count for part in STATE.fields}
    for name, value in {**REST, **values}.items():
        runs[name] = value if isinstance(value, tuple) else (value,)
    return Frame(Kind.PUSH, STATE.address, STATE.pack(**runs))


def read_state(frame: Frame) -> SimpleNamespace:
    """Return the values of a state frame by name; ``euler2`` is the valid attitude."""
    runs = STATE.unpack(frame.payload)
    return SimpleNamespace(**{n: run if len(run) > 1 else run[0] for n, run in runs.items()})
