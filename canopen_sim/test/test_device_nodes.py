# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The nodes fake_slave and fake_slaves as programs, and the helper that spins nodes."""

from __future__ import annotations

from collections.abc import Iterator
import importlib
import os
from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys
import time

from can_addresses import free_multicast
from config_samples import ARTICLE_BUS
from device_rig import EDS
from isolation import Isolation
import pytest

from canopen_core.can import open_bus

pytestmark = pytest.mark.slow

rclpy = pytest.importorskip('rclpy')

PACKAGE = Path(__file__).parents[1]
ARRIVAL = 30.0  # [s] a deadline, no measure


@pytest.fixture(autouse=True)
def own_domain(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the processes in a ROS domain of their own."""
    for name, value in isolation.env.items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the article's bus.yml and our EDS."""
    shutil.copy(ARTICLE_BUS, tmp_path / 'bus.yml')
    shutil.copy(EDS, tmp_path / 'cia402_slave.eds')
    return tmp_path


def start(node: str, **parameters: str | int) -> subprocess.Popen[str]:
    """Start a node with parameters."""
    arguments = [part for k, v in parameters.items() for part in ('-p', f'{k}:={v}')]
    environment = {
        **os.environ,
        'PYTHONPATH': os.pathsep.join((str(PACKAGE), os.environ.get('PYTHONPATH', ''))),
    }
    return subprocess.Popen(
        [sys.executable, '-m', f'canopen_sim.nodes.{node}', '--ros-args', *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    )


@pytest.fixture
def processes() -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that are killed at the end, whatever happens."""
    started: list[subprocess.Popen[str]] = []
    yield started
    for process in started:
        process.kill()
        process.communicate()


def output(process: subprocess.Popen[str]) -> str:
    """Wait for the end of a process and return what it wrote."""
    return process.communicate(timeout=ARRIVAL)[0]


@pytest.mark.scenario
def test_all_slaves_of_the_article(folder: Path, processes: list[subprocess.Popen[str]]) -> None:
    """Seven drives boot on the bus; SIGTERM ends the process cleanly."""
    name = free_multicast()
    with open_bus(name) as bus:
        process = start('fake_slaves', bus_config=str(folder / 'bus.yml'), can_interface_name=name)
        processes.append(process)
        booted: set[int] = set()
        deadline = time.monotonic() + ARRIVAL
        while len(booted) < 7:
            assert time.monotonic() < deadline
            assert process.poll() is None, output(process)
            booted |= {f.can_id for f in bus.receive(0.5) if f.data == b'\x00'}
        assert booted == set(range(0x702, 0x709))
        process.send_signal(signal.SIGTERM)
        text = output(process)
    assert process.returncode == 0, text
    assert f'7 simulated drives on {name}' in text
    assert 'Traceback' not in text


@pytest.mark.scenario
def test_node_ids_that_are_on_the_bus_are_refused(
    folder: Path, processes: list[subprocess.Popen[str]]
) -> None:
    """A second set of drives ends with words; the first goes on."""
    name = free_multicast()
    with open_bus(name) as bus:
        first = start('fake_slave', node_id=2, slave_config=str(EDS), can_interface_name=name)
        processes.append(first)
        deadline = time.monotonic() + ARRIVAL
        while not any(frame.can_id == 0x702 for frame in bus.receive(0.5)):
            assert time.monotonic() < deadline
            assert first.poll() is None, output(first)
    second = start('fake_slaves', bus_config=str(folder / 'bus.yml'), can_interface_name=name)
    processes.append(second)
    text = output(second)
    assert second.returncode == 1, text
    assert f'{name} has devices with these node ids already' in text
    assert 'of node id 2. End the other' in text
    assert first.poll() is None, output(first)


BAD: dict[str, tuple[str, dict[str, str | int], str]] = {
    'no bus.yml given': ('fake_slaves', {}, 'no bus_config'),
    'no such bus': ('fake_slave', {'can_interface_name': 'nothing99'}, 'nothing99'),
    'node id out of range': ('fake_slave', {'node_id': 128}, 'node_id'),
}


@pytest.mark.scenario
@pytest.mark.parametrize('case', BAD)
def test_errors_are_one_message(processes: list[subprocess.Popen[str]], case: str) -> None:
    """What cannot work is said in one message with the culprit; the exit code is 1."""
    node, parameters, culprit = BAD[case]
    process = start(node, **{'can_interface_name': free_multicast(), **parameters})
    processes.append(process)
    text = output(process)
    assert process.returncode == 1, text
    assert culprit in text
    assert text.count('[FATAL]') == 1
    assert 'Traceback' not in text


@pytest.mark.parametrize(
    ('module', 'sources'),
    [
        ('canopen_sim.nodes.fake_slave', ('fake_slave',)),
        ('canopen_sim.nodes.fake_slaves', ('fake_slaves',)),
        ('arm_canopen.nodes.master', ('master',)),
    ],
)
def test_help_names_every_parameter(module: str, sources: tuple[str, ...]) -> None:
    """What a program does, an example, and each parameter that it declares; nothing is started."""
    done = subprocess.run(
        [sys.executable, '-m', module, '--help'],
        capture_output=True,
        text=True,
        timeout=ARRIVAL,
        check=True,
    )
    assert 'example:' in done.stdout
    package = Path(str(importlib.import_module(module).__file__)).parent
    declared = {
        name
        for source in sources
        for name in re.findall(
            r"\.(?:text|whole|number|flag)\(\s*'(\w+)'", (package / f'{source}.py').read_text()
        )
    }
    if module.startswith('canopen_sim'):
        declared.add('store_directory')
    if 'declare_black_box' in (package / f'{sources[0]}.py').read_text():
        declared |= {'black_box_folder', 'black_box_window'}
    assert declared | {'can_interface_name', 'thread_priority'} == {
        name
        for row in re.findall(r'^  ([a-z_]+(?:, [a-z_]+)*)(?:  |$)', done.stdout, re.MULTILINE)
        for name in row.split(', ')
    }


def test_a_single_device_takes_the_bus_that_all_programs_take(
    processes: list[subprocess.Popen[str]],
) -> None:
    """Without a name the bus is `auto`: one command does on any host."""
    process = start('fake_slave', node_id=9)
    processes.append(process)
    assert process.stdout is not None
    line = next(line for line in process.stdout if 'simulated drive 9' in line)
    assert ' on vcan0' in line or ' on udp_multicast:' in line
