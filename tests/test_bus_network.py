# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated bus stays on its host: nothing enters and nothing leaves by a cable."""

from __future__ import annotations

import os
from pathlib import Path
import sys

from isolation import Isolation
from network_hosts import two_hosts
import pytest

pytestmark = pytest.mark.scenario
PROGRAM = [sys.executable, str(Path(__file__).with_name('bus_host.py'))]


def test_nothing_enters_or_leaves_by_the_cable(isolation: Isolation) -> None:
    """Although the group is joined on the cable, too, as a tool of python-can would do."""
    env = os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)}
    _, group, port = isolation.bus.split(':')
    with two_hosts() as (robot, desk):
        listen = ['listen', isolation.bus, robot.address]
        attack = ['attack', group, port, desk.address, robot.address]
        with robot.run([*PROGRAM, *listen], env) as bus:
            bus.wait_for('open')
            sent = robot.packets()[1]
            with desk.run([*PROGRAM, *attack], env) as attacker:
                attacker.wait_for('sent')
                # beside it a second member of the bus, which is received
                with robot.run([*PROGRAM, *listen], env):
                    bus.wait_for('080', count=20)
            assert robot.packets()[0] > 20
            assert '666' not in bus.lines
            # it has sent dozens of frames: what left is ARP, ICMP and IGMP
            assert robot.packets()[1] - sent < 20
