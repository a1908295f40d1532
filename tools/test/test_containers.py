# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Dockerfile and compose.yaml name what exists."""

from __future__ import annotations

from collections.abc import Iterator
import fnmatch
from pathlib import Path
import re
import subprocess
import sys
from typing import Any

import pytest
import yaml

from workspace.layout import this_checkout
from workspace.packages import find_packages

LAYOUT = this_checkout()
ROOT = LAYOUT.root
DOCKERFILE = (ROOT / 'docker' / 'Dockerfile').read_text(encoding='utf-8')
COMPOSE = (ROOT / 'compose.yaml').read_text(encoding='utf-8')
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load(COMPOSE)['services']
INSIDE = '/workspace/'  # the checkout in the image


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a program at the top of the checkout."""
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def words(service: str) -> list[str]:
    """Return the words of a service's command and of its health check."""
    check = SERVICES[service].get('healthcheck', {}).get('test', [])
    return ' '.join([*SERVICES[service]['command'], *check]).split()


def test_the_services_are_those_of_the_readme() -> None:
    """No more, no less."""
    readme = (ROOT / 'docker' / 'README.md').read_text(encoding='utf-8')
    assert set(SERVICES) == {*re.findall(r'^\| `(\w+)` \|', readme, re.MULTILINE)}


@pytest.mark.parametrize('service', SERVICES)
def test_a_service_runs_what_exists(service: str) -> None:
    """Executables of `ros2 run`, and files of the checkout."""
    packages = find_packages(ROOT)
    text = words(service)
    for at in (number for number, word in enumerate(text) if word == 'run'):
        package, executable = text[at + 1 : at + 3]
        setup = (packages[package].folder / 'setup.py').read_text()
        assert f"'{executable} = " in setup
    for word in text:
        if word.startswith((INSIDE, 'docker/')):
            assert (ROOT / word.removeprefix(INSIDE)).stat().st_mode & 0o111


@pytest.mark.parametrize('service', ['arm', 'quad', 'viewer'])
def test_the_health_of_a_robot_is_asked_by_ros2(service: str) -> None:
    """In the environment of the workspace, which a health check does not inherit."""
    how, entrypoint, program, *_ = SERVICES[service]['healthcheck']['test']
    assert (how, entrypoint, program) == ('CMD', f'{INSIDE}docker/entrypoint', 'ros2')
    assert f'ENTRYPOINT ["{entrypoint}"]' in DOCKERFILE


def test_only_the_bus_is_set_up_with_rights() -> None:
    """Everything else is a user without capabilities; all meet on the loopback of the host."""
    for name, service in SERVICES.items():
        assert service['network_mode'] == 'host', name
        root = service.get('user') == 'root', service.get('cap_add') == ['NET_ADMIN']
        assert root == ((True, True) if name == 'vcan' else (False, False))
        assert service['cap_drop'] == ['ALL']
        assert 'privileged' not in service
    last_users = re.findall(r'^USER (\w+)$', DOCKERFILE, re.MULTILINE)
    assert last_users[-1] == 'ubuntu'


def copied() -> Iterator[str]:
    """Yield what the Dockerfile copies from the checkout."""
    for line in re.findall(r'^COPY (?!--from)(.*)$', DOCKERFILE, re.MULTILINE):
        *sources, _target = (word for word in line.split() if not word.startswith('--'))
        yield from sources


def test_what_is_copied_is_there() -> None:
    """Of the checkout, and of the stages above."""
    assert all((ROOT / name).exists() for name in copied())
    stages = re.findall(r'^FROM \S+ AS (\w+)$', DOCKERFILE, re.MULTILINE)
    assert set(re.findall(r'--from=(\w+)', DOCKERFILE)) <= set(stages)
    targets = {service['build']['target'] for service in SERVICES.values()}
    assert targets <= set(stages)


def is_left_out(path: str) -> bool:
    """Return whether .dockerignore leaves a file out, by the patterns that it uses."""
    parts = path.split('/')
    for line in (ROOT / '.dockerignore').read_text().splitlines():
        if not line or line.startswith('#'):
            continue
        anywhere, pattern = line.startswith('**/'), line.removeprefix('**/')
        assert '/' not in pattern
        assert not pattern.startswith('!')
        if any(fnmatch.fnmatchcase(part, pattern) for part in (parts if anywhere else parts[:1])):
            return True
    return False


def test_the_image_gets_the_sources_and_nothing_built() -> None:
    """All that git has, and nothing that it ignores, results included."""
    tracked = run('git', 'ls-files').stdout.splitlines()
    assert len(tracked) > 500
    assert [path for path in tracked if is_left_out(path)] == []
    built = ['.git/HEAD', '.venv.old/x', 'libraries/recording/build/x', '.workspace.lock']
    built += ['arm_model/a/__pycache__/x', 'arm_model/arm_model.egg-info/x']
    ignored = (ROOT / '.gitignore').read_text().split()
    built += [name.strip('/').replace('*', 'x') for name in ignored]
    assert [path for path in built if not is_left_out(path)] == []


def test_a_command_runs_in_the_environment_of_the_workspace(tmp_path: Path) -> None:
    """Whatever folder it is started from, and its exit code is that of the command."""
    entrypoint = ROOT / 'docker' / 'entrypoint'
    bare = {'PATH': '/usr/bin:/bin', 'HOME': str(tmp_path)}
    program = 'import arm_canopen, rclpy, sys; sys.exit(7 if sys.argv[1:] == ["a b"] else 1)'
    command = [str(entrypoint), 'python', '-c', program, 'a b']
    done = subprocess.run(command, cwd=tmp_path, env=bare, check=False)
    assert done.returncode == 7


@pytest.mark.parametrize('name', ['is not there', 'is there'])
def test_a_bus_is_set_up_once_and_is_no_condition(name: str, tmp_path: Path) -> None:
    """Without vcan in the kernel, the remedy is printed, and simulated drives start anyway."""
    done_before, kernel = tmp_path / 'made', tmp_path / 'kernel'
    kernel.touch()
    if name == 'is not there':
        kernel.unlink()
    (tmp_path / 'ip').write_text(f"""#!/bin/sh
echo "$@" >> {tmp_path}/calls
case "$2" in
  show) [ -e {done_before} ] ;;
  add) [ -e {kernel} ] || {{ echo 'Error: Unknown device type.' >&2; exit 2; }}
       touch {done_before} ;;
esac
""")
    (tmp_path / 'ip').chmod(0o755)
    for _ in range(2):
        done = subprocess.run(
            [ROOT / 'docker' / 'vcan', 'vcan7'],
            env={'PATH': f'{tmp_path}:/usr/bin:/bin'},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
    calls = (tmp_path / 'calls').read_text()
    if name == 'is there':
        assert done.stdout == 'vcan7 is up\n'
        assert calls.count('link add dev vcan7 type vcan') == 1
        assert calls.count('link set dev vcan7 txqueuelen 1000 up') == 2
    else:
        assert 'Unknown device type' in done.stdout
        assert 'sudo modprobe vcan' in done.stdout
        assert 'link set' not in calls


def test_rosdep_leaves_to_pip_what_is_pinned() -> None:
    """The keys that the Dockerfile skips are those of the environment, and nothing of ROS."""
    keys = run(sys.executable, 'tools/workspace/rosdep.py').stdout.split()
    assert 'python3-can' in keys
    assert not any(key.endswith(('_msgs', '_srvs')) or key == 'rclpy' for key in keys)
