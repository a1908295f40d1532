# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Generated files are up to date, and copies of public interfaces equal the public ones.

Those are compared by type hashes (REP 2016) and by constants.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import importlib
import json
from pathlib import Path
import re
import runpy
from typing import Any

from ament_index_python.packages import get_package_share_directory
from canopen_interfaces.srv import COReadID, COWriteID
from control_msgs.action import FollowJointTrajectory
from manual_page import CHECKOUT
from moveit_msgs.msg import CollisionObject, MoveItErrorCodes, PlanningSceneComponents
import pytest
from rosidl_generator_py import import_type_support  # type: ignore[import-untyped]

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


FOLDER = Path(__file__).parents[1] / 'interfaces'


def listed() -> dict[str, list[str]]:
    """Read what is listed of each interface: its hash, and a mark where nothing proves it."""
    path = Path(__file__).with_name('public_interface_hashes.txt')
    lines = path.read_text(encoding='ascii').splitlines()
    entries = (line.split() for line in lines if not line.startswith('#'))
    return {name: rest for name, *rest in entries}


LISTED = listed()
PUBLIC_HASHES = {name: f'RIHS01_{rest[0]}' for name, rest in LISTED.items()}
UNPROVEN = {name for name, rest in LISTED.items() if rest[1:] == ['-']}
"""Interfaces of which no build of the public files was found."""


def built_hash(interface: str) -> str:
    """Read the hash that rosidl computed while it built an interface."""
    package, kind, name = interface.split('/')
    path = Path(get_package_share_directory(package), kind, f'{name}.json')
    entries = json.loads(path.read_text(encoding='utf-8'))['type_hashes']
    (value,) = (entry['hash_string'] for entry in entries if entry['type_name'] == interface)
    return str(value)


def test_every_hash_equals_the_public_one() -> None:
    """A peer that was built from the public files accepts our messages."""
    assert changed(PUBLIC_HASHES.keys() - UNPROVEN) == []


def test_definitions_that_were_compared_by_eye_do_not_change() -> None:
    """Nothing else proves them; a change has to be compared again."""
    assert changed(UNPROVEN) == []


def changed(interfaces: Iterable[str]) -> list[str]:
    """Return those whose hash is another one than listed."""
    return [name for name in sorted(interfaces) if built_hash(name) != PUBLIC_HASHES[name]]


def test_the_readme_says_how_much_is_proven() -> None:
    """Interfaces and proven ones of each package, and of all."""
    text = (FOLDER / 'README.md').read_text(encoding='utf-8')
    rows = re.findall(r'^\| `(\w+)` .*\| (\d+) \| (\d+) \|$', text, re.MULTILINE)
    counted = {
        package: (str(len(names)), str(len(names - UNPROVEN)))
        for package in {name.split('/')[0] for name in PUBLIC_HASHES}
        for names in [{name for name in PUBLIC_HASHES if name.startswith(f'{package}/')}]
    }
    assert {package: (total, proven) for package, total, proven in rows} == counted
    assert f'Of {len(PUBLIC_HASHES) - len(UNPROVEN)} the hash' in text
    assert f'For the {len(UNPROVEN)} with' in text


def test_every_interface_of_a_copied_package_is_compared() -> None:
    """An interface that is added to interfaces/ needs its public hash."""
    written = {
        f'{path.parts[-3]}/{path.parts[-2]}/{path.stem}'
        for suffix in ('msg', 'srv', 'action')
        for path in FOLDER.glob(f'*/{suffix}/*.{suffix}')
    }
    assert written == set(PUBLIC_HASHES)


@pytest.mark.parametrize('package', sorted({name.split('/')[0] for name in PUBLIC_HASHES}))
def test_python_has_every_interface_with_its_type_support(package: str) -> None:
    """A client of others imports any of them, and rclpy can send it."""
    import_type_support(package)
    for interface in PUBLIC_HASHES:
        owner, kind, name = interface.split('/')
        if owner == package:
            made = getattr(importlib.import_module(f'{package}.{kind}'), name)
            made.__class__.__import_type_support__()
            assert made.__class__._TYPE_SUPPORT is not None


@pytest.mark.parametrize('service', [COReadID, COWriteID])
def test_data_type_constants(service: type[Any]) -> None:
    """The hash leaves constants out; they are the type numbers of CiA 301, table 44."""
    names = ('INT8', 'INT16', 'INT32', 'UINT8', 'UINT16', 'UINT32')
    values = [getattr(service.Request, f'CANOPEN_DATATYPE_{name}') for name in names]
    assert values == [2, 3, 4, 5, 6, 7]


def test_constants_that_clients_compare_with() -> None:
    """Samples of what the hash leaves out: error codes, operations, bits."""
    assert (MoveItErrorCodes.SUCCESS, MoveItErrorCodes.FAILURE) == (1, 99999)
    assert (MoveItErrorCodes.NO_IK_SOLUTION, MoveItErrorCodes.GOAL_IN_COLLISION) == (-31, -12)
    operations = (CollisionObject.ADD, CollisionObject.REMOVE, CollisionObject.APPEND)
    assert operations == (b'\x00', b'\x01', b'\x02')
    assert PlanningSceneComponents.OBJECT_COLORS == 512
    assert FollowJointTrajectory.Result.GOAL_TOLERANCE_VIOLATED == -5
