# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""fake_xgo as a process: its path, its services and its end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import re
import signal
import socket
import subprocess
import sys
import time
from typing import Any

from isolation import Isolation
from nav_msgs.msg import Odometry
import pytest
from ros_client import RosClient
from sim_serial import Listener, TEST_TIMEOUT
from std_srvs.srv import Trigger

from quad_hardware.protocol import Code, Frame, Kind
from quad_msgs.srv import InjectFault, Push
from quad_pty_peer import read_state
from quad_sim.fake_xgo import run

pytestmark = pytest.mark.slow

PACKAGE = Path(__file__).parents[1]
VERSION = Frame(Kind.READ, Code.VERSION)


@contextmanager
def fake_xgo(
    link: Path, *arguments: str, env: dict[str, str] | None = None
) -> Iterator[subprocess.Popen[str]]:
    """Start the simulated robot and wait until its port is there."""
    command = [sys.executable, '-m', 'quad_sim.fake_xgo', '--link', str(link)]
    process = subprocess.Popen(
        [*command, *arguments],
        cwd=PACKAGE,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert any(f'{link} -> ' in line for line in process.stdout)
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate(timeout=TEST_TIMEOUT)


def test_it_works_without_ros_and_leaves_nothing_behind(tmp_path: Path) -> None:
    """Without ROS nothing of it is imported; SIGTERM ends it with 0 and takes the path away.

    It reports that it is ready at the socket of sd_notify(3), as a supervisor or systemd wants it.
    """
    link = tmp_path / 'xgo'
    environment = {**os.environ, 'NOTIFY_SOCKET': str(tmp_path / 'notify')}
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as supervisor:
        supervisor.bind(environment['NOTIFY_SOCKET'])
        supervisor.settimeout(TEST_TIMEOUT)
        with fake_xgo(link, '--no-ros', '--physics', 'none', env=environment) as process:
            assert supervisor.recv(100) == b'READY=1'
            maps = Path(f'/proc/{process.pid}/maps').read_text(encoding='utf-8')
            assert 'librcl.so' not in maps
            assert 'libmujoco' not in maps
            listener = Listener(link)
            listener.send(VERSION)
            (answer,) = listener.count(1)
            assert answer.payload.startswith(b'L-')
            listener.close()
            process.send_signal(signal.SIGTERM)
            assert process.wait(TEST_TIMEOUT) == 0
    assert not os.path.lexists(link)


def test_a_path_in_use_is_refused_and_a_dead_one_replaced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two robots do not share a path; what a killed one left behind is no hindrance."""
    link = tmp_path / 'xgo'
    alone = '--no-ros', '--physics', 'none'
    with fake_xgo(link, *alone) as process:
        assert run([*alone, '--link', str(link)]) == 2
        assert 'belongs to another simulated robot' in capsys.readouterr().err
        process.kill()
        process.wait(TEST_TIMEOUT)
    assert link.is_symlink()
    with fake_xgo(link, *alone) as process:
        process.send_signal(signal.SIGINT)
        assert process.wait(TEST_TIMEOUT) == 0


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--servo', 'strong'], 'give nominal or firm or vendor_rl, or kp,kv'),
        (['--servo', 'kv=1'], 'needs kp'),
        (['--slope', '80'], 'slope of'),
        (['--friction', '0'], 'friction 0'),
        (['--battery', '120'], 'give 0 to 100'),
        (['--firmware', 'much too long'], 'up to 10 ASCII'),
        (['--fault', 'fire'], 'there are drop'),
        (['--trunk-mass', '0'], 'trunk_mass'),
        (['--command-gap', '-1'], 'command-gap'),
        (['--v1-baud', '2000000'], 'add --protocol v1'),
        (['--v1-baud', '0'], 'give bits a second'),
        (['--mount', '12'], 'give ID=SIGN,DEGREES'),
        (['--mount', '12=2'], 'sign 2'),
        (['--mount', '14=1'], 'no servo has id 14'),
    ],
)
def test_an_option_without_sense_is_reported(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, one line with the remedy, and no port."""
    link = tmp_path / 'xgo'
    assert run(['--no-ros', '--link', str(link), *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith('fake_xgo: ')
    assert error.count('\n') == 1
    assert re.search(message, error)
    assert not os.path.lexists(link)


def test_what_is_in_the_way_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file is never removed, nor a link that no simulated robot made and leads nowhere."""
    file, link, missing = tmp_path / 'file', tmp_path / 'link', tmp_path / 'no' / 'folder'
    file.write_text('precious', encoding='utf-8')
    link.symlink_to('/dev/ttyUSB99')
    for path in (file, link, missing):
        assert run(['--no-ros', '--physics', 'none', '--link', str(path)]) == 2
    assert 'cannot be made' in capsys.readouterr().err
    assert file.read_text(encoding='utf-8') == 'precious'
    assert str(link.readlink()) == '/dev/ttyUSB99'


@pytest.fixture
def robot(isolation: Isolation, tmp_path: Path) -> Iterator[tuple[RosClient, Path]]:
    """Give a client in the domain of a simulated robot, and its port."""
    link = tmp_path / 'xgo'
    with (
        fake_xgo(link, '--start', 'stand', env=isolation.env) as process,
        RosClient(isolation.domain_id) as client,
    ):
        yield client, link
        process.send_signal(signal.SIGTERM)
        assert process.wait(TEST_TIMEOUT) == 0


def push(client: RosClient, **parts: float) -> Any:
    """Call the push service."""
    request = Push.Request()
    request.velocity.y = parts.get('velocity', 0.0)
    request.force.y = parts.get('force', 0.0)
    request.duration = parts.get('duration', 0.0)
    return client.call(Push, '/fake_xgo/push', request)


def test_services_push_the_robot_and_break_its_line(robot: tuple[RosClient, Path]) -> None:
    """A push moves it, a fault silences it for its time, and nonsense is answered with words."""
    client, link = robot
    truth = client.listen(Odometry, '/fake_xgo/ground_truth')
    client.spin_until(lambda: bool(truth), TEST_TIMEOUT, 'ground truth')
    assert 0.12 < truth[-1].pose.pose.position.z < 0.14

    def moves() -> bool:
        """Push; a busy computer may show nothing of the half second that it is in motion."""
        assert push(client, velocity=0.4).success
        client.spin_for(0.5)
        return any(abs(t.twist.twist.linear.y) > 0.1 for t in truth)

    client.spin_until(moves, TEST_TIMEOUT, 'motion')
    assert push(client, force=1.0, duration=0.1).success
    refused = push(client)
    assert (refused.success, 'neither force' in refused.message) == (False, True)
    refused = push(client, velocity=float('nan'))
    assert (refused.success, 'up to 10 m/s' in refused.message) == (False, True)

    listener = Listener(link)
    listener.send(Frame(Kind.WRITE, Code.FEEDBACK, b'\x01'))
    listener.count(10)

    def fault(name: str, *settings: str, duration: float = 0.0) -> Any:
        request = InjectFault.Request(fault=name, settings=list(settings), duration=duration)
        return client.call(InjectFault, '/fake_xgo/fault', request)

    assert fault('silence').success
    listener.hush(0.1)
    assert listener.hush(0.2) == 0
    ended = fault('none')
    assert (ended.success, ended.message) == (True, 'all faults have ended')
    listener.count(10)
    assert fault('battery', 'level=9').success
    listener.until(lambda: read_state(listener.frames[-1]).battery == 9, 'an empty battery')
    wrong = fault('fire')
    assert (wrong.success, 'there are drop, flip' in wrong.message) == (False, True)
    wrong = fault('drop', 'rate=7')
    assert (wrong.success, 'is not 0 to 1' in wrong.message) == (False, True)
    assert not fault('drop', duration=float('nan')).success
    listener.close()

    assert client.call(Trigger, '/fake_xgo/stand', Trigger.Request()).success
    begin = time.monotonic()
    client.spin_until(lambda: time.monotonic() - begin > 0.2, TEST_TIMEOUT, 'time')
    assert truth[-1].pose.pose.position.z > 0.1
