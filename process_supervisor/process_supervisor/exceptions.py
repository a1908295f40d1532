# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that process_supervisor raises.

::

    SupervisorError
    └── StartError (OSError)   a process cannot be started

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class SupervisorError(Exception):
    """Root of all errors of this package."""


class StartError(SupervisorError, OSError):
    """A process of a bring-up cannot be started.

    Scenarios: the package is not built, the workspace is not sourced, another bring-up of this
    user holds the bus, the port or the ROS domain, ROS_DOMAIN_ID is no domain.
    """
