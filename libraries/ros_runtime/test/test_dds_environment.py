# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What DDS reaches, and the variables and profiles that keep it to that."""

from pathlib import Path
import socket
import tempfile
import xml.etree.ElementTree as ET

import pytest

from dds_network import (
    Interface,
    is_this_host,
    NETWORK_VARIABLE,
    NetworkChoiceError,
    open_dds,
    participants_on_this_host,
    PROFILE_VARIABLE,
    Reach,
    restrict_dds,
    selected_reach,
)
from dds_network.environment import profile_file, profile_text
from dds_network.reach import has_link, LOCALHOST_PROFILE, read_interfaces, resolve_reach
from dds_network.shell import main

OWN = [{PROFILE_VARIABLE: '/home/me/dds.xml'}, {'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'}]
OPEN = Reach((Interface('eth0', '10.0.0.5'),), ('10.0.0.9',))


def texts(profile: str, tag: str) -> list[str]:
    """Return the texts of all elements of a name."""
    root = ET.fromstring(profile)  # noqa: S314  # our own
    return [element.text or '' for element in root.iter() if element.tag.endswith(f'}}{tag}')]


def children(profile: str, tag: str) -> list[str]:
    """Return the texts of what the first element of a name holds."""
    root = ET.fromstring(profile)  # noqa: S314  # our own
    found = next(element for element in root.iter() if element.tag.endswith(f'}}{tag}'))
    return [element.text or '' for element in found]


def test_the_default_is_loopback_alone() -> None:
    """Whatever the variables of ROS and Fast DDS say; a file that is always there."""
    environ = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'ROS_LOCALHOST_ONLY': '1'}
    environ['FASTDDS_BUILTIN_TRANSPORTS'] = 'SHM'
    assert restrict_dds(environ) == Reach()
    assert environ[PROFILE_VARIABLE] == str(LOCALHOST_PROFILE)
    assert environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SYSTEM_DEFAULT'
    assert environ['ROS_LOCALHOST_ONLY'] == '0'
    profile = LOCALHOST_PROFILE.read_text(encoding='utf-8')
    assert children(profile, 'interfaceWhiteList') == ['127.0.0.1']
    assert texts(profile, 'type') == ['UDPv4']
    assert texts(profile, 'useBuiltinTransports') == ['false']
    assert texts(profile, 'non_blocking_send') == ['true']
    assert texts(profile, 'nanosec') == ['250000000']


def test_an_open_profile_adds_interfaces_and_peers() -> None:
    """Loopback stays, and discovery by multicast beside the peers; announcements are rare."""
    profile = profile_text(OPEN)
    assert texts(profile, 'leaseAnnouncement') == []
    assert children(profile, 'interfaceWhiteList') == ['127.0.0.1', '10.0.0.5']
    assert texts(profile, 'address')[-2:] == ['239.255.0.1', '10.0.0.9']


def test_profiles_are_written_for_this_user_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder that another user could have prepared is refused."""
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    file = profile_file(OPEN)
    assert file == profile_file(OPEN)
    assert file.read_text(encoding='utf-8') == profile_text(OPEN)
    assert file.parent.stat().st_mode & 0o077 == 0
    trap = tmp_path / 'elsewhere'
    file.parent.rename(trap)
    file.parent.symlink_to(trap)
    with pytest.raises(NetworkChoiceError):
        profile_file(OPEN)


def test_the_option_goes_before_the_variable() -> None:
    """Whatever a person names last counts; what does not exist is refused."""
    environ = {NETWORK_VARIABLE: 'no.such.interface.invalid'}
    with pytest.raises(NetworkChoiceError):
        open_dds(environ, None)
    open_dds(environ, 'localhost')
    assert environ[PROFILE_VARIABLE] == str(LOCALHOST_PROFILE)
    assert is_this_host(environ)


@pytest.mark.parametrize('own', OWN)
def test_transports_of_a_person_are_left_alone(own: dict[str, str]) -> None:
    """It decides, and nothing reports that DDS stays on this host."""
    environ = dict(own)
    restrict_dds(environ)
    assert environ == own
    assert not is_this_host(environ)


@pytest.mark.parametrize('named', ['lo', 'localhost', 'no.such.interface.invalid'])
@pytest.mark.parametrize('own', OWN)
def test_a_choice_that_would_be_ignored_is_refused(own: dict[str, str], named: str) -> None:
    """By the variable or by --network, which would have no effect."""
    environ = {NETWORK_VARIABLE: named, **own}
    (decider,) = own.items()
    for call in (restrict_dds, selected_reach, is_this_host, lambda env: open_dds(env, None)):
        with pytest.raises(NetworkChoiceError, match='='.join(decider)):
            call(environ)
    with pytest.raises(NetworkChoiceError, match='unset one of the two'):
        open_dds(dict(own), named)
    assert environ == {NETWORK_VARIABLE: named, **own}


def test_a_profile_of_our_own_is_no_foreign_one() -> None:
    """Processes that we start get ours, and the variable beside it."""
    environ = {NETWORK_VARIABLE: 'localhost', 'RMW_IMPLEMENTATION': 'rmw_fastrtps_cpp'}
    restrict_dds(environ)
    assert restrict_dds(environ) == Reach()


def test_discovery_that_is_off_stays_off() -> None:
    """ROS_AUTOMATIC_DISCOVERY_RANGE=OFF is narrower than any profile."""
    environ = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF'}
    restrict_dds(environ)
    assert environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'OFF'


@pytest.mark.parametrize(
    ('name', 'value', 'remedy'),
    [
        ('ROS_STATIC_PEERS', '10.0.0.9', f'export {NETWORK_VARIABLE}='),
        ('ROS_DISCOVERY_SERVER', '10.0.0.9:11811', f'export {NETWORK_VARIABLE}='),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET', f'export {NETWORK_VARIABLE}='),
        ('FASTDDS_BUILTIN_TRANSPORTS', 'SHM', PROFILE_VARIABLE),
    ],
)
def test_settings_without_effect_are_reported(
    name: str, value: str, remedy: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """With its remedy; one that changes nothing is not spoken of."""
    assert main({'ROS_DISCOVERY_SERVER': '127.0.0.1', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}) == 0
    assert not capsys.readouterr().err
    assert main({name: value}) == 0
    said = capsys.readouterr().err
    assert f'{name}={value} has no effect' in said
    assert remedy in said


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


def test_a_participant_is_counted_by_its_port_for_discovery() -> None:
    """In its own domain, once, of any vendor."""
    domain = 230  # ports above those that the kernel hands out
    before = participants_on_this_host(domain)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
        port = 7410 + 250 * domain + 2 * 60
        there.bind(('127.0.0.1', port))
        assert participants_on_this_host(domain) == before + 1
        assert participants_on_this_host(domain + 1) == 0
    assert participants_on_this_host(domain) == before
