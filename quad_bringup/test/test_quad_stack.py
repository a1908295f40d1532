# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which processes a quadruped has, with which arguments."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from process_supervisor import ProcessSpec, StartError
from quad_bringup.stack import quad_processes, Stack

PARAMETERS = Path('/tmp/parameters.yaml')
OURS = ('quad_hardware', 'quad_controller', 'robot_viewer')


def underlay(folder: Path, *packages: str) -> Callable[[str, str], Path | None]:
    """Make executables of packages that are there; answer as find_executable does."""

    def find(package: str, name: str) -> Path | None:
        if package not in packages:
            return None
        file = folder / package / name
        file.parent.mkdir(exist_ok=True)
        file.touch(mode=0o755)
        return file

    return find


def processes(folder: Path, stack: Stack, *packages: str) -> dict[str, ProcessSpec]:
    """Plan a stack on an underlay with our packages and more."""
    find = underlay(folder, *OURS, *packages)
    return {spec.name: spec for spec in quad_processes(stack, PARAMETERS, find)}


def test_hardware_has_no_simulator_and_simulation_has(tmp_path: Path) -> None:
    """The bridge cannot tell the difference: it opens a serial port."""
    real = processes(tmp_path, Stack('/dev/ttyAMA0'))
    simulated = processes(tmp_path, Stack('/dev/ttyAMA0', simulate=True))
    assert set(real) == {'hardware', 'controller', 'robot_state'}
    assert set(simulated) == {'fake_xgo', *real}
    for name, spec in real.items():
        assert simulated[name] == spec
    assert '/dev/ttyAMA0' in simulated['fake_xgo'].argv
    assert 'port:=/dev/ttyAMA0' in real['hardware'].argv


def test_everyone_gets_the_same_description(tmp_path: Path) -> None:
    """As a parameter file; the calibration comes after it and wins."""
    stack = Stack('/dev/ttyAMA0', calibration=Path('/tmp/calibration.yaml'))
    found = processes(tmp_path, stack)
    for spec in found.values():
        assert spec.argv[spec.argv.index('--params-file') + 1] == str(PARAMETERS)
    assert found['hardware'].argv[-2:] == ('--params-file', '/tmp/calibration.yaml')


def test_preset_and_arm_reach_the_simulator(tmp_path: Path) -> None:
    """So that physics has the robot of the description."""
    stack = Stack('/tmp/xgo', 'mini', simulate=True, arm=True)
    argv = processes(tmp_path, stack)['fake_xgo'].argv
    assert argv[argv.index('--preset') + 1] == 'mini'
    assert '--arm' in argv
    assert '--servo' not in argv
    argv = processes(tmp_path, Stack('p', simulate=True, servo='vendor_rl'))['fake_xgo'].argv
    assert argv[argv.index('--servo') + 1] == 'vendor_rl'
    assert '--arm' not in processes(tmp_path, Stack('/tmp/xgo', simulate=True))['fake_xgo'].argv


def test_both_ends_of_the_line_speak_the_same_protocol(tmp_path: Path) -> None:
    """A simulated robot speaks both where the bridge asks."""
    for protocol, spoken in (('auto', 'both'), ('new', 'new'), ('old', 'old')):
        found = processes(tmp_path, Stack('p', simulate=True, protocol=protocol))
        argv = found['fake_xgo'].argv
        assert argv[argv.index('--protocol') + 1] == spoken
        assert f'protocol:={protocol}' in found['hardware'].argv


def test_gait_and_policy_reach_the_controller(tmp_path: Path) -> None:
    """A policy only where there is one."""
    argv = processes(tmp_path, Stack('p', gait='crawl'))['controller'].argv
    assert 'gait:=crawl' in argv
    assert not any('policy:=' in word for word in argv)
    argv = processes(tmp_path, Stack('p', policy=Path('/a.onnx')))['controller'].argv
    assert 'policy:=/a.onnx' in argv


def test_who_commands_stops_before_who_transmits_before_who_obeys(tmp_path: Path) -> None:
    """So nobody hears commands of nobody."""
    found = processes(tmp_path, Stack('p', simulate=True))
    orders = {name: spec.stop_order for name, spec in found.items()}
    assert orders['controller'] < orders['hardware'] < orders['fake_xgo']


def test_the_public_robot_state_publisher_runs_where_it_is_installed(tmp_path: Path) -> None:
    """Ours elsewhere; /tf is no reason to end when it dies."""
    ours = processes(tmp_path, Stack('p'))['robot_state']
    public = processes(tmp_path, Stack('p'), 'robot_state_publisher')['robot_state']
    assert ours.argv[0].endswith('robot_viewer/robot_state_publisher')
    assert public.argv[0].endswith('robot_state_publisher/robot_state_publisher')
    assert not ours.required
    assert not public.required


@pytest.mark.parametrize('missing', OURS)
def test_a_workspace_that_is_not_built_says_so(tmp_path: Path, missing: str) -> None:
    """Whichever package it is."""
    find = underlay(tmp_path, *(name for name in OURS if name != missing))
    with pytest.raises(StartError, match='make build'):
        quad_processes(Stack('p', simulate=True), PARAMETERS, find)
