# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that process_supervisor raises.

::

    SupervisorError
    ├── StartError (OSError)   a process cannot be started
    ├── CallError              what runs refused something, or did not answer in time
    └── GivenUpError           what is waited for is no longer wanted

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


class CallError(SupervisorError):
    """What runs refused something, did not answer in time, or is in a fault.

    Scenarios: a drive that does not enable, a mode that is not accepted, a robot that has
    fallen, a service that is not there.
    """


def no_answer(what: str, waited: float) -> CallError:
    """Return the error for something that did not come in time, in [s]."""
    return CallError(
        f'waited {round(waited, 1):g} s in vain for {what}; is this machine too busy? '
        'If not, the log above says why'
    )


class GivenUpError(SupervisorError):
    """What is waited for is no longer wanted.

    Scenarios: Ctrl-C, a process of the bring-up has ended.
    """
