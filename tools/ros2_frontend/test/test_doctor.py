# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 doctor`: checks of made-up hosts, and the command over DDS."""

from __future__ import annotations

from pathlib import Path

from frontend_cli import Ros2
import pytest

from ros2_frontend.verbs.doctor import check_environment


@pytest.fixture
def prefix(tmp_path: Path) -> str:
    """Make an install prefix that holds packages."""
    (tmp_path / 'share/ament_index').mkdir(parents=True)
    return str(tmp_path)


@pytest.mark.parametrize(
    ('changes', 'is_error', 'problem'),
    [
        ({'ROS_DISTRO': 'humble'}, False, "ROS_DISTRO is 'humble', not jazzy"),
        ({'ROS_DOMAIN_ID': '233'}, True, "ROS_DOMAIN_ID is '233'; it takes 0 to 232"),
        ({'ROS_DOMAIN_ID': 'x'}, True, "ROS_DOMAIN_ID is 'x'"),
        ({'ROS_DOMAIN_ID': '150'}, False, '0 to 101 is safe'),
        ({'ROS_AUTOMATIC_DISCOVERY_RANGE': 'HOST'}, True, "is 'HOST'; it takes LOCAL"),
        ({'AMENT_PREFIX_PATH': '/nowhere'}, False, "names '/nowhere', which holds no"),
    ],
)
def test_environment_findings(
    prefix: str, changes: dict[str, str], is_error: bool, problem: str
) -> None:
    """Each variable by itself; the text names the remedy or the range."""
    healthy = {'ROS_DISTRO': 'jazzy', 'ROS_DOMAIN_ID': '5', 'AMENT_PREFIX_PATH': prefix}
    assert not list(check_environment(healthy))
    ((found, text),) = check_environment(healthy | changes)
    assert found is is_error
    assert problem in text


@pytest.mark.scenario
@pytest.mark.usefixtures('zoo')
def test_doctor_over_dds(ros2: Ros2) -> None:
    """Warnings alone fail no check, unless they are to; a report has all tables."""
    outcome = ros2('doctor')
    assert outcome.code == 0
    assert outcome.out == '\nAll 3 checks passed\n\n'
    sentence = 'topic: UserWarning: Publisher without subscriber detected on /chatter.\n'
    assert sentence in outcome.err
    strict = ros2('wtf', '--include-warnings')
    assert 'check(s) failed\n\nFailed modules: ' in strict.out
    out = ros2('doctor', '--report').out
    heads = [line.strip() for line in out.splitlines() if line.startswith('   ')]
    assert heads == [
        'PLATFORM INFORMATION',
        'ROS 2 INFORMATION',
        'RMW MIDDLEWARE',
        'TOPIC LIST',
        'QOS COMPATIBILITY LIST',
    ]
    assert '\n   RMW MIDDLEWARE\nmiddleware name: rmw_fastrtps_cpp\ndomain         : ' in out
    assert '\n   TOPIC LIST\ntopic           : /chatter\n' in out
