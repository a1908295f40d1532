# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0

import socket

import pytest

from dds_network import Interface, NetworkChoiceError, Reach
from dds_network.reach import has_link, read_interfaces, resolve_reach

INTERFACES = {'lo': '127.0.0.1', 'eth0': '10.0.0.5', 'wlan0': '192.168.1.5'}
HOSTS = {
    'robot': '192.168.1.20',
    '10.0.0.9': '10.0.0.9',
    '10.0.0.5': '10.0.0.5',
    'localhost': '127.0.0.1',
    '8.8.8.8': '8.8.8.8',
    '172.16.0.1': '172.16.0.1',
}
ROUTES = {'192.168.1.20': '192.168.1.5', '10.0.0.9': '10.0.0.5', '172.16.0.1': '172.16.0.99'}
ETH, WLAN = Interface('eth0', '10.0.0.5'), Interface('wlan0', '192.168.1.5')


def resolve_host(name: str) -> str:
    """Know the hosts above only."""
    if name not in HOSTS:
        raise socket.gaierror(name)
    return HOSTS[name]


def source_address(peer: str) -> str:
    """Know the routes above only."""
    if peer not in ROUTES:
        raise OSError(101, 'Network is unreachable')
    return ROUTES[peer]


@pytest.mark.parametrize(
    ('text', 'reach'),
    [
        ('', Reach()),
        ('localhost', Reach()),
        ('lo', Reach()),
        ('eth0', Reach((ETH,))),
        ('wlan0, eth0', Reach((WLAN, ETH))),
        ('10.0.0.5', Reach((ETH,))),  # an own address is its interface
        ('robot', Reach((WLAN,), ('192.168.1.20',))),
        ('eth0 robot robot 10.0.0.9', Reach((ETH, WLAN), ('192.168.1.20', '10.0.0.9'))),
    ],
)
def test_interfaces_and_peers(text: str, reach: Reach) -> None:
    """A peer opens the interface that leads to it, and nothing else."""
    found = resolve_reach(text, INTERFACES, resolve_host, source_address, lambda _: True)
    assert found == reach


@pytest.mark.parametrize('text', ['eth1', 'eth0,robo', '8.8.8.8', '172.16.0.1', '*'])
def test_what_does_not_exist_is_refused(text: str) -> None:
    """Unknown names, no route, and a source address that no interface has."""
    with pytest.raises(NetworkChoiceError):
        resolve_reach(text, INTERFACES, resolve_host, source_address, lambda _: True)


def test_an_interface_without_link_is_left_out() -> None:
    """With the peers behind it; it is reported, as connecting it later opens nothing."""

    def is_wlan(name: str) -> bool:
        return name == 'wlan0'

    text = 'eth0 10.0.0.9 usb0 robot'
    interfaces = INTERFACES | {'usb0': ''}
    found = resolve_reach(text, interfaces, resolve_host, source_address, is_wlan)
    assert found == Reach((WLAN,), ('192.168.1.20',), ('eth0', 'usb0'))
    assert 'eth0 has no link or no address' in found.describe()
    alone = resolve_reach('eth0', interfaces, resolve_host, source_address, is_wlan)
    assert alone.is_this_host
    assert 'stays on this host; eth0 has no link' in alone.describe()


def test_the_loopback_interface_has_a_link() -> None:
    """As the kernel says it."""
    assert read_interfaces()['lo'] == '127.0.0.1'
    assert has_link('lo')
    assert not has_link('no.such.device')
