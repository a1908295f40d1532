# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An arm and a host beside it: closed unless opened, and stopped when the link is cut."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import ipaddress
import json
from pathlib import Path
import sys
from typing import Any

from isolation import Isolation
from network_hosts import Host, two_hosts
from processes import executable, RunningProcess
import pytest

from dds_network import PROFILE_VARIABLE, restrict_dds

pytestmark = pytest.mark.scenario

CLIENT = str(Path(__file__).with_name('network_client.py'))
HALT = '/panda_joint1/halt'
LOOK = 3.0  # [s] a host that is open is seen in a tenth of that


def foreign(isolation: Isolation, **variables: str) -> dict[str, str]:
    """Return the environment of a host that has ROS alone."""
    env = isolation.env
    for name in (PROFILE_VARIABLE, 'ROS_AUTOMATIC_DISCOVERY_RANGE'):
        env.pop(name, None)
    return env | variables


def beside(isolation: Isolation) -> dict[str, str]:
    """Return the environment of a process of the robot's host that shares no memory with it."""
    env = isolation.env | {'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
    restrict_dds(env)
    return env


@contextmanager
def brought_up(
    host: Host, isolation: Isolation, *arguments: str, **variables: str
) -> Iterator[RunningProcess]:
    """Bring a simulated arm up on a host, with its drives enabled."""
    command = [executable('arm_bringup', 'bringup'), 'panda', '--simulate', '--enable', *arguments]
    with host.run([*command, '--can', isolation.bus], isolation.env | variables) as bringup:
        bringup.wait_for('drives are enabled', 40.0)
        yield bringup


def look(host: Host, env: dict[str, str], duration: float = LOOK) -> dict[str, Any]:
    """Return what another host finds, and the answer of a service that it calls."""
    with host.run([sys.executable, CLIENT, 'call', HALT, str(duration)], env) as client:
        found: dict[str, Any] = json.loads(client.wait_for(r'^\{', duration + 30.0))
        return found


def test_nobody_comes_in_uninvited(isolation: Isolation) -> None:
    """No socket listens off loopback, and neither peers nor multicast find a node."""
    with two_hosts() as (robot, desk), brought_up(robot, isolation):
        addresses = {ipaddress.IPv4Address(address) for address in robot.udp_addresses()}
        assert len(addresses) > 1
        assert all(address.is_loopback or address.is_multicast for address in addresses)
        before = robot.packets()[1]
        for variables in (
            {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'ROS_STATIC_PEERS': robot.address},
            {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'},
        ):
            assert look(desk, foreign(isolation, **variables)) == {'nodes': [], 'answer': None}
        assert robot.packets()[0] > 0  # they did knock
        assert robot.packets()[1] - before < 20  # ARP, ICMP and IGMP answer; DDS does not
        # a process of this host reaches it, also by the loopback interface alone
        assert look(robot, beside(isolation), 3 * LOOK)['answer'] is True


def test_a_cut_link_stops_the_arm_and_heals(isolation: Isolation) -> None:
    """Opened to an interface, jogged by another host: the time-out stops it, and it goes on."""
    with two_hosts() as (robot, desk):
        env = foreign(isolation)
        with (
            brought_up(robot, isolation, '--network', robot.interface) as bringup,
            robot.run([sys.executable, CLIENT, 'watch'], beside(isolation)) as watch,
            desk.run([sys.executable, CLIENT, 'jog'], env),
        ):
            assert robot.address in bringup.wait_for('DDS is open')
            watch.wait_for('^moving', 20.0)
            desk.set_link('down')
            cut = len([line for line in watch.lines if line.startswith('still')])
            watch.wait_for('^still', 10.0, cut + 1)
            moved = len([line for line in watch.lines if line.startswith('moving')])
            desk.set_link('up')
            watch.wait_for('^moving', 30.0, moved + 1)
