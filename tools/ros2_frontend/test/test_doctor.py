# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 doctor`: checks of made-up hosts, and the command over DDS."""

from __future__ import annotations

from pathlib import Path

from frontend_cli import Ros2
import pytest

from ros2_frontend.health.environment import check_environment
from ros2_frontend.health.findings import Report, Severity
from ros2_frontend.health.network import check_network, Interface

LOOPBACK = Interface(frozenset({'up', 'loopback'}), ('127.0.0.1',), 65536)
ETHERNET = Interface(frozenset({'up', 'multicast'}), ('192.168.0.2',), 1500)
WITHOUT_ADDRESS = Interface(frozenset({'up', 'multicast'}), (), 1500)


@pytest.fixture
def prefix(tmp_path: Path) -> str:
    """Make an install prefix that holds packages."""
    (tmp_path / 'share/ament_index').mkdir(parents=True)
    return str(tmp_path)


@pytest.mark.parametrize(
    ('changes', 'severity', 'problem'),
    [
        ({'ROS_DISTRO': 'humble'}, Severity.WARNING, "ROS_DISTRO is 'humble', not jazzy"),
        ({'ROS_DOMAIN_ID': '233'}, Severity.ERROR, "ROS_DOMAIN_ID is '233'; it takes 0 to 232"),
        ({'ROS_DOMAIN_ID': 'x'}, Severity.ERROR, "ROS_DOMAIN_ID is 'x'"),
        ({'ROS_DOMAIN_ID': '150'}, Severity.WARNING, '0 to 101 is safe'),
        ({'ROS_AUTOMATIC_DISCOVERY_RANGE': 'HOST'}, Severity.ERROR, "is 'HOST'; it takes LOCAL"),
        ({'AMENT_PREFIX_PATH': '/nowhere'}, Severity.WARNING, "names '/nowhere', which holds no"),
    ],
)
def test_environment_findings(
    prefix: str, changes: dict[str, str], severity: Severity, problem: str
) -> None:
    """Each variable by itself; the text names the remedy or the range."""
    healthy = {'ROS_DISTRO': 'jazzy', 'ROS_DOMAIN_ID': '5', 'AMENT_PREFIX_PATH': prefix}
    assert not list(check_environment(healthy))
    (finding,) = check_environment(healthy | changes)
    assert finding.severity is severity
    assert problem in finding.text


@pytest.mark.parametrize(
    ('interfaces', 'problems'),
    [
        ({'lo': LOOPBACK, 'eth0': ETHERNET}, []),
        ({'lo': LOOPBACK, 'eth0': WITHOUT_ADDRESS}, ['Only loopback', 'No multicast']),
        ({'eth0': ETHERNET}, ['No loopback']),
    ],
)
def test_network_findings(interfaces: dict[str, Interface], problems: list[str]) -> None:
    """Only interfaces with an address count."""
    texts = [finding.text for finding in check_network(interfaces)]
    assert [
        text for text, start in zip(texts, problems, strict=True) if text.startswith(start)
    ] == texts


def test_report_is_aligned() -> None:
    """Names are filled up to the longest."""
    report = Report('HEAD', (('a', 1), ('longer', 'x')))
    assert report.text() == '\n   HEAD\na     : 1\nlonger: x'


@pytest.mark.scenario
@pytest.mark.usefixtures('zoo')
def test_doctor_over_dds(ros2: Ros2) -> None:
    """Warnings alone fail no check, unless they are to; reports of failed checks on request."""
    outcome = ros2('doctor')
    assert outcome.code == 0
    assert outcome.out == '\nAll 5 checks passed\n\n'
    sentence = 'topic: UserWarning: Publisher without subscriber detected on /chatter.\n'
    assert sentence in outcome.err
    strict = ros2('wtf', '--include-warnings', '--report-failed')
    assert 'check(s) failed\n\nFailed modules: ' in strict.out
    assert '   TOPIC LIST\ntopic           : /chatter\n' in strict.out


@pytest.mark.scenario
@pytest.mark.usefixtures('zoo')
def test_doctor_report(ros2: Ros2) -> None:
    """All tables; the QoS of a pair that does not connect is reported."""
    out = ros2('doctor', '--report').out
    heads = [line.strip() for line in out.splitlines() if line.startswith('   ')]
    assert heads == [
        'PLATFORM INFORMATION',
        'ROS 2 INFORMATION',
        'NETWORK CONFIGURATION',
        'RMW MIDDLEWARE',
        'TOPIC LIST',
        'QOS COMPATIBILITY LIST',
    ]
    assert 'middleware name          : rmw_fastrtps_cpp\n' in out
