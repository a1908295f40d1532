# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Files of the checkout that a program makes are what it makes now."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
import runpy
from typing import Any

from manual_page import CHECKOUT
import pytest

from arm_bringup.srdf import main as make_srdf
from quad_hardware.protocol.page import protocol_page

ROBOTS = CHECKOUT / 'arm_bringup' / 'robots'
EDS = CHECKOUT / 'arm_canopen' / 'eds'


def defined(path: str) -> Mapping[str, Any]:
    """Return what a script of the checkout defines."""
    return runpy.run_path(str(CHECKOUT / path))


def example_arm() -> Mapping[Path, str]:
    """Return the files of arm_model, which are made from the Panda of arm_bringup."""
    files: Mapping[Path, str] = defined('arm_bringup/tools/make_example_arm.py')['contents']()
    return files


def from_drive(path: str, function: str, made: Path) -> Mapping[Path, str]:
    """Return what a script makes of the EDS of the simulated drive."""
    return {made: defined(path)[function]((EDS / 'cia402_drive.eds').read_text('ascii'))}


def srdf(name: str, *options: str) -> Mapping[Path, str]:
    """Return the SRDF of a robot."""
    words = [str(ROBOTS / name), *options, '--samples', '3000', '--output', 'made.srdf']
    assert make_srdf(words) == 0
    return {ROBOTS / name / f'{name}.srdf': Path('made.srdf').read_text()}


PROGRAMS: Mapping[str, Callable[[], Mapping[Path, str]]] = {
    'arm_bringup/tools/make_example_arm.py': example_arm,
    'arm_bringup/tools/make_prbt_dcf.py': lambda: from_drive(
        'arm_bringup/tools/make_prbt_dcf.py', 'derive', ROBOTS / 'prbt' / 'prbt_0_1.dcf'
    ),
    'ros2 run quad_hardware protocol': lambda: {
        CHECKOUT / 'quad_hardware' / 'PROTOCOL.md': protocol_page()
    },
    'ros2 run arm_planning srdf panda': lambda: srdf('panda', '--xacro-arg', 'fingers:=true'),
    'ros2 run arm_planning srdf prbt': lambda: srdf('prbt'),
    'ros2 run arm_planning srdf gp110': lambda: srdf('gp110'),
}


@pytest.mark.slow
@pytest.mark.parametrize('program', PROGRAMS)
def test_they_are_up_to_date(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Byte by byte; the program refreshes them."""
    monkeypatch.chdir(tmp_path)
    for path, text in PROGRAMS[program]().items():
        assert path.read_text('utf-8') == text, program
