# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The cores as libraries: installed from the checkout into an environment that has no ROS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import time

from isolation import Isolation
import pytest
from readme_examples import READMES, run_examples

from arm_canopen import open_bus
from canopen_core.can import Frame

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group('without-ros')]

CHECKOUT = Path(__file__).parents[1]
INSTALLED = (
    'arm_planning',
    'arm_servo',
    'canopen_sim',
    'canopen_tools',
    'quad_bringup',
    'quad_controller[physics]',
    'quad_sim[env]',
    'quad_teleop',
    'robot_viewer',
    'arm_bringup[motion]',
)
"""Packages that nothing else requires; they bring all others."""
IMPORTED = (
    'arm_bringup',
    'arm_canopen',
    'arm_model',
    'arm_planning',
    'arm_servo',
    'arm_trajectory',
    'canopen_core',
    'canopen_sim',
    'canopen_tools',
    'first_motion',
    'message_definitions',
    'operator_input',
    'process_supervisor',
    'quad_bringup',
    'quad_controller',
    'quad_description',
    'quad_hardware',
    'quad_sim',
    'quad_sim.env',
    'quad_sim.physics',
    'quad_teleop',
    'black_box',
    'realtime_loop',
    'robot_viewer',
    'rosbag_files',
    'urdf_reader',
    'xgo_lib2',
)
COMMANDS = (
    'canopen',
    'canopen-candump',
    'canopen-fake-slaves',
    'fake_xgo',
    'operator-show-gamepad',
    'quad-check-policy',
    'quad-export-mjcf',
    'quad-urdf',
    'xgo-calibrate',
    'xgo-doctor',
)
"""What has an option --help; operator-show-keys and xgo-protocol have no options at all."""
FOR_ROS = (
    'bringup',
    'calibrate',
    'candump',
    'check',
    'check_policy',
    'controller_node',
    'demo',
    'display',
    'doctor',
    'export_mjcf',
    'fake_slave',
    'fake_slaves',
    'hardware_node',
    'master',
    'motion_master',
    'motion_node',
    'protocol',
    'robot_state_publisher',
    'servo_node',
    'teleop_keyboard',
    'twist_mux',
    'urdf',
)
"""Executables of `ros2 run`, which would die on rclpy or have the name of another program."""
TIMEOUT = 120.0  # [s] for a program on a busy machine
NO_NETWORK = ('dns error', 'Failed to fetch', 'connect error', 'client error')
NOT_SOURCE = shutil.ignore_patterns('__pycache__', '*.egg-info', 'build', 'test', 'bench')


@dataclass(frozen=True)
class Environment:
    """A virtual environment without ROS."""

    folder: Path  # where it is
    variables: Mapping[str, str]  # environment of its programs

    def run(self, *argv: str | Path) -> subprocess.CompletedProcess[str]:
        """Run one of its commands to its end, nothing on its standard input."""
        command = [str(self.folder / 'bin' / argv[0]), *map(str, argv[1:])]
        return subprocess.run(
            command,
            env=self.variables,
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )

    @contextmanager
    def running(self, *argv: str | Path) -> Iterator[subprocess.Popen[str]]:
        """Run one of its commands meanwhile."""
        command = [str(self.folder / 'bin' / argv[0]), *map(str, argv[1:])]
        with subprocess.Popen(
            command,
            env=self.variables,
            cwd=self.folder,
            start_new_session=True,
            stdout=subprocess.PIPE,
            text=True,
        ) as process:
            try:
                yield process
            finally:
                process.terminate()
                process.wait(TIMEOUT)


@pytest.fixture(scope='module')
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """Install the packages from a copy of the checkout, what they need from PyPI."""
    source = tmp_path_factory.mktemp('checkout')
    packages = [CHECKOUT / 'libraries', *(path.parent for path in CHECKOUT.glob('*/setup.py'))]
    for package in packages:
        shutil.copytree(package, source / package.name, ignore=NOT_SOURCE)
    (source / 'tools').mkdir()
    shutil.copy(CHECKOUT / 'tools' / 'setup_package.py', source / 'tools')
    folder = tmp_path_factory.mktemp('environment')
    subprocess.run([sys.executable, '-m', 'venv', '--without-pip', folder], check=True)
    kept = {'HOME', 'LANG', 'TMPDIR', 'UV_CACHE_DIR', 'SSL_CERT_FILE', 'XDG_CACHE_HOME'}
    kept |= {name for name in os.environ if name.lower().endswith('_proxy')}
    variables = {name: os.environ[name] for name in kept & os.environ.keys()}
    variables['PATH'] = f'{folder / "bin"}:/usr/bin:/bin'
    variables['PYTHONUNBUFFERED'] = '1'
    made = Environment(folder, variables)
    _install(made, ['setuptools>=70', 'sybil'])
    # an environment for each of twenty builds would take half a minute
    _install(made, ['--no-build-isolation', *(f'{source}/{name}' for name in INSTALLED)])
    return made


def _install(environment: Environment, arguments: Sequence[str]) -> None:
    uv = Path(sys.prefix) / 'bin' / 'uv'
    python = environment.folder / 'bin' / 'python'
    done = subprocess.run(
        [uv, 'pip', 'install', '--quiet', '--python', python, *arguments],
        env={**os.environ, **environment.variables},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode and any(words in done.stderr for words in NO_NETWORK):
        pytest.skip(f'PyPI cannot be reached for what the packages need: {done.stderr[-300:]}')
    assert done.returncode == 0, done.stderr


def test_there_is_no_ros(environment: Environment) -> None:
    """What passes here does not pass because ROS is there after all."""
    for module in ('rclpy', 'ament_index_python', 'std_msgs'):
        assert environment.run('python', '-c', f'import {module}').returncode


def test_packages_are_imported(environment: Environment) -> None:
    """No core asks for rclpy or the index of ament, and all that it needs was installed."""
    code = '\n'.join(f'import {name}' for name in IMPORTED)
    done = environment.run(
        'python', '-c', f'{code}\nimport sys; assert "rclpy" not in sys.modules'
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize('command', COMMANDS)
def test_commands_work(environment: Environment, command: str) -> None:
    """Each that is installed explains itself under its own name."""
    done = environment.run(command, '--help')
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f'usage: {command}')


def test_what_needs_ros_is_no_command(environment: Environment) -> None:
    """Nothing in bin dies on rclpy, or stands in the way of can-utils' candump."""
    commands = {path.name for path in (environment.folder / 'bin').iterdir()}
    assert not commands & set(FOR_ROS)


def test_a_bus_is_checked(environment: Environment) -> None:
    """`canopen check` reads the bus.yml and the EDS of a shipped robot."""
    bus_config = CHECKOUT / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'
    done = environment.run('canopen', 'check', bus_config)
    assert done.returncode == 0, done.stderr
    assert 'bus.yml: 0 errors' in done.stdout


def test_frames_are_shown(environment: Environment, isolation: Isolation) -> None:
    """`canopen-candump` shows a frame of a multicast bus with its meaning."""
    deadline = time.monotonic() + TIMEOUT
    with (
        open_bus(isolation.bus) as bus,
        environment.running('canopen-candump', isolation.bus, '-n', '1') as dump,
    ):
        while dump.poll() is None and time.monotonic() < deadline:
            bus.send(Frame(0x702, b'\x05'))  # until it has joined the group
            bus.receive(0.05)
        assert dump.stdout is not None
        assert 'heartbeat' in dump.stdout.read().lower()


MOVE = """
import sys
from arm_canopen import CanopenMaster
with CanopenMaster.from_bus_yml(sys.argv[1], sys.argv[2]) as master:
    master.boot(60.0)
    drive = master.drive('panda_joint1')
    drive.enable()
    drive.move_to(0.1)
    print(drive.position)
"""


@pytest.mark.scenario
def test_drives_are_moved(environment: Environment, isolation: Isolation) -> None:
    """`CanopenMaster` leads the drives that `canopen-fake-slaves` simulates."""
    bus_config = CHECKOUT / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'
    argv = ('canopen-fake-slaves', bus_config, '--can', isolation.bus)
    with environment.running(*argv) as devices:
        assert devices.stdout is not None
        assert devices.stdout.readline()  # they are there
        done = environment.run('python', '-c', MOVE, bus_config, isolation.bus)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == pytest.approx(0.1, abs=0.002)


def test_a_robot_answers_the_doctor(environment: Environment, tmp_path: Path) -> None:
    """`xgo-doctor` speaks the serial protocol with the simulated board; ROS is no error."""
    port = tmp_path / 'xgo'
    with environment.running('fake_xgo', '--link', port) as board:
        assert board.stdout is not None
        assert board.stdout.readline()  # it is there
        done = environment.run('xgo-doctor', '--port', port)
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'protocol' in done.stdout


def test_a_policy_walks(environment: Environment) -> None:
    """The shipped policy is found without the index of ament, and walks in physics."""
    argv = ('trot_ppo', '--walk', '0.2', '0', '0', '--duration', '1', '--servo', 'firm')
    done = environment.run('quad-check-policy', *argv)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_model_is_printed(environment: Environment) -> None:
    """The URDF comes from files that are installed with the package."""
    done = environment.run('quad-urdf')
    assert done.returncode == 0, done.stderr
    assert '<robot' in done.stdout


@pytest.mark.scenario
@pytest.mark.parametrize('package', READMES)
def test_examples_of_the_readmes_run(
    environment: Environment, package: str, tmp_path: Path, isolation: Isolation
) -> None:
    """As they are printed; what `>>>` shows is what comes."""
    variables = {**environment.variables, 'ROS_DOMAIN_ID': str(isolation.domain_id)}
    python = environment.folder / 'bin' / 'python'
    done = run_examples(package, tmp_path, python, variables)
    assert done.returncode == 0, done.stderr
    assert re.search(r'^[1-9]\d* examples$', done.stdout, re.MULTILINE)


def test_no_readme_is_forgotten() -> None:
    """Each README with an example is run."""
    written = {
        path.parent.name
        for path in CHECKOUT.glob('*/README.md')
        if re.search('^```python$', path.read_text(), re.MULTILINE)
    }
    assert written <= set(READMES)
