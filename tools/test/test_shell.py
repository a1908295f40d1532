# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

from workspace.layout import this_checkout
from workspace.shell import SHELLS, write_front_end, write_setup_scripts
from workspace.underlay import Underlay, UnderlayKind

pytestmark = pytest.mark.slow

PRINTED = ('PATH', 'AMENT_PREFIX_PATH', 'LD_LIBRARY_PATH', 'ROS_DISTRO', 'VIRTUAL_ENV')


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout with env.sh and a finished environment on wheels."""
    root = tmp_path / 'check out'
    venv = root / '.venv'
    (venv / 'bin').mkdir(parents=True)
    shutil.copy(this_checkout().root / 'env.sh', root)
    library = Path('libraries') / 'ros_runtime'
    shutil.copytree(this_checkout().root / library, root / library)
    (venv / 'bin' / 'python').symlink_to(sys.executable)
    wheels = Underlay(UnderlayKind.WHEELS, venv)
    write_setup_scripts(venv, wheels, [venv / 'lib', venv / 'more.libs'])
    (venv / '.workspace.json').write_text('{}')
    return root


def shell(name: str, script: str, cwd: Path, **environ: str) -> 'subprocess.CompletedProcess[str]':
    """Run a script in a shell with a small environment."""
    program = shutil.which(name)
    if program is None:
        pytest.skip(f'there is no {name} here')
    return subprocess.run(
        [program, '-c', script],
        cwd=cwd,
        env={'PATH': '/usr/bin:/bin', **environ},
        capture_output=True,
        text=True,
        check=False,
    )


def variables(text: str) -> dict[str, str]:
    """Parse what `env` prints."""
    return dict(line.split('=', 1) for line in text.splitlines() if '=' in line)


@pytest.mark.parametrize('name', ['bash', 'zsh'])
@pytest.mark.parametrize('options', ['', 'set -eu;'])
def test_env_sh_from_any_folder_twice(
    checkout: Path, tmp_path: Path, name: str, options: str
) -> None:
    """Sourced once or twice, from elsewhere, in a strict shell: the same environment."""
    source = f'. "{checkout}/env.sh"'
    once = shell(name, f'{options} {source}; env', tmp_path)
    twice = shell(name, f'{options} {source}; {source}; env', tmp_path)
    assert once.returncode == 0, once.stderr
    first, second = variables(once.stdout), variables(twice.stdout)
    assert [first[key] for key in PRINTED] == [second[key] for key in PRINTED]
    venv = checkout / '.venv'
    assert first['PATH'] == f'{venv}/bin:/usr/bin:/bin'
    assert first['LD_LIBRARY_PATH'] == f'{venv}/lib:{venv}/more.libs'
    assert first['AMENT_PREFIX_PATH'] == str(venv)
    assert not [key for key in first if key.startswith('_workspace')]


def test_discovery_stays_on_this_host_by_default(checkout: Path) -> None:
    """Whatever ROS's own variables say, the profile with loopback alone is named."""
    for outer in (
        {},
        {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'},
        {'ROS_STATIC_PEERS': '10.0.0.1'},
        {'ROS_DISCOVERY_SERVER': '10.0.0.1:11811'},
        {'DDS_NETWORK': 'localhost'},
    ):
        done = shell('bash', '. ./env.sh; env', checkout, **outer)
        assert done.returncode == 0
        found = variables(done.stdout)
        package = checkout / 'libraries' / 'ros_runtime' / 'dds_network'
        closed = package / 'dds_network_localhost.xml'
        assert found['FASTRTPS_DEFAULT_PROFILES_FILE'] == str(closed)
        assert found['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SYSTEM_DEFAULT'
        # what does not open anything is reported
        assert bool(done.stderr) == any('ROS_' in name for name in outer)


def test_an_interface_that_is_not_there_keeps_the_shell_closed(checkout: Path) -> None:
    """The status of `source` shows it, and nothing is open."""
    script = '. ./env.sh; echo "status $?"; env'
    done = shell('bash', script, checkout, DDS_NETWORK='no.such.interface.invalid')
    assert 'status 1' in done.stdout
    assert 'dds_network_localhost' in variables(done.stdout)['FASTRTPS_DEFAULT_PROFILES_FILE']
    assert 'DDS_NETWORK' in done.stderr


def test_a_ros_that_was_sourced_before_is_left(checkout: Path) -> None:
    """Packages of another distribution do not come before the wheels, and a line says so."""
    done = shell(
        'bash',
        '. ./env.sh; env',
        checkout,
        AMENT_PREFIX_PATH='/opt/ros/humble',
        PYTHONPATH='/opt/ros/humble/lib',
        ROS_DISTRO='humble',
    )
    assert variables(done.stdout)['AMENT_PREFIX_PATH'] == str(checkout / '.venv')
    assert 'PYTHONPATH' not in variables(done.stdout)
    assert 'leaving the ROS that was sourced before (humble)' in done.stderr


def test_unfinished_environment_is_named(checkout: Path) -> None:
    """Without the state file env.sh says what to run, fails, and does not end the shell."""
    (checkout / '.venv' / '.workspace.json').unlink()
    done = shell('bash', '. ./env.sh; echo "status $?"', checkout)
    assert done.stdout.strip() == 'status 1'
    assert 'make -C' in done.stderr


@pytest.mark.parametrize('name', SHELLS)
def test_system_ros_is_sourced(tmp_path: Path, name: str) -> None:
    """On a system's ROS the scripts begin with that one's own."""
    prefix = tmp_path / 'opt ros'
    prefix.mkdir()
    (prefix / f'setup.{name}').write_text('export ROS_DISTRO=jazzy FROM_SYSTEM=1\n')
    write_setup_scripts(tmp_path, Underlay(UnderlayKind.SYSTEM, prefix), [])
    done = shell('sh' if name == 'sh' else name, f'. ./local_setup.{name}; env', tmp_path)
    assert variables(done.stdout)['FROM_SYSTEM'] == '1'
    assert 'LD_LIBRARY_PATH' not in variables(done.stdout)


def test_front_end_gives_way_to_a_real_ros2(tmp_path: Path) -> None:
    """Our `ros2` exists only where the ROS below has none, and goes when one comes."""
    venv, prefix = tmp_path / '.venv', tmp_path / 'ros'
    command = venv / 'bin' / 'ros2'
    system = Underlay(UnderlayKind.SYSTEM, prefix)
    write_front_end(venv, Underlay(UnderlayKind.WHEELS, venv), tmp_path / 'frontend')
    assert command.stat().st_mode & 0o111 == 0o111
    write_front_end(venv, system, tmp_path / 'frontend')
    assert command.exists()
    (prefix / 'bin').mkdir(parents=True)
    (prefix / 'bin' / 'ros2').touch()
    write_front_end(venv, system, tmp_path / 'frontend')
    assert not command.exists()


def test_front_end_passes_the_exit_code_on(tmp_path: Path) -> None:
    """The script runs `main` of the package beside it and ends with its number."""
    folder = tmp_path / 'front end'
    (folder / 'ros2_frontend').mkdir(parents=True)
    (folder / 'ros2_frontend' / 'main.py').write_text('def main() -> int:\n    return 7\n')
    venv = tmp_path / '.venv'
    (venv / 'bin').mkdir(parents=True)
    (venv / 'bin' / 'python').symlink_to(shutil.which('python3') or '')
    write_front_end(venv, Underlay(UnderlayKind.WHEELS, venv), folder)
    assert subprocess.run([venv / 'bin' / 'ros2'], check=False).returncode == 7
