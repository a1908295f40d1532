# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sets the environment variables and the profile that configure Fast DDS and rmw."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
import os
from pathlib import Path
import stat
from typing import TYPE_CHECKING

from .reach import (
    LOCALHOST_PROFILE,
    NetworkChoiceError,
    PREFIX,
    Reach,
    read_interfaces,
    resolve_reach,
)

if TYPE_CHECKING:
    from xml.etree import ElementTree as ET

# RTPS 2.2, 9.6.1.4.1; naming peers takes the place of this default
_DISCOVERY_GROUP = '239.255.0.1'
_NAMESPACE = 'http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles'


def profile_file(reach: Reach) -> Path:
    """Return the profile file of a reach beyond loopback; write it if it does not exist.

    Raises:
        NetworkChoiceError: It cannot be written.
    """
    import hashlib
    import tempfile

    text = profile_text(reach)
    name = f'{PREFIX}{hashlib.sha256(text.encode()).hexdigest()[:16]}.xml'
    folder = Path(tempfile.gettempdir()) / f'dds_network-{os.getuid()}'
    try:
        return _write(_private(folder) / name, text)
    except OSError as error:
        raise NetworkChoiceError(f'{folder}: {error.strerror or error}') from error


def profile_text(reach: Reach) -> str:
    """Return a profile as XML; arguments as for :func:`profile_file`."""
    from xml.etree import ElementTree as ET

    ET.register_namespace('', _NAMESPACE)
    root = ET.parse(LOCALHOST_PROFILE).getroot()  # noqa: S314  # our own file
    allowed = _find(root, 'interfaceWhiteList')
    for interface in reach.interfaces:
        _add(allowed, 'address').text = interface.address
    builtin = _find(root, 'builtin')
    # the default of 3 s: each announcement goes to up to 32 ports of each peer, 20 kB altogether
    builtin.remove(_find(builtin, 'discovery_config'))
    if reach.peers:
        first = _add(builtin, 'initialPeersList')
        for peer in (_DISCOVERY_GROUP, *reach.peers):
            _add(_add(_add(first, 'locator'), 'udpv4'), 'address').text = peer
    return ET.tostring(root, encoding='unicode')


def _find(root: ET.Element, tag: str) -> ET.Element:
    return next(root.iter(f'{{{_NAMESPACE}}}{tag}'))


def _add(parent: ET.Element, tag: str) -> ET.Element:
    from xml.etree import ElementTree as ET

    return ET.SubElement(parent, f'{{{_NAMESPACE}}}{tag}')


def _private(folder: Path) -> Path:
    """Create a folder that only this user can write to; reject one that another user created."""
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise NetworkChoiceError(f'{folder} belongs to another user; remove it or set TMPDIR')
    folder.chmod(0o700)
    return folder


def _write(path: Path, text: str) -> Path:
    import tempfile

    if not path.exists():
        descriptor, written = tempfile.mkstemp(dir=path.parent)
        with os.fdopen(descriptor, 'w', encoding='utf-8') as file:
            file.write(text)
        Path(written).replace(path)
    return path


NETWORK_VARIABLE = 'DDS_NETWORK'
"""Interfaces and peers that the user opens DDS to; empty or unset for none."""
PROFILE_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
"""File that Fast DDS 2 reads its default profile from."""
RANGE_VARIABLE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
PEERS_VARIABLE = 'ROS_STATIC_PEERS'
SERVER_VARIABLE = 'ROS_DISCOVERY_SERVER'
LOCALHOST_ONLY_VARIABLE = 'ROS_LOCALHOST_ONLY'
TRANSPORTS_VARIABLE = 'FASTDDS_BUILTIN_TRANSPORTS'
_RMW_VARIABLE = 'RMW_IMPLEMENTATION'
_FAST_DDS = 'rmw_fastrtps'
_OFF = 'OFF'
# rmw leaves the transports and peers of the profile as they are. With LOCALHOST it adds a UDP
# transport of its own, which uses every interface.
_PROFILE_DECIDES = 'SYSTEM_DEFAULT'


def is_own_profile(path: str) -> bool:
    """Return whether a profile belongs to this package, in any checkout."""
    return Path(path).name.startswith(PREFIX)


def own_transports(environ: Mapping[str, str]) -> str:
    """Return the variable by which the user configures DDS transports; empty without one."""
    rmw, profile = environ.get(_RMW_VARIABLE, ''), environ.get(PROFILE_VARIABLE, '')
    if rmw and not rmw.startswith(_FAST_DDS):
        return f'{_RMW_VARIABLE}={rmw}'
    return f'{PROFILE_VARIABLE}={profile}' if profile and not is_own_profile(profile) else ''


def selected_reach(environ: Mapping[str, str]) -> Reach:
    """Return the reach that the user has chosen.

    Raises:
        NetworkChoiceError: A name does not exist, or the user's own transports override the
            choice.
    """
    own, text = own_transports(environ), environ.get(NETWORK_VARIABLE, '').strip()
    if not text:
        return Reach(own_transports=own)
    if own:
        raise NetworkChoiceError(
            f'{text!r} would have no effect, as {own} decides which networks DDS uses; unset one '
            'of the two'
        )
    return resolve_reach(text, read_interfaces())


def dds_variables(environ: Mapping[str, str], reach: Reach) -> dict[str, str]:
    """Return the variables that restrict DDS to a reach; none if the user has own transports.

    Raises:
        NetworkChoiceError: The profile cannot be written.
    """
    if own_transports(environ):
        return {}
    profile = LOCALHOST_PROFILE
    if not reach.is_this_host:
        profile = profile_file(reach)
    variables = {PROFILE_VARIABLE: str(profile)}
    if environ.get(RANGE_VARIABLE) != _OFF:
        variables[RANGE_VARIABLE] = _PROFILE_DECIDES
    if environ.get(LOCALHOST_ONLY_VARIABLE) == '1':
        variables[LOCALHOST_ONLY_VARIABLE] = '0'  # it means LOCALHOST
    return variables


def restrict_dds(environ: MutableMapping[str, str]) -> Reach:
    """Restrict DDS of this process and its children to the reach that the user has chosen.

    Call it before rclpy.init, as Fast DDS reads its profile once. It changes the environment,
    ``os.environ`` or that of a process to start.
    """
    reach = selected_reach(environ)
    environ.update(dds_variables(environ, reach))
    return reach


def open_dds(environ: MutableMapping[str, str], names: str | None) -> str:
    """Restrict DDS for a program with the option ``--network``, which overrides the variable."""
    if names is not None:
        environ[NETWORK_VARIABLE] = names
    return restrict_dds(environ).describe()


def is_this_host(environ: Mapping[str, str]) -> bool:
    """Return whether DDS of a process with this environment reaches only this host."""
    return selected_reach(environ).is_this_host
