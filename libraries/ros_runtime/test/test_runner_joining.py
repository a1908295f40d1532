# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a process reports of its networks and to its supervisor, and its end by signals."""

from __future__ import annotations

import os
from pathlib import Path
import signal
import socket
from typing import Any

import pytest

from dds_network import Interface, NETWORK_VARIABLE, PROFILE_VARIABLE, Reach
from node_runner import init_ros, notify_ready, stop_on_signals
from node_runner.program import ENDING


@pytest.fixture
def unset(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """No choice of a person, and no ROS that would be initialised."""
    monkeypatch.delenv(NETWORK_VARIABLE, raising=False)
    monkeypatch.delenv(PROFILE_VARIABLE, raising=False)
    monkeypatch.delenv('RMW_IMPLEMENTATION', raising=False)
    monkeypatch.setattr('rclpy.init', lambda **_: None)
    return monkeypatch


@pytest.mark.parametrize(
    ('variable', 'value', 'said'),
    [
        (NETWORK_VARIABLE, 'eth0', 'DDS is open on eth0 (10.0.0.5)'),
        (PROFILE_VARIABLE, '/home/me/dds.xml', '/home/me/dds.xml decides'),
        (NETWORK_VARIABLE, '', ''),
    ],
)
def test_a_process_that_others_can_reach_says_so(
    unset: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    variable: str,
    value: str,
    said: str,
) -> None:
    """However it was started, or that a person's profile decides; nothing by default."""

    def resolve(*_: Any) -> Reach:
        return Reach((Interface('eth0', '10.0.0.5'),))

    if value:
        unset.setattr('dds_network.environment.resolve_reach', resolve)
        unset.setenv(variable, value)
    init_ros()
    error = capfd.readouterr().err
    assert said in error if said else error == ''


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


def test_an_echo_of_a_ctrl_c_is_no_second_one() -> None:
    """Two signals a few milliseconds apart are one: drives come to rest and are disabled."""
    before = {number: signal.getsignal(number) for number in ENDING}
    times = iter([5.0, 5.003, 5.49])
    try:
        stop = stop_on_signals(clock=lambda: next(times))
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)  # as a second one it would end this process
        assert stop.is_set()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
