# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What viewers are shown on the topics of move_group, judged by what is seen of the robot."""

from __future__ import annotations

import contextlib
import math

import numpy as np

from process_supervisor import CallError

from .motions import Motions, SETTLE_TIMEOUT
from .results import apart, WORST_JOINT, WORST_PLACE
from .tool import PART


def judge_display(motions: Motions, first: int) -> None:
    """Judge whether a viewer has the robot where it rests; say what else it was shown.

    Args:
        motions: The motions of the demo.
        first: Number of the first path that counts.
    """
    name, client, results = 'viewer', motions.client, motions.results

    def off() -> float:
        here = motions.positions
        shown = client.observer.row(client.scene.joints)
        return float(np.abs(shown - here).max()) if client.scene.joints else math.inf

    with contextlib.suppress(CallError):
        motions.wait(lambda: off() <= WORST_JOINT, SETTLE_TIMEOUT, 'the scene')
    where = f'{name}: the robot in monitored_planning_scene'
    results.arrived(where, off(), WORST_JOINT, 'rad')
    paths = client.paths[first:]
    things = ', '.join(client.scene.objects) or 'nothing'
    results.add(
        name, f'{len(paths)} paths on display_planned_path; in the scene at the end: {things}'
    )


def judge_part(motions: Motions, name: str, *, attached: bool) -> None:
    """Judge whether the scene that viewers get has the part where it is.

    Args:
        motions: The motions of the demo.
        name: In which part of the demo.
        attached: The arm holds it.
    """
    client, results = motions.client, motions.results

    def right() -> bool:
        return (PART in client.scene.attached) == attached and (
            PART in client.scene.objects
        ) != attached

    try:
        motions.wait(right, SETTLE_TIMEOUT, 'the scene')
    except CallError:
        where = 'attached' if attached else 'in the world'
        results.problem(name, f'monitored_planning_scene does not have the part {where}')
        return
    if not attached:
        observer = client.observer
        seen = observer.scene.pose(PART, motions.positions)
        off, _ = apart(client.scene.objects[PART], seen)
        results.arrived(f'{name}: the part in monitored_planning_scene', off, WORST_PLACE, 'm')
