# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Environment variables and platform; pure, what is looked at is handed in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
import platform

from .findings import error, Finding, Report, warning

_DISTRO = 'jazzy'
# https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html: above 101 the ports
# meet the ephemeral ones of Linux, above 232 they do not exist
_SAFE_DOMAIN = 101
_LAST_DOMAIN = 232
_RANGES = {'SUBNET', 'LOCALHOST', 'OFF', 'SYSTEM_DEFAULT'}
_SHOWN = (
    'ROS_DISTRO',
    'ROS_DOMAIN_ID',
    'DDS_NETWORK',
    'ROS_AUTOMATIC_DISCOVERY_RANGE',
    'ROS_STATIC_PEERS',
    'ROS_LOCALHOST_ONLY',
    'RMW_IMPLEMENTATION',
    'FASTDDS_BUILTIN_TRANSPORTS',
    'FASTRTPS_DEFAULT_PROFILES_FILE',
    'FASTDDS_DEFAULT_PROFILES_FILE',
    'AMENT_PREFIX_PATH',
)


def check_environment(environ: Mapping[str, str]) -> Iterator[Finding]:
    """Check the variables that decide what finds whom.

    Args:
        environ: The environment.

    Yields:
        What is wrong.
    """
    distro = environ.get('ROS_DISTRO', '')
    if distro != _DISTRO:
        yield warning(f"ROS_DISTRO is '{distro}', not {_DISTRO}; source env.sh in this shell.")
    yield from _check_domain(environ.get('ROS_DOMAIN_ID', ''))
    reach = environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE', '')
    if reach and reach.upper() not in _RANGES:
        yield error(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is '{reach}'; it takes {', '.join(sorted(_RANGES))}."
        )
    for prefix in environ.get('AMENT_PREFIX_PATH', '').split(':'):
        if not Path(prefix, 'share', 'ament_index').is_dir():
            yield warning(
                f"AMENT_PREFIX_PATH names '{prefix}', which holds no packages; "
                'build the workspace and source env.sh again.'
            )


def _check_domain(text: str) -> Iterator[Finding]:
    if not text:
        return
    if not text.isdecimal() or int(text) > _LAST_DOMAIN:
        yield error(f"ROS_DOMAIN_ID is '{text}'; it takes 0 to {_LAST_DOMAIN}.")
    elif int(text) > _SAFE_DOMAIN:
        yield warning(
            f'ROS_DOMAIN_ID {text} uses ports that Linux gives to other programs; '
            f'0 to {_SAFE_DOMAIN} is safe.'
        )


def report_environment(environ: Mapping[str, str]) -> Report:
    """The variables that decide what finds whom.

    Args:
        environ: The environment.

    Returns:
        Those that are set.
    """
    rows = tuple((name, environ[name]) for name in _SHOWN if name in environ)
    return Report('ROS 2 INFORMATION', rows)


def report_platform() -> Report:
    """The operating system and Python."""
    return Report(
        'PLATFORM INFORMATION',
        (
            ('system', platform.system()),
            ('platform info', platform.platform()),
            ('release', platform.release()),
            ('processor', platform.machine()),
            ('python version', platform.python_version()),
        ),
    )
