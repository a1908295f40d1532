# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0

from pathlib import Path
import tempfile
import xml.etree.ElementTree as ET

import pytest

from dds_network import (
    Interface,
    is_this_host,
    NETWORK_VARIABLE,
    NetworkChoiceError,
    open_dds,
    PROFILE_VARIABLE,
    Reach,
    restrict_dds,
    selected_reach,
)
from dds_network.profile import LOCALHOST_PROFILE, profile_file, profile_text
from dds_network.shell import main

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


@pytest.mark.parametrize(
    'own', [{PROFILE_VARIABLE: '/home/me/dds.xml'}, {'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'}]
)
def test_transports_of_a_person_are_left_alone(own: dict[str, str]) -> None:
    """It decides, and nothing reports that DDS stays on this host."""
    environ = dict(own)
    restrict_dds(environ)
    assert environ == own
    assert not is_this_host(environ)


@pytest.mark.parametrize('named', ['lo', 'localhost', 'no.such.interface.invalid'])
@pytest.mark.parametrize(
    'own', [{PROFILE_VARIABLE: '/home/me/dds.xml'}, {'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'}]
)
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
