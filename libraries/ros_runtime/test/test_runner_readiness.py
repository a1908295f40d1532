# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a process reports to its supervisor."""

from __future__ import annotations

import os
from pathlib import Path
import socket

import pytest

from node_runner import notify_ready


@pytest.mark.parametrize(
    ('abstract', 'status', 'message'),
    [(True, '', b'READY=1'), (False, '', b'READY=1'), (True, 'seen', b'READY=1\nSTATUS=seen')],
)
def test_readiness_is_reported_once(
    abstract: bool, status: str, message: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To a socket with a file or without one; not from programs that this one starts."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as supervisor:
        supervisor.bind('' if abstract else str(tmp_path / 'notify'))
        name = supervisor.getsockname()
        monkeypatch.setenv('NOTIFY_SOCKET', f'@{name[1:].decode()}' if abstract else name)
        notify_ready(status)
        notify_ready(status)
        assert supervisor.recv(100) == message
        with pytest.raises(BlockingIOError):
            supervisor.recv(100)
        assert 'NOTIFY_SOCKET' not in os.environ


@pytest.mark.parametrize('address', ['', '@nobody', '/nowhere/notify'])
def test_no_supervisor_is_no_error(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that was started by hand, and one whose supervisor has ended."""
    monkeypatch.setenv('NOTIFY_SOCKET', address)
    notify_ready()
