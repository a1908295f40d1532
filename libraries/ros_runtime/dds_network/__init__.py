# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Restricts DDS to loopback and the network interfaces that the user names.

Fast DDS has no authentication: any host that reaches its sockets can call every service. So a
process of this workspace opens UDP sockets on the loopback interface only, unless the variable
``DDS_NETWORK``, or the option ``--network`` of a bring-up, names interfaces or peers.

    from dds_network import restrict_dds

    restrict_dds(os.environ)  # before rclpy.init, or before processes are started
"""

from .environment import (
    is_this_host,
    NETWORK_VARIABLE,
    open_dds,
    PROFILE_VARIABLE,
    restrict_dds,
    selected_reach,
)
from .reach import Interface, NetworkChoiceError, participants_on_this_host, Reach

__all__ = [
    'NETWORK_VARIABLE',
    'PROFILE_VARIABLE',
    'Interface',
    'NetworkChoiceError',
    'Reach',
    'is_this_host',
    'open_dds',
    'participants_on_this_host',
    'restrict_dds',
    'selected_reach',
]
