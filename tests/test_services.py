# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services of compose.yaml and systemd units start, are ready and end in order.

Without Docker and systemd: their own commands by their entry point, beside a `ros2` whose `run`
treats signals as that of ROS from apt.
"""

from __future__ import annotations

import configparser
from pathlib import Path
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

from isolation import Isolation
from processes import executable, RunningProcess
import psutil
import pytest
from ros_client import RosClient
import yaml

pytestmark = [pytest.mark.scenario, pytest.mark.slow]

ROOT = Path(__file__).parents[1]
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load((ROOT / 'compose.yaml').read_text())[
    'services'
]
TIMEOUT = 90.0  # [s] on a busy machine
UNITS = ROOT / 'tools' / 'service'
ROS2 = f"""#!{sys.executable}
# `ros2` of Jazzy's packages: `run` waits for a child, survives SIGINT, and dies of SIGTERM alone
import os, subprocess, sys
if sys.argv[1] != 'run':
    os.execv({shutil.which('ros2')!r}, sys.argv)
child = subprocess.Popen([{shutil.which('ros2')!r}, *sys.argv[1:]])
while child.returncode is None:
    try:
        child.communicate()
    except KeyboardInterrupt:
        pass
sys.exit(child.returncode)
"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """This checkout as the image has it: the same files, with `ros2` from apt before ours."""
    folder = tmp_path / 'workspace'
    folder.mkdir()
    for entry in ROOT.iterdir():
        if entry.name not in {'docker', 'env.sh'}:
            (folder / entry.name).symlink_to(entry)
    shutil.copytree(ROOT / 'docker', folder / 'docker')
    apt = tmp_path / 'apt'
    apt.mkdir()
    (apt / 'ros2').write_text(ROS2)
    (apt / 'ros2').chmod(0o755)
    (folder / 'env.sh').write_text(f'. {ROOT}/env.sh\nPATH={apt}:$PATH\n')
    return folder


def interpolated(text: str) -> str:
    """Put defaults in the place of variables, as Compose does."""
    text = re.sub(r'(?<!\$)\$\{\w+:-([^}]*)\}', r'\1', text)
    return text.replace('$$', '$')


def arguments(words: list[str], workspace: Path) -> list[str]:
    """Return words of compose.yaml with the paths of a test's workspace."""
    texts = (interpolated(word).replace('/tmp/', f'{workspace.parent}/') for word in words)
    return [text.replace('/workspace/', f'{workspace}/') for text in texts]


def run(words: list[str], env: dict[str, str], workspace: Path) -> RunningProcess:
    """Start a command at the top of the workspace."""
    return RunningProcess(['env', '-C', str(workspace), *words], env)


def start(service: str, isolation: Isolation, workspace: Path) -> RunningProcess:
    """Start the command of a service as Compose does."""
    own = SERVICES[service]['environment']
    env = isolation.env | {name: interpolated(str(value)) for name, value in own.items()}
    env |= {'ROS_DOMAIN_ID': str(isolation.domain_id)}
    command = arguments(SERVICES[service]['command'], workspace)
    return run([str(workspace / 'docker' / 'entrypoint'), *command], env, workspace)


def is_healthy(service: str, isolation: Isolation, workspace: Path) -> bool:
    """Run the health check of a service."""
    how, *command = SERVICES[service]['healthcheck']['test']
    assert how == 'CMD'
    try:
        done = subprocess.run(
            arguments(command, workspace),
            env=isolation.env,
            timeout=float(SERVICES[service]['healthcheck']['timeout'].removesuffix('s')),
            capture_output=True,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def wait_until_healthy(service: str, isolation: Isolation, workspace: Path) -> None:
    """Repeat the health check within the time that Compose would give it."""
    deadline = time.monotonic() + TIMEOUT
    while not is_healthy(service, isolation, workspace):
        assert time.monotonic() < deadline, f'{service} is not healthy'


def end(process: RunningProcess) -> None:
    """End a process as `docker compose stop` and `KillMode=mixed` do: SIGTERM to it alone.

    What it leaves running, or what ends by another way than its own, was killed and not stopped.
    """
    family = psutil.Process(process.pid).children(recursive=True)
    process.signal(signal.SIGTERM)
    assert process.wait(60.0) == 0, process.output
    assert not [each for each in family if each.is_running()], process.output


def test_an_arm_and_its_viewer_are_healthy(isolation: Isolation, workspace: Path) -> None:
    """At the same time; the viewer's frames come from the arm's joint states."""
    with (
        start('arm', isolation, workspace) as arm,
        start('viewer', isolation, workspace) as viewer,
    ):
        wait_until_healthy('arm', isolation, workspace)
        wait_until_healthy('viewer', isolation, workspace)
        frames = ['ros2', 'topic', 'echo', '--no-daemon', '/tf', 'tf2_msgs/msg/TFMessage']
        with RunningProcess(frames, isolation.env) as echo:
            echo.wait_for('child_frame_id: viewer/panda_link7')
        end(viewer)
        end(arm)


def test_a_quadruped_is_healthy_and_an_arm_is_not(isolation: Isolation, workspace: Path) -> None:
    """The quadruped beside the arm publishes nothing that is the health of the arm."""
    test = SERVICES['arm']['healthcheck']['test']
    topic = test[test.index('--once') + 1]
    with start('quad', isolation, workspace) as quad, RosClient(isolation.domain_id) as client:
        wait_until_healthy('quad', isolation, workspace)
        client.spin_until(lambda: _published(client, f'/dog{topic}'), TIMEOUT, 'the graph')
        assert not _published(client, topic)
        end(quad)


def _published(client: RosClient, topic: str) -> bool:
    return bool(client.node.get_publishers_info_by_topic(topic))


@pytest.mark.parametrize('unit', ['arm', 'quad'])
def test_a_unit_is_ready_and_ends_in_order(
    unit: str, isolation: Isolation, workspace: Path, tmp_path: Path
) -> None:
    """`Type=notify`: a process of the bring-up reports READY; no drive is enabled by a start."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read(UNITS / f'{unit}.service')
    settings = dict(
        line.split('=', 1)
        for line in (UNITS / 'robots.default').read_text().splitlines()
        if not line.startswith('#')
    )
    port = tmp_path / 'xgo'
    calibration = tmp_path / 'calibration.yaml'
    calibration.write_text('hardware_node: {ros__parameters: {joints_checked: true}}\n')
    bus_config = ROOT / 'arm_bringup' / 'robots' / settings['ROBOT'] / 'bus.yml'
    device = {
        'arm': ['canopen_sim', 'fake_slaves', '--ros-args', '-p', f'bus_config:={bus_config}'],
        'quad': ['quad_sim', 'fake_xgo', '--no-ros', '--link', str(port)],
    }[unit]
    if unit == 'arm':
        device += ['-p', f'can_interface_name:={isolation.bus}']
    line = parser['Service']['ExecStart'].replace('$$', '$')
    line = line.replace('/dev/xgo', str(port)).replace('can0', isolation.bus)
    line = line.replace('$WORKSPACE/quad_calibration.yaml', str(calibration))
    env = isolation.env | settings | {'WORKSPACE': str(workspace)}
    with RunningProcess([executable(*device[:2]), *device[2:]], isolation.env) as simulated:
        simulated.wait_for('.')
        with run(shlex.split(line), env, workspace) as bringup:
            bringup.wait_until_ready()
            end(bringup)
