# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 service call` over DDS."""

from __future__ import annotations

from collections.abc import Mapping
import io
import sys

from frontend_cli import PROGRAM, Ros2
from processes import RunningProcess
import pytest
from rclpy.client import Client

pytestmark = [pytest.mark.scenario, pytest.mark.usefixtures('zoo')]

ANSWER = """\
requester: making request: std_srvs.srv.Trigger_Request()

response:
std_srvs.srv.Trigger_Response(success=True, message='done')

"""


def without_wait(text: str) -> str:
    """Drop the line that depends on how fast the service was found."""
    return text.replace('waiting for service to become available...\n', '')


def test_a_request_without_fields(ros2: Ros2) -> None:
    """Trigger needs no YAML; the answer is printed as ros2cli prints it."""
    outcome = ros2('service', 'call', '/trigger', 'std_srvs/srv/Trigger')
    assert (outcome.code, outcome.err) == (0, '')
    assert without_wait(outcome.out) == ANSWER


def test_a_request_with_yaml(ros2: Ros2, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the articles write it, and from stdin."""
    outcome = ros2('service', 'call', '/set_bool', 'std_srvs/srv/SetBool', '{ data: true }')
    assert "SetBool_Response(success=True, message='data is True')" in outcome.out
    monkeypatch.setattr(sys, 'stdin', io.StringIO('data: false\n'))
    outcome = ros2('service', 'call', '/set_bool', 'std_srvs/srv/SetBool', '--stdin')
    assert "SetBool_Response(success=False, message='data is False')" in outcome.out


def test_a_rate_repeats_the_call(zoo: Mapping[str, str]) -> None:
    """Until Ctrl-C."""
    words = [*PROGRAM, 'service', 'call', '-r', '50', '/trigger', 'std_srvs/srv/Trigger']
    with RunningProcess(words, zoo) as process:
        process.wait_for('^response:$', count=3)
        assert process.stop() == 2


@pytest.mark.parametrize(
    ('words', 'problem'),
    [
        (
            ('/trigger', 'std_srvs/srv/Triger'),
            "The passed service type is invalid\nDid you mean 'std_srvs/srv/Trigger'",
        ),
        (('/trigger', 'std_msgs/msg/String'), 'The passed service type is invalid: std_msgs'),
        (
            ('/set_bool', 'std_srvs/srv/SetBool', '{ dat: 1 }'),
            "Failed to populate field: 'SetBool_Request' object has no attribute 'dat'\nSetB",
        ),
        (('/set_bool', 'std_srvs/srv/SetBool', 'data:1'), 'The passed value needs to be a dict'),
    ],
    ids=['type', 'kind', 'field', 'yaml'],
)
def test_requests_that_cannot_be(ros2: Ros2, words: tuple[str, ...], problem: str) -> None:
    """Refused before anything is sent."""
    outcome = ros2('service', 'call', *words)
    assert (outcome.code, outcome.out) == (1, '')
    assert outcome.err.startswith(problem), outcome.err


def test_a_service_that_is_not_there(ros2: Ros2) -> None:
    """It waits as ros2cli does, but says what is near, and `--timeout` ends it."""
    outcome = ros2('service', 'call', '--timeout', '1.2', '/triger', 'std_srvs/srv/Trigger')
    assert outcome.code == 1
    assert outcome.out == 'waiting for service to become available...\n'
    first, second, third = outcome.err.splitlines()
    assert first == "There is no service '/triger' yet."
    assert second.startswith("Did you mean '/trigger'")
    assert third == "Service '/triger' did not appear within 1.2 s"


def test_a_service_of_another_type(ros2: Ros2) -> None:
    """The wait would be in vain; it says why."""
    outcome = ros2('service', 'call', '--timeout', '1.2', '/trigger', 'std_srvs/srv/SetBool')
    assert outcome.code == 1
    expected = "Service '/trigger' has the type std_srvs/srv/Trigger, not std_srvs/srv/SetBool"
    assert outcome.err.splitlines()[0] == expected


def test_a_service_that_is_only_discovered(ros2: Ros2, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its name is known before its endpoints are matched, on a slow machine for seconds."""
    monkeypatch.setattr(Client, 'service_is_ready', lambda _: False)
    outcome = ros2('service', 'call', '--timeout', '1.2', '/trigger', 'std_srvs/srv/Trigger')
    assert outcome.out == 'waiting for service to become available...\n'
    assert outcome.err.splitlines() == ["Service '/trigger' did not appear within 1.2 s"]
