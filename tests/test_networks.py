# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Hosts with a cable: who may enter, clients of another host, links that are cut or slow."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, ExitStack
import ipaddress
import json
import os
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

import browser as chromium
from isolation import Isolation
from network_hosts import Condition, Host, two_hosts, two_linked_hosts
from processes import executable, RunningProcess
import pytest
from terminals import held_key

from dds_network import NETWORK_VARIABLE, PROFILE_VARIABLE

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.scenario

CLIENT = str(Path(__file__).with_name('network_client.py'))
HALT = '/panda_joint1/halt'
ROBOT, DESK = '10.77.0.1', '10.77.0.2'
SERVER_VARIABLE = 'ROS_DISCOVERY_SERVER'
STOP = """
import contextlib, sys, time, urllib.error, urllib.request
while True:
    request = urllib.request.Request(sys.argv[1] + '/stop', headers={'X-Robot-Stop': '1'})
    with contextlib.suppress(urllib.error.HTTPError):  # what stops is not known yet
        urllib.request.urlopen(request, timeout=10.0).read()
    time.sleep(0.5)
"""
LOOK = 3.0  # [s] a host that is open is seen in a tenth of that


def foreign(isolation: Isolation, **variables: str) -> dict[str, str]:
    """Return the environment of a host that has ROS alone."""
    env = isolation.env
    for name in (PROFILE_VARIABLE, 'ROS_AUTOMATIC_DISCOVERY_RANGE'):
        env.pop(name, None)
    return env | variables


@contextmanager
def brought_up(
    host: Host, isolation: Isolation, *arguments: str, **variables: str
) -> Iterator[RunningProcess]:
    """Bring a simulated arm up on a host: its drives alone, or with ``--enable`` what moves it."""
    alone = [] if '--enable' in arguments else ['--drives-only']
    command = [executable('arm_bringup', 'bringup'), 'panda', '--simulate', *alone, *arguments]
    with host.run([*command, '--can', isolation.bus], isolation.env | variables) as bringup:
        bringup.wait_for('all is ready' if alone else 'drives are enabled', 90.0)
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
        # processes of this host reach it, also those that have ROS alone, and its own transports
        assert look(robot, isolation.env, 3 * LOOK)['answer'] is True
        beside = foreign(isolation, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
        assert look(robot, beside, 3 * LOOK)['answer'] is True


def test_an_arm_whose_cable_is_not_plugged_in_works_on_its_host(isolation: Isolation) -> None:
    """It says why no client can connect, also once the cable is plugged in."""
    with two_hosts() as (robot, desk):
        desk.set_link('down')
        robot.wait_for_link('DOWN')
        with brought_up(robot, isolation, '--network', robot.interface) as bringup:
            assert 'cable0 has no link' in bringup.wait_for('DDS stays on this host')
            env = isolation.env | {NETWORK_VARIABLE: robot.interface}
            assert look(robot, env)['answer'] is True


@pytest.mark.parametrize(
    ('server', 'network', 'variables'),
    [
        ('', DESK, {NETWORK_VARIABLE: ROBOT}),
        (ROBOT, 'cable0', {NETWORK_VARIABLE: 'cable1', SERVER_VARIABLE: ROBOT}),
    ],
    ids=['peers', 'server'],
)
def test_without_multicast_both_sides_name_where_they_meet(
    isolation: Isolation, server: str, network: str, variables: dict[str, str]
) -> None:
    """As in many Wi-Fi networks, where an open interface alone is not found."""
    with two_linked_hosts() as (robot, desk, link), ExitStack() as stack:
        assert (robot.address, desk.address) == (ROBOT, DESK)
        link.condition = Condition(multicast=False)
        own = {SERVER_VARIABLE: server} if server else {}
        if server:
            command = ['fast-discovery-server', '-i', '0', '-l', server]
            meeting = stack.enter_context(robot.run(command, isolation.env))
            meeting.wait_for('Server is running', 20.0)
        stack.enter_context(brought_up(robot, isolation, '--network', network, **own))
        if server:  # to a peer the robot announces itself
            assert look(desk, foreign(isolation)) == {'nodes': [], 'answer': None}
        call = ['ros2', 'service', 'call', HALT, 'std_srvs/srv/Trigger']
        with desk.run(call, isolation.env | variables) as client:
            client.wait_for('success=True', 40.0)


def test_a_link_that_is_cut_or_slow_stops_the_arm_and_heals(isolation: Isolation) -> None:
    """A key held on another computer; what comes late counts as little as what is lost."""
    key = [executable('arm_servo', 'servo_keyboard_input'), '--ros-args']
    key += ['-p', 'speed:=0.2', '-p', 'first_timeout:=1.0', '-p', 'repeat_timeout:=1.0']
    with two_linked_hosts() as (robot, desk, link):
        env = isolation.env | {NETWORK_VARIABLE: desk.interface}
        with (
            brought_up(robot, isolation, '--enable', '--network', robot.interface) as bringup,
            robot.run([sys.executable, CLIENT, 'watch'], isolation.env) as watch,
            desk.run([executable('robot_viewer', 'web_viewer')], env) as viewer,
            held_key('1', desk.command(key), env),
        ):
            assert robot.address in bringup.wait_for('DDS is open')
            watch.wait_for('^moving')
            for condition, state in (
                (Condition(cut=True), 'still'),
                (Condition(delay=0.02, jitter=0.01, loss=0.05), 'moving'),
                (Condition(delay=0.15), 'still'),
                (Condition(), 'moving'),
            ):
                before = sum(line.startswith(state) for line in watch.lines)
                link.condition = condition
                watch.wait_for(f'^{state}', 30.0, before + 1)
            assert 'incoming_command_timeout' in bringup.output
            # the page of the other computer stops what is jogged, while the key is still held
            line = viewer.wait_for(r'http://localhost:\d+$')
            before = sum(line.startswith('still') for line in watch.lines)
            with desk.run([sys.executable, '-c', STOP, line.rpartition(' ')[2]], env):
                watch.wait_for('^still', 30.0, before + 1)
                assert 'leads neither' not in viewer.wait_for('/stop: ')


def hold_until_it_moves(page: Page, button: str, watch: RunningProcess) -> None:
    """Hold a button, anew where the page let it go: on a busy machine the robot may be silent."""
    for last in (False, False, True):
        chromium.hold(page, button)
        try:
            watch.wait_until_last('^moving', 20.0)
        except AssertionError:
            if last or page.locator('.rv-held').count():
                raise
            page.mouse.up()
        else:
            return


@pytest.mark.timeout(300)
@pytest.mark.skipif(bool(chromium.lacking()), reason=chromium.lacking())
def test_a_page_of_the_other_side_jogs_and_stops_with_the_link(isolation: Isolation) -> None:
    """The button held goes on after a slow link; after a silent robot it is pressed anew."""
    with two_linked_hosts() as (robot, desk, link):
        env = isolation.env | {NETWORK_VARIABLE: desk.interface}
        with (
            brought_up(robot, isolation, '--enable', '--network', robot.interface),
            robot.run([sys.executable, CLIENT, 'watch'], isolation.env) as watch,
            desk.run([executable('robot_viewer', 'web_viewer')], env) as viewer,
            chromium.browser(desk.command([])) as browser,
        ):
            url = viewer.wait_for(r'http://localhost:\d+$').rpartition(' ')[2]
            page = chromium.open_page(browser, url)
            page.get_by_role('tab', name='Tool', exact=True).click(force=True)
            # there and back again, far from the limits of the joint
            for turn, fault in (
                ('Turn Z +', Condition(cut=True)),
                ('Turn Z −', Condition(delay=0.15)),
            ):
                hold_until_it_moves(page, turn, watch)
                link.condition = fault
                watch.wait_until_last('^still')
                if fault.cut:
                    chromium.state_is(page, 'NO CONTACT WITH THE ROBOT')
                    why = page.locator('#rv-why').text_content() or ''
                    assert why.startswith(f'{turn}: Nothing for')
                link.condition = Condition()
                if fault.cut:
                    chromium.state_is(page, 'READY')
                    page.mouse.up()
                    hold_until_it_moves(page, turn, watch)
                watch.wait_until_last('^moving')
                chromium.state_is(page, 'MOVING')
                page.mouse.up()
                watch.wait_until_last('^still')


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
