# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a process says of the networks that it is reached from."""

from __future__ import annotations

from typing import Any

import pytest

from dds_network import Interface, NETWORK_VARIABLE, PROFILE_VARIABLE, Reach
from node_runner import init_ros


@pytest.fixture
def unset(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """No choice of a person, and no ROS that would be initialised."""
    monkeypatch.delenv(NETWORK_VARIABLE, raising=False)
    monkeypatch.delenv(PROFILE_VARIABLE, raising=False)
    monkeypatch.delenv('RMW_IMPLEMENTATION', raising=False)
    monkeypatch.setattr('rclpy.init', lambda **_: None)
    return monkeypatch


def test_a_process_that_others_can_reach_says_so(
    unset: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """However it was started."""

    def resolve(*_: Any) -> Reach:
        return Reach((Interface('eth0', '10.0.0.5'),))

    unset.setattr('dds_network.environment.resolve_reach', resolve)
    unset.setenv(NETWORK_VARIABLE, 'eth0')
    init_ros()
    assert 'DDS is open on eth0 (10.0.0.5)' in capfd.readouterr().err


def test_a_profile_of_a_person_is_named(
    unset: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Its reach is unknown."""
    unset.setenv(PROFILE_VARIABLE, '/home/me/dds.xml')
    init_ros()
    assert '/home/me/dds.xml decides' in capfd.readouterr().err


def test_a_process_of_this_host_says_nothing(
    unset: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """That is the default."""
    del unset
    init_ros()
    assert capfd.readouterr().err == ''
