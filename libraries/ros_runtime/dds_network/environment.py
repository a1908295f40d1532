# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment variables by which Fast DDS and rmw learn what to use."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from pathlib import Path

from .reach import (
    LOCALHOST_PROFILE,
    NetworkChoiceError,
    PREFIX,
    Reach,
    read_interfaces,
    resolve_reach,
)

NETWORK_VARIABLE = 'DDS_NETWORK'
"""Interfaces and peers that a person opens DDS to; empty or unset for none."""
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
    """Return the variable with which the user configures the transports; empty without one."""
    rmw, profile = environ.get(_RMW_VARIABLE, ''), environ.get(PROFILE_VARIABLE, '')
    if rmw and not rmw.startswith(_FAST_DDS):
        return f'{_RMW_VARIABLE}={rmw}'
    return f'{PROFILE_VARIABLE}={profile}' if profile and not is_own_profile(profile) else ''


def selected_reach(environ: Mapping[str, str]) -> Reach:
    """Return the reach that the user has chosen.

    Raises:
        NetworkChoiceError: A name does not exist, or the user's own transports would ignore it.
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
    """Return the variables that keep DDS to a reach.

    Args:
        environ: The environment; transports that the user configured stay as they are.
        reach: What DDS may use.

    Raises:
        NetworkChoiceError: The profile cannot be written.
    """
    if own_transports(environ):
        return {}
    profile = LOCALHOST_PROFILE
    if not reach.is_this_host:
        from .profile import profile_file  # XML and hashes, which every program would import

        profile = profile_file(reach)
    variables = {PROFILE_VARIABLE: str(profile)}
    if environ.get(RANGE_VARIABLE) != _OFF:
        variables[RANGE_VARIABLE] = _PROFILE_DECIDES
    if environ.get(LOCALHOST_ONLY_VARIABLE) == '1':
        variables[LOCALHOST_ONLY_VARIABLE] = '0'  # it means LOCALHOST
    return variables


def restrict_dds(environ: MutableMapping[str, str]) -> Reach:
    """Restrict DDS of this process and its children to the reach that the user has chosen.

    Call it before rclpy.init: Fast DDS reads its profile once.

    Args:
        environ: ``os.environ``, or the environment of a process to start; it is changed.

    Raises:
        NetworkChoiceError: As of :func:`selected_reach`.
    """
    reach = selected_reach(environ)
    environ.update(dds_variables(environ, reach))
    return reach


def open_dds(environ: MutableMapping[str, str], names: str | None) -> str:
    """Do the same for a program with the option ``--network``, which overrides the variable.

    Raises:
        NetworkChoiceError: As of :func:`selected_reach`.
    """
    if names is not None:
        environ[NETWORK_VARIABLE] = names
    return restrict_dds(environ).describe()


def is_this_host(environ: Mapping[str, str]) -> bool:
    """Return whether DDS of a process with this environment reaches this host only.

    Raises:
        NetworkChoiceError: As of :func:`selected_reach`.
    """
    return selected_reach(environ).is_this_host
