# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The profile that Fast DDS reads: its transports, their interfaces, its first peers."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
import stat
import tempfile
import xml.etree.ElementTree as ET

from .reach import LOCALHOST_PROFILE, NetworkChoiceError, PREFIX, Reach

# RTPS 2.2, 9.6.1.4.1; naming peers takes the place of this default
_DISCOVERY_GROUP = '239.255.0.1'
_NAMESPACE = 'http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles'


def profile_file(reach: Reach) -> Path:
    """Return the file of a profile beyond loopback; write it if it does not exist.

    Raises:
        NetworkChoiceError: It cannot be written.
    """
    text = profile_text(reach)
    name = f'{PREFIX}{hashlib.sha256(text.encode()).hexdigest()[:16]}.xml'
    folder = Path(tempfile.gettempdir()) / f'dds_network-{os.getuid()}'
    try:
        return _write(_private(folder) / name, text)
    except OSError as error:
        raise NetworkChoiceError(f'{folder}: {error.strerror or error}') from error


def profile_text(reach: Reach) -> str:
    """Return a profile as XML; arguments as of :func:`profile_file`."""
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
    return ET.SubElement(parent, f'{{{_NAMESPACE}}}{tag}')


def _private(folder: Path) -> Path:
    """Make a folder that this user alone can write to; refuse one that another user has made."""
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise NetworkChoiceError(f'{folder} belongs to another user; remove it or set TMPDIR')
    folder.chmod(0o700)
    return folder


def _write(path: Path, text: str) -> Path:
    if not path.exists():
        descriptor, written = tempfile.mkstemp(dir=path.parent)
        with os.fdopen(descriptor, 'w', encoding='utf-8') as file:
            file.write(text)
        Path(written).replace(path)
    return path
