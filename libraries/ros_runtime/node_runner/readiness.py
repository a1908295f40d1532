# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Report to the supervisor of this process that it is ready."""

from __future__ import annotations

from contextlib import suppress
import os
import socket

VARIABLE = 'NOTIFY_SOCKET'
"""Names the socket of the supervisor, as in sd_notify(3)."""


def notify_ready(status: str = '') -> None:
    """Report ``READY=1`` to the supervisor of this process, if it has one that wants to know.

    That is process_supervisor of this workspace, or systemd for a unit of ``Type=notify``. Only
    the first call reports, so it may stand where readiness comes and goes.

    Args:
        status: What the supervisor shall show the user about this process, in one line.
    """
    address = os.environ.pop(VARIABLE, '')
    if not address:
        return
    if address.startswith('@'):  # no file: a name in the abstract namespace of Linux
        address = f'\0{address[1:]}'
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as supervisor, suppress(OSError):
        said = f'\nSTATUS={status}' if status else ''
        supervisor.sendto(f'READY=1{said}'.encode(), address)
