# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The link between two hosts does to frames what its condition says."""

from __future__ import annotations

import json
import os
from pathlib import Path
import sys

from link_probe import GROUP
from network_hosts import Host, two_linked_hosts
from network_link import Condition

PROBE = [sys.executable, str(Path(__file__).with_name('link_probe.py'))]
COUNT = 300


def answers(host: Host, target: str, count: int = COUNT, wait: float = 2.0) -> tuple[int, float]:
    """Return how many of the questions were answered, and the shortest time that took [s]."""
    command = [*PROBE, 'ask', host.address, target, str(count), str(wait)]
    with host.run(command, os.environ) as asking:
        found = json.loads(asking.wait_for('^{'))
        return found['answers'], found['quickest']


def test_a_link_delays_loses_and_is_cut() -> None:
    """Both ways; what is lost is a share of what was sent."""
    with (
        two_linked_hosts() as (robot, desk, link),
        robot.run([*PROBE, 'echo', robot.address], os.environ) as echo,
    ):
        echo.wait_for('open')
        assert answers(desk, robot.address)[0] == COUNT
        assert answers(desk, GROUP)[0] == COUNT
        link.condition = Condition(delay=0.1, jitter=0.01)
        count, quickest = answers(desk, robot.address)
        assert count == COUNT
        assert quickest >= 2 * link.condition.delay
        # of 300 questions 196 are answered where a fifth is lost each way, give or take 9
        link.condition = Condition(loss=0.2)
        assert 140 < answers(desk, robot.address)[0] < 250
        link.condition = Condition(multicast=False)
        assert answers(desk, GROUP, 10, 0.2)[0] == 0
        assert answers(desk, robot.address, 10)[0] == 10
        link.condition = Condition(cut=True)
        assert answers(desk, robot.address, 10, 0.2)[0] == 0
        link.condition = Condition()
        assert answers(desk, robot.address, 10)[0] == 10
