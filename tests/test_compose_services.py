# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The services of compose.yaml start, become healthy and end, by the lines that stand there.

Without Docker: the same commands in this environment, by the entry point of the image.
"""

from __future__ import annotations

from pathlib import Path
import re
import signal
import subprocess
import time
from typing import Any

from isolation import Isolation
from processes import RunningProcess
import pytest
import yaml

pytestmark = [pytest.mark.scenario, pytest.mark.slow]

ROOT = Path(__file__).parents[1]
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load((ROOT / 'compose.yaml').read_text())[
    'services'
]
ENTRYPOINT = str(ROOT / 'docker' / 'entrypoint')


def interpolated(text: str) -> str:
    """Put defaults in the place of variables, as Compose does."""
    text = re.sub(r'(?<!\$)\$\{\w+:-([^}]*)\}', r'\1', text)
    return text.replace('$$', '$')


def arguments(words: list[str], folder: Path) -> list[str]:
    """Return words of compose.yaml with the paths of this checkout, and of a test's folder."""
    texts = (interpolated(word).replace('/workspace/', f'{ROOT}/') for word in words)
    return [text.replace('/tmp/', f'{folder}/') for text in texts]


def start(service: str, isolation: Isolation, folder: Path) -> RunningProcess:
    """Start the command of a service at the top of the checkout."""
    own = SERVICES[service]['environment']
    env = isolation.env | {name: interpolated(str(value)) for name, value in own.items()}
    env |= {'ROS_DOMAIN_ID': str(isolation.domain_id)}
    at_the_top = ['env', '-C', str(ROOT), ENTRYPOINT]
    return RunningProcess([*at_the_top, *arguments(SERVICES[service]['command'], folder)], env)


def is_healthy(service: str, isolation: Isolation, folder: Path) -> bool:
    """Carry the health check of a service out."""
    how, *command = SERVICES[service]['healthcheck']['test']
    assert how == 'CMD'
    try:
        done = subprocess.run(
            arguments(command, folder),
            env=isolation.env,
            timeout=float(SERVICES[service]['healthcheck']['timeout'].removesuffix('s')),
            capture_output=True,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def wait_until_healthy(service: str, isolation: Isolation, folder: Path) -> None:
    """Check until it is healthy, within the time that Compose would give it."""
    deadline = time.monotonic() + 90.0
    while not is_healthy(service, isolation, folder):
        assert time.monotonic() < deadline, f'{service} is not healthy'


def end(process: RunningProcess) -> int:
    """End a process as `docker compose stop` does, within its grace period."""
    process.signal(signal.SIGTERM)
    return process.wait(60.0)


def test_an_arm_and_its_viewer_are_healthy(isolation: Isolation, tmp_path: Path) -> None:
    """At the same time; the viewer's frames come from the arm's joint states."""
    with (
        start('arm', isolation, tmp_path) as arm,
        start('viewer', isolation, tmp_path) as viewer,
    ):
        wait_until_healthy('arm', isolation, tmp_path)
        wait_until_healthy('viewer', isolation, tmp_path)
        frames = ['ros2', 'topic', 'echo', '--no-daemon', '/tf', 'tf2_msgs/msg/TFMessage']
        with RunningProcess([ENTRYPOINT, *frames], isolation.env) as echo:
            echo.wait_for('child_frame_id: viewer/panda_link7')
        assert end(viewer) in {0, -signal.SIGTERM}, viewer.output
        assert end(arm) == 0, arm.output


def test_a_quadruped_is_healthy_and_an_arm_is_not(isolation: Isolation, tmp_path: Path) -> None:
    """The quadruped beside the arm is no health of the arm."""
    with start('quad', isolation, tmp_path) as quad:
        wait_until_healthy('quad', isolation, tmp_path)
        assert not is_healthy('arm', isolation, tmp_path)
        assert end(quad) == 0, quad.output
