# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The machine: is ROS sourced, which domain, is there memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import importlib.util

from dds_network import NETWORK_VARIABLE, NetworkChoiceError, selected_reach

from ..link.vendor import is_installed
from .finding import error, Finding, good, note, warning

MIN_MEMORY = 300e6  # [B] below that, processes are soon ended


def check_environment(environment: Mapping[str, str]) -> Iterator[Finding]:
    """Look at the variables that ROS reads."""
    if 'AMENT_PREFIX_PATH' not in environment:
        remedy = (
            'source the workspace first: `source env.sh`, or `source /opt/ros/<distro>/setup.bash`'
            ' and install/setup.bash (scripts, cron and systemd do not do it for you)'
        )
        yield error('environment', 'no ROS workspace is sourced', remedy)
    else:
        yield good(
            'environment', f'ROS {environment.get("ROS_DISTRO", "of unknown distribution")}'
        )
    domain = environment.get('ROS_DOMAIN_ID', '0')
    if not domain.isdigit() or not 0 <= int(domain) <= 232:
        yield error('domain', f'ROS_DOMAIN_ID is {domain!r}', 'export ROS_DOMAIN_ID=0')
    else:
        yield _reach(domain, environment)


def _reach(domain: str, environment: Mapping[str, str]) -> Finding:
    try:
        reach = selected_reach(environment)
    except NetworkChoiceError as problem:
        remedy = f'export {NETWORK_VARIABLE} with an interface or a peer that exists'
        return error('domain', f'{NETWORK_VARIABLE}: {problem}', remedy)
    if reach.is_this_host:
        return note(
            'domain',
            f'{domain}; {reach.describe()}',
            f'to reach other machines: export {NETWORK_VARIABLE}=INTERFACE, and the same '
            'ROS_DOMAIN_ID on each',
        )
    return good('domain', f'{domain}, the same everywhere; {reach.describe()}')


def check_memory(meminfo: str) -> Iterator[Finding]:
    """Look at the text of /proc/meminfo."""
    rows = dict(line.split(':', 1) for line in meminfo.splitlines() if ':' in line)
    available = float(rows.get('MemAvailable', '0 kB').split()[0]) * 1024
    if available < MIN_MEMORY:
        remedy = 'end other programs (free -h), build with --parallel-workers 1'
        yield warning('memory', f'{available / 1e6:.0f} MB available', remedy)
    else:
        yield good('memory', f'{available / 1e6:.0f} MB available')


def check_library() -> Finding:
    """Report whose xgo_lib2 Python finds."""
    spec = importlib.util.find_spec('xgo_lib2')
    if spec is None:
        return warning('xgo_lib2', 'not found', 'build the workspace: it brings one of its own')
    import xgo_lib2

    vendors = is_installed()
    whose = f'the vendor’s, {xgo_lib2.__file__}' if vendors else 'the stand-in of this workspace'
    return good('xgo_lib2', whose)
