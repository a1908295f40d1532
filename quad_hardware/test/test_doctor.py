# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The doctor: every row of the article's table of troubles is found, with its remedy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
import os
from pathlib import Path

from isolation import Isolation
from processes import executable, RunningProcess
import pytest

from quad_description import movable_joints, robot_urdf
from quad_hardware.doctor import Finding, main, Severity
from quad_hardware.doctor.graph import check_graph, links_without_place, Observation
from quad_hardware.doctor.main import check_latency, check_memory, check_port, port_users
from quad_hardware.link import latency_timer
from quad_hardware.protocol import V1
from quad_pty_peer import PtyPeer

pytestmark = pytest.mark.slow

URDF = robot_urdf('lite')
NAMES = tuple(joint.name for joint in movable_joints(URDF))
LINKS = [word.split('"')[1] for word in URDF.split('<link ')[1:]]
PORT = '/dev/ttyAMA0'
GOOD, NOTE, WARNING, ERROR = Severity
WELL = Observation(
    duration=2.0,
    nodes={'hardware_node', 'controller_node', 'robot_state_publisher'},
    publishers={'joint_states': ['hardware_node'], 'joint_command': ['controller_node']},
    counts=dict.fromkeys(('joint_states', 'imu', 'odom', 'joint_command'), 100),
    joints=NAMES,
    urdf=URDF,
    parents=dict.fromkeys(LINKS, 'base_link') | {'base_link': 'odom'},
)


def found(findings: Iterable[Finding], subject: str) -> Finding:
    """The worst finding about something."""
    about = [f for f in findings if f.subject == subject]
    order = list(Severity)
    return max(about, key=lambda finding: order.index(finding.severity))


def test_a_robot_that_is_well_gets_no_remedy() -> None:
    """Nothing but good news."""
    assert {finding.severity for finding in check_graph(WELL, PORT)} == {GOOD}
    loop = {'a': 'b', 'b': 'a', 'c': 'odom'}
    assert links_without_place(('a', 'b', 'c'), loop) == ['a', 'b'], 'only a way up to odom counts'


@pytest.mark.parametrize(
    ('change', 'subject', 'severity', 'words'),
    [
        ({'nodes': set()}, 'nodes', NOTE, 'ROS_DOMAIN_ID'),
        ({'nodes': {'hardware_node'}}, 'nodes', WARNING, 'controller_node'),
        ({'counts': {}}, 'joint_states', ERROR, 'is the robot connected'),
        ({'counts': {'joint_states': 50}}, 'joint_states', WARNING, 'free -h'),
        ({'joints': NAMES[1:]}, 'joints', ERROR, 'fl_hip_joint'),
        ({'joints': (*NAMES, 'tail')}, 'joints', ERROR, 'tail'),
        ({'urdf': ''}, 'robot_description', WARNING, 'robot_state_publisher'),
        ({'urdf': '<robot'}, 'robot_description', ERROR, 'no XML'),
        ({'parents': {'base_link': 'odom'}}, 'tf', ERROR, 'fl_foot'),
        ({'publishers': {'joint_command': ['controller_node', 'x']}}, 'joint_command', ERROR, 'x'),
        ({'diagnostics': [(2, 'hardware_node: robot')]}, 'diagnostics', ERROR, 'robot'),
    ],
)
def test_what_is_wrong_with_the_graph_is_found(
    change: dict[str, object], subject: str, severity: Severity, words: str
) -> None:
    """Each by one thing that is different from a robot that is well."""
    finding = found(check_graph(replace(WELL, **change), PORT), subject)  # type: ignore[arg-type]
    assert finding.severity is severity
    assert words in str(finding)


@pytest.mark.parametrize(
    ('environment', 'subject', 'severity', 'words'),
    [
        ({}, 'environment', ERROR, 'source'),
        ({'AMENT_PREFIX_PATH': '/x', 'ROS_DISTRO': 'jazzy'}, 'environment', GOOD, 'jazzy'),
        ({'ROS_DOMAIN_ID': 'robot'}, 'domain', ERROR, "'robot'"),
        ({'ROS_DOMAIN_ID': '7'}, 'domain', NOTE, 'DDS_NETWORK'),
        ({'DDS_NETWORK': 'no such host'}, 'domain', ERROR, 'DDS_NETWORK'),
        ({'FASTRTPS_DEFAULT_PROFILES_FILE': 'own.xml'}, 'domain', GOOD, '0, the same'),
    ],
)
def test_the_environment(
    environment: dict[str, str], subject: str, severity: Severity, words: str
) -> None:
    """Unsourced shells, domains that are none, and domains that nobody else is in."""
    finding = found(main.check_environment(environment), subject)
    assert finding.severity is severity
    assert words in str(finding)


def test_scarce_memory_is_reported() -> None:
    """Before the kernel runs out of it."""
    for available, severity in ((100000, WARNING), (900000, GOOD)):
        text = f'MemTotal: 1700000 kB\nMemAvailable: {available} kB\n'
        assert [finding.severity for finding in check_memory(text)] == [severity]


def test_a_port_is_judged_by_what_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot and its protocol; silence; unknown firmware; not in dialout; none; no device."""
    with PtyPeer(tmp_path / 'port', V1) as peer:
        path = str(peer.link)
        assert 'L-2.0.0, protocol v1 at 115200' in str(found(check_port(path), 'robot'))
        assert 'at 80 %' in str(found(check_port(path), 'battery'))
        peer.behaviour.silent = True
        assert found(check_port(path), 'robot').severity is ERROR
        peer.behaviour.silent = False
        peer.firmware = '?'
        assert found(check_port(path), 'firmware').severity is WARNING
        with monkeypatch.context() as patched:
            patched.setattr(os, 'access', lambda *_: False)
            finding = found(check_port(path), 'permission')
        assert finding.severity is ERROR
        assert 'usermod -aG dialout' in finding.remedy
    assert found(check_port(path), 'port').severity is ERROR
    plain = tmp_path / 'plain'
    plain.touch()
    assert 'is not a device' in str(found(check_port(str(plain)), 'port'))


def test_an_adapter_that_keeps_bytes_back_is_found(tmp_path: Path) -> None:
    """By what the kernel says of its latency timer; other ports have none."""
    timer = tmp_path / 'ttyUSB0' / 'device' / 'latency_timer'
    timer.parent.mkdir(parents=True)
    for text, severity in (('16\n', WARNING), ('1\n', GOOD)):
        timer.write_text(text)
        latency = latency_timer('/dev/ttyUSB0', tmp_path)
        assert found(check_latency('/dev/ttyUSB0', latency), 'adapter').severity is severity
    assert latency_timer('/dev/ttyAMA0', tmp_path) is None
    assert list(check_latency('/dev/ttyAMA0', None)) == []


def test_a_port_in_use_is_left_alone(isolation: Isolation, tmp_path: Path) -> None:
    """The program that has it is named, and no byte is taken from it; exit code 0."""
    with PtyPeer(tmp_path / 'port') as peer:
        node = [executable('quad_hardware', 'hardware_node'), '--ros-args']
        doctor = [executable('quad_hardware', 'doctor'), '--duration', '0.5']
        with RunningProcess([*node, '-p', f'port:={peer.link}'], isolation.env) as running:
            running.wait_for('running: reports arrive')
            with RunningProcess([*doctor, '--port', str(peer.link)], isolation.env) as process:
                process.wait()
                assert 'hardware_node (process' in process.output
                assert 'joint_states: ' in process.output
                assert 'controller_node, robot_state_publisher not running' in process.output
            assert running.is_running()


def test_a_simulated_robot_is_asked(isolation: Isolation, tmp_path: Path) -> None:
    """It keeps its own port open, which is no reason to leave it alone."""
    link = tmp_path / 'xgo'
    command = [executable('quad_sim', 'fake_xgo'), '--no-ros', '--link', str(link)]
    with RunningProcess(command, isolation.env) as robot:
        robot.wait_for(f'at {link}')
        assert list(port_users(os.path.realpath(link))) == []
        findings = list(check_port(str(link)))
        # the documented one of both that it speaks
        assert 'protocol v1 at 115200 baud' in found(findings, 'robot').message
        assert found(findings, 'battery').severity is GOOD
        assert robot.is_running()
